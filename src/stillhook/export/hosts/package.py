"""Folders for other programs: library, source, settings and what to do with them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stillhook import units
from stillhook.base.atomic import check_folder
from stillhook.engine.certificate import envelope_line, twin_line
from stillhook.engine.pack.winch import pack
from stillhook.export.twin import PLATFORMS, Export, ExportError, check_platform, compile_library, export
from stillhook.library import crane_toml
from stillhook.sea.vessel.vessel_tip import VesselTip
from stillhook.spec.crane import Crane, identity
from stillhook.spec.scenario import Scenario
from stillhook.trust.results import result_folder

HOSTS = ("orcaflex", "simo")
HERE = Path(__file__).parent
PARTS = {"orcaflex": ("exchange.c", "plain.c", "orcaflex.c"), "simo": ("exchange.c", "plain.c", "simo.c")}
LIBRARY = "stillhook_winch"
MODULE = '''"""External function for a winch's pay-out rate in OrcaFlex. Needs Stillhook in OrcaFlex's Python."""

from pathlib import Path

from stillhook.export.hosts.orcaflex import Winch


class StillhookWinch(Winch):
    crane = Path(__file__).with_name("crane.toml")  # {crane!a}
    case = {case!r}
    tip = {tip!r}
'''


def host_source(made: Export, host: str) -> str:
    """The whole C source of a library for a host. Errors: ExportError for an unknown host."""
    if host not in HOSTS:
        raise ExportError(f"host = {units.quote(host)}: choose {' or '.join(HOSTS)}.")
    if made.coupling != "wire":
        raise ExportError(f'coupling = {made.coupling}: a host with a wire of its own needs "wire".')
    parts = map(_text, PARTS[host])
    names = ", ".join(f'"{name}"' for name in made.modes.values())
    return "\n".join([made.source, f"#define SH_MODE_NAMES {names}", *_wire(made), *parts])


def _text(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")


def _wire(made: Export) -> list[str]:
    """The wire of the crane, for a host that leaves it to the library [SI], and whether a gas charge is set for the
    load."""
    hoist = pack(made.crane, made.case).params.hoist
    numbers = {
        "EA": hoist.wire.EA,
        "L_0": hoist.wire.L_0,
        "MU": hoist.wire.mu,
        "ZETA": hoist.wire.zeta,
        "MASS": hoist.load.m,
        "WEIGHT": hoist.load.W,
    }
    free = any(port.name == "load" for port in export(made.crane, made.case).ports)
    return [
        f"#define SH_LOAD_FIXED {int(not free)}",
        *(f"#define SH_WIRE_{name} {float(x)!r}" for name, x in numbers.items()),
    ]


def write_host(
    host: str, crane: Crane, case: Scenario, folder: str | Path, *, platforms: Sequence[str] = ("win64",)
) -> tuple[Path, ...]:
    """Write what a host needs to have a crane's winch, all files or none. Gives their paths.

    Parameters: host: "orcaflex" or "simo"; case: load, wire out, mode and friction model with which it begins (motion,
    water, operator and later changes of the mode are the host's, and left out); folder; platforms: of the libraries,
    names of `stillhook.export.twin.PLATFORMS`; none for the source alone.

    Errors: ExportError, one line, for an unknown host or platform, and a compiler that is absent or fails;
    ScenarioError as in `stillhook.simulate`; SimulationError where the folder cannot be written. Nothing is left
    half-written.
    """
    if host not in HOSTS:
        raise ExportError(f"host = {units.quote(host)}: choose {' or '.join(HOSTS)}.")
    for platform in platforms:
        check_platform(platform)
    boom = _boom(case)
    still = Scenario(**_case(case), **({"tip": boom} if boom else {}))
    made = export(crane, still, coupling="wire")
    source = host_source(made, host)
    texts = {"README.txt": _readme(made, host, platforms), f"{LIBRARY}.c": source, "crane.toml": crane_toml(crane)}
    if host == "orcaflex":
        modes = ", ".join(made.modes.values())
        texts["stillhook_winch.py"] = MODULE.format(
            crane=crane.name, case=_case(case), tip=boom.to_dict() if boom else {}
        )
        texts["parameters.txt"] = _text("parameters.txt").format(s_w=case.s_w, mode=case.mode.value, modes=modes)
        texts["winch.yml"] = _text("winch.yml").format(file=_library("win64"), s_w=case.s_w)
    names = [*texts, *(_library(platform) for platform in platforms)]
    target = Path(folder)
    check_folder(target, tuple(names))
    with result_folder(target, f"external function for {host}", [identity(crane)]) as part:
        for name, text in texts.items():
            (part / name).write_text(text, encoding="utf-8")
        for platform in platforms:
            compile_library(source, platform, part / _library(platform))
    return tuple(target / name for name in names)


def _library(platform: str) -> str:
    return f"{LIBRARY}{PLATFORMS[platform].suffix}"


def _boom(case: Scenario) -> VesselTip | None:
    """The boom and its motion unit, on a ship at rest: its motion is the host's. Errors: ExportError for what would
    be left out."""
    tip = case.tip
    if not isinstance(tip, VesselTip):
        return None
    if not tip.unit.passes or tip.slew or tip.luff or tip.fold:
        raise ExportError(
            "tip: filter, delay and noise of the motion unit and movements of the boom are not exported to a host with"
            " a wire. Leave them out of the case."
        )
    return VesselTip(tip.boom, unit=tip.unit)


def _case(case: Scenario) -> dict[str, Any]:
    """The case as its texts: what a host does not have itself."""
    return {
        "load": f"{case.load!r} kg",
        "s_w": f"{case.s_w!r} m",
        "mode": case.mode.value,
        "friction": case.friction.value,
        "gas_held": case.gas_held,
    }


def _readme(made: Export, host: str, platforms: Sequence[str]) -> str:
    page = {"orcaflex": "use-in-orcaflex", "simo": "use-in-sima"}[host]
    built = ", ".join(_library(p) for p in platforms) or f"none built; {LIBRARY}.c compiles by any C99 compiler"
    lines = [
        f"Winch of {made.crane.name} for {host}, as docs/how-to/{page} says. Not tried in the program itself.",
        f"{twin_line(made.crane)}. {envelope_line(made.crane) or 'No envelope of validity.'}",
        f"Libraries: {built}. Identity {made.identity}.",
        f"PLC cycle {made.t_cycle:g} s; begins with {made.case.s_w:g} m of wire, mode {made.case.mode.value}.",
        "Signs: tip up positive; pay-out rate positive where wire goes out.",
    ]
    return "\n".join(lines) + "\n"
