"""`stillhook identify example-campaign`: synthetic crane tests, to try the complete workflow from logs to a friction
model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.options import Json
from stillhook.report.terminal import print_json, progress_bar


def example_campaign(
    name: Annotated[
        str,
        typer.Argument(help="L4593, crane-2 or crane-2-extended: the tests of Moslatt 2020 tables 2.3, D 2 and D 5."),
    ],
    out: Annotated[Path, typer.Argument(help="Folder for campaign.toml, the logs and reference.toml.")],
    noise: Annotated[str, typer.Option(help="none: as simulated, all digits; typical: as a PLC sees it.")] = "typical",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the noise.")] = 0,
    duration: Annotated[str, typer.Option(help="Length of each test.")] = "20 min",
    layer: Annotated[
        int | None, typer.Option(help="Layer of wire (default: the outermost that the pressures allow).")
    ] = None,
    reference: Annotated[
        list[str] | None,
        typer.Option(help="Friction or motor set that the crane really has, for a blind test. May be repeated."),
    ] = None,
    parquet: Annotated[bool, typer.Option("--parquet", help="Logs as Parquet instead of CSV.")] = False,
    json: Json = False,
) -> None:
    """Write the logs of a friction test campaign that the twin ran instead of a crane. Everything is marked SYNTHETIC.

    Example: stillhook identify example-campaign L4593 my-tests
    """
    from stillhook.identify.system_friction.campaign.synthetic import campaign_plan, write_campaign
    from stillhook.identify.system_friction.fitting.draws import crane_with
    from stillhook.library import load_crane, load_set
    from stillhook.logs.synthetic.instruments import Instruments, noise_of

    plan, instruments = campaign_plan(name), Instruments(noise=noise_of(noise), seed=seed)
    crane = crane_with(load_crane(plan.crane), *(load_set(name) for name in reference)) if reference else None
    with progress_bar(f"{plan.crane}: {len(plan.tests)} tests") as bar:
        campaign = write_campaign(
            plan,
            out,
            instruments=instruments,
            reference=crane,
            duration=duration,
            layer=layer,
            parquet=parquet,
            progress=bar,
        )
    if json:
        logs = [str(p) for p in campaign.logs]
        print_json({"campaign": str(campaign.campaign), "logs": logs, "layer": campaign.layer, "notes": campaign.notes})
        return
    print(f"SYNTHETIC {plan.title}: {len(campaign.logs)} tests of {duration} on layer {campaign.layer}")
    for note in campaign.notes:
        print(note)
    print(
        f"written: {campaign.campaign}, {campaign.folder / 'logs'}; what the crane really was:"
        f" {campaign.folder / 'reference.toml'}"
    )
