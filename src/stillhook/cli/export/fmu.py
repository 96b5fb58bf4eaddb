"""`stillhook fmu` and `stillhook external`: a crane's winch for simulators, OrcaFlex and SIMO, without Python."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from stillhook.cli.parser import CraneArgument, Json, refuse
from stillhook.errors import CommandError
from stillhook.units import quote, show

if TYPE_CHECKING:
    from stillhook.spec.crane import Crane
    from stillhook.spec.scenario import Scenario

WIRE_OUT = 100.0
"""Wire out with which a model begins where no case says it [m], as in `stillhook compare`."""
SSP = "ssp"
"""Contents: plant and controller as two FMUs in one system (SSP)."""
CaseArgument = Annotated[
    Path | None,
    typer.Argument(metavar="CASE", help="Case file: load, wire out, water and mode that the model begins with."),
]


def case_for(crane: Crane, file: Path | None) -> Scenario:
    """The case of a file, or half the SWL on 100 m of wire with the usual controller."""
    from stillhook.spec.scenario import Scenario

    if file is None:
        load, s_w = f"{0.5 * crane.SWL!r} kg", f"{WIRE_OUT!r} m"
        return Scenario(load=load, s_w=s_w, tip="still", mode=crane.plant.type.default_mode)
    from stillhook.formats.case_file import load_case

    found = load_case(file)
    if found.crane.name != crane.name:
        raise CommandError(
            f'{file.name}: a case of "{found.crane.name}", and the crane is "{crane.name}". Give one crane in both.'
        )
    return found.case


def listed(text: str, option: str) -> list[str]:
    """Names of an option, separated by commas. Errors: CommandError for none."""
    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise CommandError(f"{option} {quote(text)}: give at least one name, such as linux64,win64,source.")
    return names


def say_if_first(platforms: Sequence[str]) -> None:
    """Message that the first library for a platform takes longer."""
    from stillhook.export.twin import first_of
    from stillhook.report.terminal import say

    if names := first_of([name for name in platforms if name != "source"]):
        say(f"compiling for {', '.join(names)}: the first time takes a minute or two, then seconds ...")


def fmu(
    name: CraneArgument,
    case_file: CaseArgument = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write (default CRANE.fmu, or CRANE.ssp of a system).")
    ] = None,
    fmi: Annotated[str, typer.Option("--fmi", help="Version of FMI: 2 or 3.")] = "2",
    coupling: Annotated[
        str,
        typer.Option(
            help='"tip": motion of the crane tip in. "wire": also the tension in, wire out and its speed out.'
        ),
    ] = "tip",
    contents: Annotated[
        str, typer.Option(help="plant+controller, plant, controller; or ssp: both as two FMUs in one system.")
    ] = "plant+controller",
    platforms: Annotated[
        str | None,
        typer.Option(help="linux64,win64,macos-arm64,source (default: this machine's; the source is always there)."),
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option(help="Folder for inputs and results of the case, as in the FMI cross-check."),
    ] = None,
    json: Json = False,
) -> None:
    """Write a crane's winch as a Functional Mock-up Unit: C code without Python, with its crane file and validity.

    Without a case it begins with half the SWL on 100 m of wire and the usual controller; load, wire out, mode and gains
    are set in the host.

    Example: stillhook fmu nov-250t --fmi 2 --platforms linux64,win64
    """
    from stillhook.export.fmu import write_fmu, write_reference, write_ssp
    from stillhook.export.fmu.package import check_choice, facts
    from stillhook.export.twin import export, own_platform
    from stillhook.library import load_crane
    from stillhook.report.terminal import print_json

    crane = load_crane(name)
    case = case_for(crane, case_file)
    own = own_platform()
    chosen = listed(platforms, "--platforms") if platforms is not None else [own or "source", "source"]
    check_choice(fmi, chosen)
    say_if_first(chosen)
    if contents == SSP:
        refuse({"--reference": reference}, "a system of two FMUs has no reference results. Leave it out.")
        made = export(crane, case, "plant", coupling)
        target = out or Path(f"{crane.name}.ssp")
        files: tuple[Path, ...] = (
            write_ssp(made, export(crane, case, "controller"), target, fmi=fmi, platforms=chosen),
        )
    else:
        made = export(crane, case, contents, coupling)
        target = out or Path(f"{crane.name}.fmu")
        files = write_fmu(made, target, fmi=fmi, platforms=chosen)
        if reference is not None:
            files += write_reference(made, reference)
    if json:
        print_json({**facts(made), "fmi": fmi, "platforms": chosen, "files": [str(f) for f in files]})
        return
    print(
        f"{crane.name}, {made.contents}, coupled at the {made.coupling}: {len(made.ports)} variables, PLC cycle "
        f"{show(made.t_cycle, 'time')}; begins with {show(case.load, 'mass')} on {show(case.s_w, 'length')} of wire, "
        f"mode {case.mode.value}"
    )
    print("steps are whole PLC cycles; inputs are those of the start of a step (input_time 1), or of its end (0)")
    print("written: " + ", ".join(str(f) for f in files))


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
