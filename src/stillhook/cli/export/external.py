"""`stillhook external`: a crane's winch in OrcaFlex and SIMO."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stillhook.cli.export.fmu import CaseArgument, case_for, listed, say_if_first
from stillhook.cli.parser import CraneArgument, Json
from stillhook.units import show


def external(
    host: Annotated[str, typer.Argument(metavar="HOST", help="orcaflex or simo.")],
    name: CraneArgument,
    case_file: CaseArgument = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write (default CRANE-HOST).")] = None,
    platform: Annotated[
        str, typer.Option("--platforms", help="Libraries: win64, linux64, macos-arm64, or source for none.")
    ] = "win64",
    json: Json = False,
) -> None:
    """Write a crane's winch for OrcaFlex (external function) or SIMO (external DLL force), in a folder.

    Without a case it begins with half the SWL on 100 m of wire and the usual controller.

    Example: stillhook external orcaflex nov-250t --out winch
    """
    from stillhook.export.hosts import write_host
    from stillhook.library import load_crane
    from stillhook.report.terminal import print_json

    crane = load_crane(name)
    case = case_for(crane, case_file)
    chosen = [each for each in listed(platform, "--platforms") if each != "source"]
    say_if_first(chosen)
    files = write_host(host, crane, case, out or Path(f"{crane.name}-{host}"), platforms=chosen)
    if json:
        print_json({"crane": crane.name, "host": host, "platforms": chosen, "files": [str(f) for f in files]})
        return
    print(
        f"{crane.name} for {host}: begins with {show(case.s_w, 'length')} of wire, mode {case.mode.value}; PLC cycle "
        f"{show(crane.control.t_cycle, 'time')}"
    )
    print("written: " + ", ".join(str(f) for f in files))
