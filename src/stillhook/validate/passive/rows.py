"""The table of step 6: parameter, crane file, value from the log, difference, tests."""

from __future__ import annotations

from stillhook.report.document import Table
from stillhook.spec.crane import Crane
from stillhook.statistics.estimate import Estimate
from stillhook.units import KINDS, in_display, number
from stillhook.validate.passive import torque
from stillhook.validate.passive.estimates import PassiveEstimates

HEADER = ("parameter", "crane\nfile", "log\nsays", "95 %", "differ-\nence", "tests")
TITLE = "The passive circuit by the logs, against the crane file"

Row = tuple[str, str, str, str, str, str]


def table(crane: Crane, estimates: PassiveEstimates) -> Table:
    """One row a parameter, the motors' share one a test as well."""
    passive = crane.passive
    assert passive is not None
    rows: list[Row] = []
    if estimates.level is not None:
        rows.append(
            _row("precharge", passive.accumulator.gas.p_0, estimates.level.p, "pressure", list(estimates.level.tests))
        )
    if estimates.gas is not None:
        file = passive.accumulator.gas
        rows.append(
            _row(f"gas volume at n {number(file.n, 3)}", file.V_0, estimates.gas.V, "volume", list(estimates.gas.tests))
        )
    count = passive.motor.count
    for s in estimates.shares:
        rows.append(
            _row(
                "motors that work",
                count,
                Estimate.around(count * (1.0 + s.share.value), count * s.share.half),
                "",
                [s.test],
            )
        )
    if estimates.shares:
        share, structural = torque.overall(estimates.shares)
        both = Estimate.around(count * (1.0 + share.value), count * (share.half**2 + structural**2) ** 0.5)
        rows.append(_row("motors, with load and calibration", count, both, "", [s.test for s in estimates.shares]))
    if estimates.setting is not None:
        gain = Estimate.around(1.0 + estimates.setting.gain.value, estimates.setting.gain.half)
        rows.append(_row("setting over its law", 1.0, gain, "", list(estimates.setting.tests)))
    if estimates.make_up is not None:
        gain = Estimate.around(1.0 + estimates.make_up.gain.value, estimates.make_up.gain.half)
        rows.append(_row("make-up over its law", 1.0, gain, "", []))
    return Table(HEADER, tuple(rows), TITLE)


def _row(name: str, twin: float, e: Estimate, quantity: str, tests: list[str]) -> Row:
    unit = KINDS[quantity].display if quantity else ""
    cells = [number(in_display(v, quantity) if quantity else v, 4) for v in (twin, e.value, e.low, e.high)]
    difference = f"{100.0 * (e.value / twin - 1.0):+.2f} %"
    return (
        f"{name} [{unit}]" if unit else name,
        cells[0],
        cells[1],
        f"{cells[2]} to {cells[3]}",
        difference,
        ", ".join(tests),
    )
