"""The friction tests that the thesis made on real cranes, as tables: which displacement, which load, used for what."""

from __future__ import annotations

from dataclasses import dataclass

from stillhook.units import parse


@dataclass(frozen=True)
class PlannedTest:
    """One hoist/lower staircase: D_m displacement of one motor [m^3/rad]; load on the hook, without the hook [kg];
    hold_out: not used to fit, kept to check the fit; layer of wire to work on, None where the plan's own is meant."""

    name: str
    D_m: float
    load: float
    hold_out: bool = False
    layer: int | None = None


@dataclass(frozen=True)
class TestPlan:
    """The tests of one campaign on a crane of the library. motors: all motors in the circuit during the tests."""

    __test__ = False  # no test of pytest's

    name: str
    title: str
    crane: str
    motors: int
    tests: tuple[PlannedTest, ...]
    source: str


def planned(name: str, D_total: str, motors: int, load: str, *, hold_out: bool = False) -> PlannedTest:
    """A test as the tables print it: displacement of all motors together, load on the hook."""
    return PlannedTest(name, parse(D_total, "displacement") / motors, parse(load, "mass"), hold_out)


def _tests(motors: int, rows: tuple[tuple[str, str, str], ...], *held_out: str) -> tuple[PlannedTest, ...]:
    return tuple(
        planned(name, f"{D} cm^3/rev", motors, f"{load} t", hold_out=name in held_out) for name, D, load in rows
    )


_TABLE_2_3 = (
    ("1", "720", "0"),
    ("2", "960", "0"),
    ("3", "1120", "0"),
    ("4", "1290", "0"),
    ("5", "720", "55"),
    ("6", "960", "55"),
    ("7", "1120", "55"),
    ("8", "1290", "55"),
    ("9", "1120", "100"),
    ("10", "1290", "100"),
)
_D_TABLE_2 = (
    ("1", "2365", "0"),
    ("2", "2365", "77"),
    ("3", "2365", "107"),
    ("4", "1800", "0"),
    ("5", "1800", "77"),
    ("6", "1800", "107"),
    ("7", "2200", "0"),
)
_D_TABLE_5 = (
    ("8", "2200", "107"),
    ("9", "1600", "77"),
    ("10", "1320", "77"),
    ("11", "1600", "107"),
    ("12", "1120", "0"),
)

CAMPAIGNS = {
    plan.name: plan
    for plan in (
        TestPlan(
            name="L4593",
            title="friction tests of L4593, 100 t pure active",
            crane="nov-100t-pure-active",
            motors=6,
            tests=_tests(6, _TABLE_2_3, "1", "2", "3"),
            source="Moslatt 2020 table 2.3; fitted on tests 4 to 10 (section 2.3.3), tests 1 to 3 held out",
        ),
        TestPlan(
            name="crane-2",
            title="friction tests of crane 2, 150 t active/passive",
            crane="nov-150t",
            motors=11,
            tests=_tests(11, _D_TABLE_2),
            source="Moslatt 2020 paper D table 2; all seven tests fitted (section 2.4)",
        ),
        TestPlan(
            name="crane-2-extended",
            title="friction tests of crane 2, 150 t active/passive, with the later tests held out",
            crane="nov-150t",
            motors=11,
            tests=_tests(11, _D_TABLE_2 + _D_TABLE_5, "8", "9", "10", "11", "12"),
            source="Moslatt 2020 paper D tables 2 and 5; tests 1 to 7 fitted, tests 8 to 12 held out (section 4.1)",
        ),
    )
}
"""Published test campaigns by name."""
