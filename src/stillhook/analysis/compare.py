"""The same motion under several controllers, side by side."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook.base.progress import Progress
from stillhook.control.registry import USUAL
from stillhook.engine.arguments import checked_cases, cycles, paired, steps_per_cycle
from stillhook.engine.scenario.checks import check
from stillhook.engine.scenario.problem import OK, Result, run_cases, summarise, to_dataset
from stillhook.errors import ScenarioError
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Mode, Scenario, mode_of
from stillhook.units import quote

if TYPE_CHECKING:
    import xarray


class ModeRun(NamedTuple):
    """One controller's run: its scenario, raw result and summary (keys and SI units of
    `stillhook.variables.SUMMARY`)."""

    mode: Mode
    case: Scenario
    result: Result
    summary: dict[str, Any]

    @property
    def ok(self) -> bool:
        """Whether the run stayed inside every limit."""
        return bool(self.summary["status"] == OK)

    def dataset(self, crane: Crane) -> xarray.Dataset:
        """The run as a Dataset."""
        return to_dataset(crane, [self.case], [self.result], [self.summary], single=True)


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
        return dataset_of(self.crane, self.runs, [r.mode.value for r in self.runs])


def compare(
    crane: Crane,
    case: Scenario,
    modes: Sequence[Mode | str] = USUAL,
    *,
    step: str | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Run one scenario under several controllers (default NS, HS and SSC) with time series every 0.1 s.

    step: integration step, default as in `simulate`.

    Errors: ScenarioError, one line, for an unknown mode, an empty list, or a scenario that is not possible with this
    crane.

    >>> import stillhook
    >>> crane = stillhook.load_crane("nov-250t")
    >>> case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 12 s", duration="40 s", warm_up="20 s")
    >>> list(stillhook.compare(crane, case, ["ns", "ssc"]).table())
    ['ns', 'ssc']
    """
    chosen = _chosen(modes)
    checked_cases(crane, case)
    if not isinstance(case, Scenario):
        raise ScenarioError("compare: a list of cases. Give one Scenario, or use simulate.")
    if case.modes:
        raise ScenarioError("modes: a scenario that changes its mode cannot be compared between modes. Use simulate.")
    check(crane, case)
    return Comparison(crane, run_labelled(crane, [case.with_mode(m) for m in chosen], step=step, progress=progress))


def _chosen(modes: Sequence[Mode | str]) -> list[Mode]:
    """The modes to compare, each once."""
    if isinstance(modes, str) or not isinstance(modes, Iterable):
        raise ScenarioError(f'modes = {quote(modes)}: give a list, such as ["ns", "hs", "ssc"].')
    chosen = [mode_of(m) for m in modes]
    if not chosen:
        raise ScenarioError("modes: empty. Give at least one, such as ns,hs,ssc.")
    if twice := next((m for m in chosen if chosen.count(m) > 1), None):
        raise ScenarioError(f'modes: "{twice}" is named twice. Name each mode once.')
    return chosen


def dataset_of(crane: Crane | Sequence[Crane], runs: Sequence[ModeRun], labels: Sequence[str]) -> xarray.Dataset:
    """Several runs in one Dataset, the labels along "case"; crane that of all, or one for each."""
    cases = [r.case.model_copy(update={"name": label}) for r, label in zip(runs, labels, strict=True)]
    return to_dataset(crane, cases, [r.result for r in runs], [r.summary for r in runs], single=False)


def run_labelled(
    crane: Crane | Sequence[Crane],
    cases: Sequence[Scenario],
    *,
    step: str | None = None,
    every: str | None = None,
    progress: Progress | None = None,
) -> tuple[ModeRun, ...]:
    """Runs with time series (default every 0.1 s), each with its summary and the notes made before it; see
    `simulate`."""
    cranes: list[Crane] = paired(crane, cases)[0]
    n_sub, rows = steps_per_cycle(cranes[0], step), cycles(cranes[0], every)
    results = run_cases(cranes, cases, n_sub=n_sub, lanes=1, every=rows, progress=progress)
    return tuple(ModeRun(c.mode, c, r, summarise(w, c, r)) for w, c, r in zip(cranes, cases, results, strict=True))
