"""`stillhook identify ...`: friction from supplier maps and from crane tests."""

from __future__ import annotations

import typer

from stillhook.cli.identify.curve import curve
from stillhook.cli.identify.friction import example_campaign, friction
from stillhook.cli.identify.motor import example_map, motor

app = typer.Typer(no_args_is_help=True)
app.command("motor")(motor)
app.command("friction")(friction)
app.command("curve")(curve)
app.command("example-map")(example_map)
app.command("example-campaign")(example_campaign)
