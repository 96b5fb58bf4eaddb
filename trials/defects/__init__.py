"""Campaigns of a known truth, healthy and with known defects, through `stillhook validate`."""
