"""What `stillhook response` is given in place of the lift file's own: other waves, another direction, another depth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from stillhook.cli.sea.tip_inputs import refuse, sea_of
from stillhook.errors import SeaError
from stillhook.sea.spectra.directions import parse_direction
from stillhook.units import quote

if TYPE_CHECKING:
    from stillhook.formats.lift.file import LiftFile
    from stillhook.response.lift import Waves
    from stillhook.sea.spectra.spectrum import Sea


def waves_of(
    file: LiftFile,
    sea: Path | None,
    wave: str | None,
    heading: str | None,
    spread: float | None,
    ship: str | None,
    record: str | None,
) -> Waves:
    """The waves that were asked for: those of the lift file, in words, or of a file. Errors: SeaError."""
    from stillhook.response.lift import Waves

    if sea is not None:
        refuse({"--wave": wave}, "conflicts with --sea. Leave one of them out.")
        if not sea.is_file():
            raise SeaError(
                f"--sea {quote(str(sea))}: no such file. Give a file of measured waves (NDBC), or waves in words with"
                " --wave."
            )
        if record is not None:
            return Waves(sea_of(str(sea), heading, spread, record, ship))
        return waves_of_file(sea, heading, spread, ship)
    refuse(
        {"--ship": ship, "--record": record},
        "belongs to a file of measured waves. Give --sea as well, or leave it out.",
    )
    if wave is not None:
        if Path(wave).is_file():
            raise SeaError(f"--wave {quote(wave)}: is a file. Give it as --sea.")
        return Waves(sea_of(wave, heading, spread, None, None))
    if file.sea is None:
        raise SeaError("sea: the lift file has none. Write [sea] there, or give --wave or --sea.")
    return Waves(_turned(file, heading, spread))


def waves_of_file(sea: Path, heading: str | None, spread: float | None, ship: str | None) -> Waves:
    """All records of a file, with one direction from the bow or their own from north. Errors: SeaError."""
    from stillhook.formats.waves.open import read_sea
    from stillhook.response.lift import Waves
    from stillhook.sea.spectra.measured import SpectrumSeries
    from stillhook.sea.spectra.spectrum import check_spread

    beta, bow = (
        None if text is None else parse_direction(text, name)
        for text, name in ((heading, "--heading"), (ship, "--ship"))
    )
    waves = read_sea(sea)
    if spread is not None:
        check_spread(spread, "--spread")
    if waves.n_valid == 0:
        raise SeaError(f"{waves.source}: none of its {len(waves)} records is valid. Give another file.")
    if beta is not None:
        refuse({"--ship": ship}, "conflicts with --heading, which is from the bow. Leave one of them out.")
        return Waves.from_si(waves, beta=beta, spread=spread)
    spectral = isinstance(waves, SpectrumSeries)
    if isinstance(waves, SpectrumSeries) and waves.directional is None:
        raise SeaError(f'{waves.source}: has no directions. Give --heading, such as "180 deg" for a head sea.')
    if bow is None:
        raise SeaError(
            f"{waves.source}: has directions. Give --ship, where the bow points from north, or --heading in place of"
            " them."
        )
    if spectral:
        refuse({"--spread": spread}, f"{waves.source} has directions of its own. Leave it out, or give --heading.")
    return Waves.from_si(waves, ship=bow, spread=spread)


def _turned(file: LiftFile, heading: str | None, spread: float | None) -> Sea:
    """The lift file's sea, with another direction or spread where they are given."""
    from stillhook.sea.spectra.spectrum import Sea, Train, check_spread

    assert file.sea is not None
    if heading is None and spread is None:
        return file.sea
    if heading is not None and len({train.beta for train in file.sea.trains}) > 1:
        raise SeaError("--heading: the lift file's waves come from several directions. Give all of them with --wave.")
    if spread is not None:
        check_spread(spread, "--spread")
    beta = None if heading is None else parse_direction(heading, "--heading")
    trains = (
        Train(t.spectrum, t.beta if beta is None else beta, t.spread if spread is None else spread)
        for t in file.sea.trains
    )
    return Sea(tuple(trains))
