"""The same motion under several controllers, side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook.crane import Crane
from stillhook.engine.run import Result
from stillhook.engine.simulate import SERIES_STEP, foreseen_notes, run_cases, steps_per_cycle, to_dataset
from stillhook.engine.summary import OK, summarise
from stillhook.errors import ScenarioError
from stillhook.scenario import Mode, Scenario

if TYPE_CHECKING:
    import xarray

CLASSIC_AND_NEW = (Mode.NS, Mode.HS, Mode.SSC)


class ModeRun(NamedTuple):
    """One controller's run: its scenario, raw result and summary (keys and SI units of `stillhook.variables.SUMMARY`)."""

    mode: Mode
    case: Scenario
    result: Result
    summary: dict[str, Any]

    @property
    def ok(self) -> bool:
        """Whether the run stayed inside every limit."""
        return bool(self.summary["status"] == OK)


class Comparison(NamedTuple):
    """Runs of one motion under several controllers."""

    crane: Crane
    runs: tuple[ModeRun, ...]

    @property
    def ok(self) -> bool:
        """Whether at least one controller stayed inside every limit."""
        return any(r.ok for r in self.runs)

    def table(self) -> dict[str, dict[str, Any]]:
        """Mode -> summary in SI."""
        return {r.mode.value: r.summary for r in self.runs}

    def dataset(self) -> xarray.Dataset:
        """All runs in one Dataset, case = mode."""
        cases = [r.case.model_copy(update={"name": r.mode.value}) for r in self.runs]
        return to_dataset(self.crane, cases, [r.result for r in self.runs], single=False)


def compare(
    crane: Crane,
    case: Scenario,
    modes: Sequence[Mode | str] = CLASSIC_AND_NEW,
    *,
    step: str = SERIES_STEP,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Run one scenario under several controllers (default NS, HS and SSC) with time series every 0.1 s.

    Errors: ScenarioError, one line, for an unknown mode, an empty list, or a scenario that this crane cannot be asked.
    """
    chosen = [mode_of(m) for m in modes]
    if not chosen:
        raise ScenarioError("modes: empty. Give at least one, such as ns,hs,ssc.")
    if case.modes:
        raise ScenarioError("modes: a scenario that changes its mode cannot be compared between modes. Use simulate.")
    n_sub = steps_per_cycle(crane, step)
    every = max(1, round(0.1 / crane.control.t_cycle))
    runs = tuple(_runs(crane, case, chosen, n_sub, every, progress))
    return Comparison(crane, runs)


def _runs(
    crane: Crane, case: Scenario, modes: list[Mode], n_sub: int, every: int, progress: Callable[[float], None] | None
) -> Iterator[ModeRun]:
    for i, mode in enumerate(modes):
        this = case.with_mode(mode)

        def part(x: float, i: int = i) -> None:
            if progress is not None:
                progress((i + x) / len(modes))

        result = run_cases(crane, [this], n_sub=n_sub, every=every, progress=part)[0]
        yield ModeRun(mode, this, result, summarise(result, foreseen_notes(crane, this)))


def mode_of(text: Mode | str) -> Mode:
    """The mode of this name. Errors: ScenarioError naming the modes there are."""
    try:
        return Mode(text)
    except ValueError:
        raise ScenarioError(f'mode "{text}" is not one of {", ".join(m.value for m in Mode)}.') from None
