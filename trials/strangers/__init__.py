"""Lifts, cranes, vessels, load charts, weathers and payloads that are legal and not the library's, run through the
commands, with checks of what must hold.

python -m trials.strangers --draws 200 --first 1 --out FOLDER
"""
