"""`stillhook identify ...`: friction from supplier maps and from crane tests."""

from __future__ import annotations

import typer

from stillhook.cli.identify.curve import curve
from stillhook.cli.identify.friction import friction
from stillhook.cli.identify.motor import motor

app = typer.Typer(no_args_is_help=True)
app.command("motor")(motor)
app.command("friction")(friction)
app.command("curve")(curve)
