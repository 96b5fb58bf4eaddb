"""A measured staircase of another machine: import, steady stretches, pairs, friction with uncertainty.

The machine is the electro-hydraulic ram of a wave-energy buoy, not a winch; see docs/validation/bench-staircase.md. What is known of it
from elsewhere: the set speeds are whole inches per second in rising steps of 2 in/s, 4 in/s is run twice, and the makers' simulator
holds the areas of piston and gas springs and a table of the ram's friction.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from stillhook.errors import IdentifyError
from stillhook.identify.curve import FrictionCurve, friction_curve
from stillhook.identify.steady_state.steps import WindowSettings
from stillhook.identify.steady_state.windows import steady_windows
from stillhook.logs.log import Log, mapping_from, read_log

INCH, POUND, PSI = 0.0254, 4.4482216152605, 6.894757293168
PISTON, GAS_LOWER, GAS_UPPER = 1.375 * INCH**2, 0.0115, 0.0127  # m^2
TABLE = ((0.05, 575.0), (0.1, 850.0), (0.4, 2050.0))  # m/s, N: mean of both directions in PTOFriction.cpp
SHORT = WindowSettings(least_length="1 s")
# Set speeds are held within one per cent while a stretch is called steady.
HELD = 0.02
# One per cent of the piston's area makes five per cent of the friction; the makers' table has two digits and steps of 0.3 m/s.
AGAINST_TABLE = 0.25


def row(column: str, unit: str, scale: float, quantity: str) -> dict[str, object]:
    return {"column": column, "unit": unit, "scale": scale, "quantity": quantity}


MAPPING = mapping_from(
    {
        "time": {"column": "time(s)", "unit": "s"},
        "position": row("Pos(in)", "m", INCH, "length"),
        "speed": row("Spd(in/s)", "m/s", INCH, "speed"),
        "effort": row("TestMachineForce(lbs)", "N", POUND, "force"),
        "p_a": row("LowerHydPress(psig)", "kPa", PSI, "pressure"),
        "p_b": row("UpperHydPress(psig)", "kPa", PSI, "pressure"),
        "gas_lower": row("LowerSpringPressure(psia)", "kPa", PSI, "pressure"),
        "gas_upper": row("UpperSpringPressure(psia)", "kPa", PSI, "pressure"),
    },
    "bench",
)


@pytest.fixture(scope="module")
def log(shared_data: Path) -> Log:
    file = shared_data / "bench_mbari" / "FrictionIDMovesWithBiasCurr.exp"
    if not file.is_file():
        pytest.skip(f"no {file.name} among the measured data")
    return read_log(file, MAPPING)


@pytest.fixture(scope="module")
def whole(log: Log) -> FrictionCurve:
    return friction_curve(log, position="position", settings=SHORT)


@pytest.fixture(scope="module")
def ram(log: Log) -> FrictionCurve:
    """The machine's force less the oil's and the gas's."""
    s = log.signals
    effort = s["effort"] - PISTON * (s["p_a"] - s["p_b"]) - GAS_LOWER * s["gas_lower"] + GAS_UPPER * s["gas_upper"]
    return friction_curve(log, effort=effort, position="position", settings=SHORT)


def test_the_log_is_read_in_si_on_bins_of_a_tenth_of_a_second(log: Log) -> None:
    assert log.samples == 20001
    assert log.rate == pytest.approx(50.0)
    assert len(log.t) == 4001
    assert log.signals["position"].max() == pytest.approx(75.25 * INCH, abs=0.005)
    assert not log.gaps


def test_every_set_speed_that_was_held_is_found_in_both_directions(whole: FrictionCurve) -> None:
    """2, 4, 4, 6, 8, 10, 12, 14 in/s out and in; above, strokes of 1.8 m are too short to settle going in."""
    for sign in (1, -1):
        ours = [p.up.speed if sign > 0 else -p.down.speed for p in whole.points]
        assert ours == pytest.approx(np.array([2.0, 4.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0]) * INCH, rel=2.0 * HELD)
    for p in whole.points:
        assert abs(p.up.speed + p.down.speed) < HELD * p.speed
        assert p.up.middle < p.down.middle


def test_each_pair_is_out_and_in_of_one_repetition(whole: FrictionCurve) -> None:
    first, second = (p for p in whole.points if abs(p.speed - 4.0 * INCH) < 0.1 * INCH)
    assert {(p.up.start < 90.0, p.down.start < 90.0) for p in (first, second)} == {(True, True), (False, False)}


def test_strokes_that_never_settle_are_rejected_with_a_reason(whole: FrictionCurve) -> None:
    fast_in = [r for r in whole.steady.rejected if r.direction < 0]
    assert len(fast_in) == 5
    assert all("at no time at steady speed" in r.reason for r in fast_in)
    assert all(r.start > 320.0 for r in fast_in)
    assert all("has a closer partner" in r.reason for r in whole.unpaired if r.speed > 0.1)


def test_without_the_position_the_springs_are_seen_as_a_drift_and_nothing_is_averaged(log: Log) -> None:
    """The force rises by kN along every stroke: as a steady load it would be wrong, and is refused."""
    found = steady_windows(log, "speed", "effort", settings=SHORT)
    moving = [w for w in found.windows if abs(w.speed) > INCH]
    assert not moving
    assert sum("effort still drifted" in r.reason for r in found.rejected) >= 14
    with pytest.raises(IdentifyError, match="no speed at which both directions can be compared"):
        friction_curve(log, settings=SHORT)


def test_friction_is_positive_and_grows_with_speed(whole: FrictionCurve, ram: FrictionCurve) -> None:
    for found in (whole, ram):
        F = np.array([p.friction for p in found.points])
        v = np.array([p.speed for p in found.points])
        assert all(p.estimate.low > 0.0 for p in found.points)
        steps = np.diff(v) > 0.5 * INCH
        assert np.all(np.diff(F)[steps] > 0.0)


def test_the_speed_that_was_run_twice_gives_the_same_friction_within_its_uncertainty(
    whole: FrictionCurve, ram: FrictionCurve
) -> None:
    for found in (whole, ram):
        first, second = (p for p in found.points if abs(p.speed - 4.0 * INCH) < 0.1 * INCH)
        assert abs(first.friction - second.friction) < 1.96 * np.hypot(first.u_friction, second.u_friction)
        assert abs(first.friction - second.friction) < 0.05 * first.friction


def test_the_load_left_over_does_not_depend_on_the_place_once_oil_and_gas_are_taken_off(
    whole: FrictionCurve, ram: FrictionCurve
) -> None:
    """The springs change the force by up to 7.6 kN on the way; what is left changes by less than a fortieth of it at full stroke."""
    for before, after in zip(whole.points, ram.points, strict=True):
        assert before.load_way is not None
        assert after.load_way is not None
        assert before.load_way[1] - before.load_way[0] > 1500.0
        assert abs(after.load_way[1] - after.load_way[0]) < 200.0


def test_friction_of_the_ram_agrees_with_the_makers_table_as_well_as_the_areas_are_known(ram: FrictionCurve) -> None:
    for p in ram.points:
        assert p.friction == pytest.approx(np.interp(p.speed, *zip(*TABLE, strict=True)), rel=AGAINST_TABLE)


def test_a_share_of_the_machines_force_is_friction_and_the_rest_is_the_generator(
    whole: FrictionCurve, ram: FrictionCurve
) -> None:
    for a, b in zip(whole.points, ram.points, strict=True):
        assert b.friction < 0.3 * a.friction
