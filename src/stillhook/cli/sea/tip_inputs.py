"""What `stillhook tip` is given: a place or a crane, waves in words or measured, and what does not go together."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stillhook.errors import SeaError
from stillhook.sea.spectra.directions import parse_direction
from stillhook.units import parse, quote

if TYPE_CHECKING:
    from stillhook.sea.spectra.spectrum import Sea
    from stillhook.sea.vessel.tip import TipPoint


def refuse(options: Mapping[str, Any], reason: str) -> None:
    """Refuse options that were given and have no meaning here. Errors: SeaError."""
    for name, value in options.items():
        if value is not None and value is not False:
            raise SeaError(f"{name}: {reason}")


def sea_of(wave: str, heading: str | None, spread: float | None, record: str | None, ship: str | None) -> Sea:
    """The sea that a text describes, or a record of a file of measured waves."""
    if Path(wave).is_file():
        return _measured(wave, None if heading is None else parse_direction(heading, "--heading"), spread, record, ship)
    from stillhook.sea.spectra.text import parse_sea

    if "=" not in wave and re.search(r"[./\\]", wave):
        raise SeaError(
            f'--wave {quote(wave)}: no such file, and not waves such as "jonswap Hs=2 m Tp=8 s". Check the path.'
        )
    refuse(
        {"--record": record, "--ship": ship},
        f"belongs to a file of measured waves, and --wave {quote(wave)} is none. Leave it out.",
    )
    if heading is not None:
        parse_direction(heading, "--heading")  # so that the line names the option
    sea = parse_sea(wave, heading=heading, spread=spread, where="--wave")
    for name, value in (("heading", heading), ("spread", spread)):
        if wave.lower().count(name) == len(sea.trains):
            refuse({f"--{name}": value}, f"all waves of --wave {quote(wave)} have a {name} of their own. Leave it out.")
    return sea


def _measured(wave: str, beta: float | None, spread: float | None, record: str | None, ship: str | None) -> Sea:
    from stillhook.formats.waves.open import read_sea
    from stillhook.sea.spectra.measured import SpectrumSeries
    from stillhook.sea.spectra.spectrum import Sea, Train

    series = read_sea(wave)
    if not isinstance(series, SpectrumSeries):
        raise SeaError(
            f'{series.source}: holds heights and periods, no spectra. Give them as --wave "jonswap Hs=2 m Tp=8 s".'
        )
    if record is None:
        raise SeaError(
            f"{series.source}: holds {len(series)} records. Choose one with --record, by number from 0 or by time."
        )
    i = series.index(record)
    if beta is None and series.directional is not None:
        if ship is None:
            raise SeaError(
                f"{series.source}: has directions. Give --ship, where the bow points from north, or --heading in place"
                " of them."
            )
        refuse({"--spread": spread}, f"{series.source} has directions of its own. Leave it out, or give --heading.")
        return series.sea(i, parse_direction(ship, "--ship"))
    refuse({"--ship": ship}, f"{series.source}: no directions are taken from it. Give --heading alone.")
    if beta is None:
        raise SeaError(f'{series.source}: has no directions. Give --heading, such as "180 deg" for a head sea.')
    return Sea((Train(series.spectrum(i), beta, spread),))


def place(at: str | None, pedestal: str | None, slew: str | None, main: str | None, knuckle: str | None) -> TipPoint:
    """The crane tip, given as such or by the crane's geometry."""
    from stillhook.sea.vessel.boom import Boom
    from stillhook.sea.vessel.tip import TipPoint, parse_point

    parts = {"--pedestal": pedestal, "--slew": slew, "--main": main, "--knuckle": knuckle}
    if at is not None:
        refuse(parts, "the tip is given by --at already. Give --at, or --pedestal, --slew and --main.")
        return parse_point(at, "--at")
    if not any(parts.values()):
        raise SeaError(
            '--at: missing. Give a tip, --at "x=-20 m, y=-18 m", or a crane with --pedestal, --slew and --main.'
        )
    if pedestal is None or slew is None or main is None:
        raise SeaError(
            f"{next(name for name in parts if parts[name] is None)}: missing. A crane is --pedestal, --slew and --main."
        )
    heel = parse_point(pedestal, "--pedestal")
    if heel.z is None:
        raise SeaError("--pedestal: z is missing. Give the height of the boom's heel above still water as well.")
    boom = Boom(
        pedestal=(f"{heel.x!r} m", f"{heel.y!r} m", f"{heel.z!r} m"),
        slew=f"{parse(slew, 'angle', '--slew')!r} rad",
        main=_length_and_angle(main, "--main"),
        knuckle=None if knuckle is None else _length_and_angle(knuckle, "--knuckle"),
    )
    return TipPoint(*boom.tip)


def _length_and_angle(text: str, where: str) -> tuple[str, str]:
    match = re.fullmatch(r"\s*(\S+ [^\s,]+)\s*[,\s]\s*(\S+ \S+)\s*", text)
    if match is None:
        raise SeaError(f'{where} {quote(text)}: is not a length and an angle. Write "25 m 50 deg".')
    return match[1], match[2]
