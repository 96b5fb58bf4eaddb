"""What a plan found: limiting sea states of every alternative and what governs them, as labelled arrays with plain
facts and blocks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from stillhook.plan.definition.compensation import Alternative

if TYPE_CHECKING:
    import xarray

Credit = Literal["twin", "credited"]
CREDITS: tuple[Credit, ...] = ("twin", "credited")
"""The limit as the model of each alternative says it, and what is credited: no more than the cap where no certificate
covers the cell."""
BLOCKS = ("depth", "efficiency", "landing", "sensitivity", "convergence", "weather", "demand")
"""Datasets that a result may have beside its limits, in the order of the file."""


@dataclass(frozen=True, eq=False)
class PlanResult:
    """Limits, facts and blocks of one plan; saved and loaded by `stillhook.plan.answer.files`, told by
    `stillhook.plan.report.save`.

    data: coordinates credit ("twin", "credited"), alternative, heading [rad], period [s], phase, rule, tier; attrs
    name, Hs_lowest, Hs_highest [m] (least and most of the seas analysed), heading_tolerance [rad].
        Hs_limit, Hs_limit_low, Hs_limit_high (credit, alternative, heading, period) [m]: limiting significant wave
        height with its 95 % interval (NaN where there is none): inf above the highest sea state analysed, 0 where a
        calm is beyond, NaN where there is no result; alpha, op_wf (same dims) [1], [m]: forecast factor of that limit
        and the height that a forecast may show, NaN where there is no result; governing_phase, governing_rule,
        governing_tier (same dims): texts, "" where nothing governs; Hs_rule (credit, tier, alternative, phase, rule,
        heading, period) [m]: everything that was found, NaN where not; counts (alternative, phase, heading, period):
        tier whose limits count, "" where none tells; n_seeds (alternative, phase, heading, period): runs behind it;
        inside (alternative, phase, heading, period): share of the analysed seas that the crane's certificate covers,
        NaN where nothing takes one: phases without compensation, and alternatives that are no twin.
    facts: plain data for JSON: what was asked (name, crane, vessel, payload, place, phases, rules, limited,
    alternatives, operation, inputs, settings) and how it was answered (version, code, date, shown, runs, notes,
    not_covered, remarks). blocks: name of `BLOCKS` -> Dataset, each only where it was made:
        depth (alternative, z): F_top_max, F_top_static, DAF, sling_ratio, slack_chance, T_0; attrs Hs, Tp, beta,
        z_resonance; efficiency (alternative, period): eta_wire, eta_load; landing (alternative, run): v_landed;
        sensitivity (factor, alternative); convergence (cell, n): utilisation, low, high; weather (credit, alternative,
        month; 0 the whole year); demand (tier, alternative, phase, heading, period, height): quantities of the rules.
    """

    data: xarray.Dataset = field(repr=False)
    facts: Mapping[str, Any] = field(repr=False)
    blocks: Mapping[str, xarray.Dataset] = field(default_factory=dict, repr=False)

    @property
    def name(self) -> str:
        """Name of the plan."""
        return str(self.facts["name"])

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Alternatives that stand side by side."""
        return tuple(Alternative(str(name)) for name in self.data["alternative"].values)

    @property
    def workable(self) -> bool:
        """Whether any sea of the table is within the credited limit of any alternative, and the weather, where it was
        asked, ever gives a window that is long enough."""
        limits = self.data["Hs_limit"].sel(credit="credited").values
        windows = (
            self.blocks["weather"]["n_windows_long_enough"].sel(credit="credited", month=0)
            if "weather" in self
            else None
        )
        return bool((limits >= float(self.data.attrs["Hs_lowest"])).any() and (windows is None or (windows > 0).any()))

    def __getitem__(self, block: str) -> xarray.Dataset:
        """A block by its name. Errors: KeyError where it was not made."""
        return self.blocks[block]

    def __contains__(self, block: str) -> bool:
        return block in self.blocks
