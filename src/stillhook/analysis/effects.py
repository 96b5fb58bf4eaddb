"""Numbers of a crane changed by their dotted paths, and whether a winch moves by them at all."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping

from stillhook.base.kept.identity import remembered
from stillhook.engine.pack.settings import with_value
from stillhook.engine.pack.winch import drum_record
from stillhook.engine.simulate import run_cases
from stillhook.errors import StillhookError
from stillhook.physics.load_path.drum import wire_usable
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

SHARED = ("friction", "inertia")
"""Tables of every crane file, also where the winch type turns no shaft with that friction or inertia."""
PROBE, LOAD = 1.5, 0.2
"""Factor on a number whose effect is looked for, and payload of the run over the SWL [-]."""


def scaled(crane: Crane, factors: Mapping[str, float]) -> Crane:
    """The crane with some numbers, by their dotted paths, times a factor; a number that it leaves out counts as 1."""
    for path, factor in factors.items():
        value = operator.attrgetter(path)(crane)
        crane = with_value(crane, path, factor * (1.0 if value is None else value))
    return crane


def idle(crane: Crane, paths: Iterable[str]) -> bool:
    """Whether numbers of a crane do nothing: the file has them as every file has, and the winch type does not read
    them."""
    names = tuple(paths)
    return all(path.partition(".")[0] in SHARED for path in names) and not _moves(crane, names)


@remembered
def _moves(crane: Crane, paths: tuple[str, ...]) -> bool:
    """Whether a short run differs, in any bit of any result, with the numbers changed. One that cannot be run counts as
    different."""
    wire = 0.5 * wire_usable(drum_record(crane))
    case = Scenario(
        load=f"{LOAD * crane.SWL!r} kg",
        s_w=f"{wire!r} m",
        tip="sine 0.5 m 10 s",
        mode=crane.plant.type.default_mode,
        duration="10 s",
        warm_up="0 s",
    )
    try:
        before, after = run_cases([crane, scaled(crane, dict.fromkeys(paths, PROBE))], [case, case])
    except StillhookError:
        return True
    return any(repr(before[name]) != repr(after[name]) for name in before if name != "notes")
