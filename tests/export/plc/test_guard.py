"""The exported controller on bad inputs: text, compiled form, and PLCs that compare NaN in ways of their own."""

from __future__ import annotations

import math
import operator
import os
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest
from tests.export.plc.cases import (
    BAD,
    BEFORE,
    CLOSED,
    NAN,
    SIGNALS,
    GuardedPlc,
    bits,
    block_of,
    cycles_of,
    faulty,
    machine_of,
    pairs,
    steady,
    unguarded,
)
from tests.export.plc.cases import N_SIGNALS as N
from tests.scripts import DOCS

from stillhook.control.guard import LAW_FAULT, MEMORY_FAULT, STOPPED, SUBSTITUTED
from stillhook.control.interface import Sensed
from stillhook.engine.pack.guard import time_to_stop
from stillhook.export.plc.block import flat
from stillhook.export.plc.program import Block
from stillhook.export.plc.sequence import Reference, parts
from stillhook.kernels.plc_alone import GUARDED, OUTSIDE, GuardedCommands

AT = {name: i for i, name in enumerate(GuardedCommands._fields)}
RANDOM = 1_000_000
RANDOM_TEXT = 1_000

COMPARE = {
    "=": operator.eq, "<>": operator.ne, "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge
}  # fmt: skip


def total_order(place: float) -> Callable[[str, float, float], bool]:
    """NaN equals itself and lies beyond all numbers on this side."""

    def key(x: float) -> tuple[float, float]:
        return (place, 0.0) if math.isnan(x) else (0.0, x)

    return lambda sign, a, b: COMPARE[sign](key(a), key(b))


def answering(answers: dict[str, bool]) -> Callable[[str, float, float], bool]:
    """Comparisons with NaN have these answers."""
    return lambda sign, a, b: answers[sign] if math.isnan(a) or math.isnan(b) else COMPARE[sign](a, b)


SIGNS = tuple(COMPARE)
DIALECTS: dict[str, Callable[[str, float, float], bool]] = {
    "IEEE 754": answering({s: s == "<>" for s in SIGNS}),
    "all true": answering(dict.fromkeys(SIGNS, True)),
    "all false": answering(dict.fromkeys(SIGNS, False)),
    "the largest": total_order(1.0),
    "the least": total_order(-1.0),
    "flags of the x87: less, equal": answering({s: s in ("<", "<=", "=") for s in SIGNS}),
    "greater, equal": answering({s: s in (">", ">=", "=") for s in SIGNS}),
    "equal to all": answering({s: s in ("<=", ">=", "=") for s in SIGNS}),
}


def safe(block: Block, out: np.ndarray) -> None:
    """Numbers, within their limits."""
    assert np.isfinite(out).all()
    assert (np.abs(out[:, AT["u_p"]]) <= 1.0).all()
    assert ((out[:, AT["u_m"]] >= block.plc.motors.alpha_min) & (out[:, AT["u_m"]] <= 1.0)).all()
    assert ((out[:, AT["brake"]] >= 0.0) & (out[:, AT["brake"]] <= 1.0)).all()


def cycles_to_stop(block: Block) -> int:
    return math.ceil(time_to_stop(block.guard, block.plc) / block.t_cycle)


def stopped(block: Block, row: np.ndarray) -> bool:
    closed = row[AT["brake"]] == 1.0 or block.plc.brake.fitted < 0.5
    return bool(row[AT["u_p"]] == 0.0 and closed and row[AT["state"]] == STOPPED)


@pytest.mark.long
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_healthy_inputs_give_the_bits_of_the_controller_that_simulates(crane, controller):
    block = block_of(crane, controller)
    rows, ours = (each[: sum(p.cycles for p in parts(block)[:9])] for each in cycles_of(crane, controller))
    np.testing.assert_array_equal(bits(ours[:, : AT["alarm"]]), bits(unguarded(block, rows[:, :N])))
    assert not ours[:, AT["alarm"] :].any()


def wrong_values(block: Block, signal: str) -> list[float]:
    """Values that this signal cannot have: those of `BAD`, and both ends passed."""
    least, most = (getattr(getattr(block.guard, k), signal) for k in ("least", "most"))
    return [*BAD, most + 0.01 * abs(most), least - 0.01 * max(abs(least), 1.0)]


@pytest.mark.parametrize(("crane", "controller"), pairs())
@pytest.mark.parametrize("signal", SIGNALS)
def test_a_signal_that_stays_bad_has_its_reaction(crane, controller, signal):
    block = block_of(crane, controller)
    i = SIGNALS.index(signal)
    for value in [*wrong_values(block, signal), "quality"]:
        rows = steady(block)
        rows[BEFORE:, N + i if value == "quality" else i] = 0.0 if value == "quality" else value
        out = GuardedPlc(block).run(rows)
        safe(block, out)
        assert not out[:BEFORE, AT["alarm"]].any()
        assert (out[BEFORE:, AT["alarm"]] == 2.0**i).all(), value
        if getattr(block.guard.stops, signal) > 0.5:
            assert stopped(block, out[BEFORE + cycles_to_stop(block)]), (value, out[-1])
            assert (out[BEFORE + cycles_to_stop(block) :, AT["u_p"]] == 0.0).all()
            assert out[-1, AT["cause"]] == 2.0**i
        else:
            assert (out[BEFORE:, AT["state"]] == SUBSTITUTED).all(), value


@pytest.mark.parametrize("signal", ["s_tip", "v_tip", "a_tip", "s_op", "s_w", "F", "alpha_m", "K_wire"])
def test_a_jump_is_replaced_until_the_signal_has_been_good_for_a_while(signal):
    block = block_of(CLOSED, "ssc")
    rows, i = steady(block), SIGNALS.index(signal)
    step, most, least = (getattr(getattr(block.guard, k), signal) for k in ("step", "most", "least"))
    jump = 1.5 * step if rows[BEFORE, i] + 1.5 * step < most else -1.5 * step
    assert least < rows[BEFORE, i] + jump < most
    rows[BEFORE:, i] += jump
    out = GuardedPlc(block).run(rows)
    safe(block, out)
    back = math.ceil(block.guard.t_back / block.t_cycle)
    assert (out[BEFORE : BEFORE + back, AT["alarm"]] == 2.0**i).all()
    assert not out[BEFORE + back + 1 :, AT["alarm"]].any()
    if signal in ("s_tip", "s_w", "s_op"):  # a jump of a position moves the reference, not the winch
        undisturbed = GuardedPlc(block).run(steady(block))
        assert np.abs(out[:, AT["u_p"]] - undisturbed[:, AT["u_p"]]).max() < 0.01


@pytest.mark.parametrize("value", [0.0, -0.0, 5e-324, -5e-324, 2.2e-308])
@pytest.mark.parametrize("signal", ["s_tip", "v_tip", "a_tip", "v_op", "dp", "F"])
def test_zeros_and_the_smallest_numbers_are_numbers(signal, value):
    block = block_of(CLOSED, "ssc")
    rows = steady(block)[:100]
    rows[:, SIGNALS.index(signal)] = value
    rows[:, SIGNALS.index("mode")] = 0.0
    out = GuardedPlc(block).run(rows)
    assert not out[:, AT["alarm"]].any()
    safe(block, out)


@pytest.mark.parametrize(("crane", "controller"), pairs())
@pytest.mark.parametrize("mode", [-1.0, 0.5, 99.0, 1e300, NAN, "another controller"])
def test_an_unknown_mode_holds_the_winch(crane, controller, mode):
    block = block_of(crane, controller)
    rows = steady(block)
    rows[BEFORE:, SIGNALS.index("mode")] = (1.0 if block.code == 2.0 else 2.0) if isinstance(mode, str) else mode
    out = GuardedPlc(block).run(rows)
    safe(block, out)
    assert stopped(block, out[BEFORE + cycles_to_stop(block)])


def test_the_first_cycle_may_be_bad():
    block = block_of(CLOSED, "ssc")
    for i in range(N):
        rows = steady(block)
        rows[:, i] = NAN
        out = GuardedPlc(block).run(rows)
        safe(block, out)
        if block.guard.stops[i] > 0.5:
            assert (out[:, AT["u_p"]] == 0.0).all()
            assert stopped(block, out[-1])


def test_a_stop_is_left_by_an_acknowledgement_at_rest_alone():
    block = block_of(CLOSED, "ssc")
    rows = steady(block, 1200)
    at = SIGNALS.index
    rows[400:420, at("s_w")] = NAN
    rows[700:, at("mode")] = 0.0
    rows[800:, at("v_op")] = 0.0
    rows[[600, 700, 750], -1] = 1.0  # mode is not manual; joystick is not released
    assert (GuardedPlc(block).run(rows)[500:, AT["state"]] == STOPPED).all()
    rows[820:, -1] = 1.0
    out = GuardedPlc(block).run(rows)
    assert (out[500:820, AT["state"]] == STOPPED).all()
    assert not out[820:, AT["state"]].any()
    rows[750:, -1] = 1.0  # held down since before: no edge
    assert (GuardedPlc(block).run(rows)[500:, AT["state"]] == STOPPED).all()


def test_a_signal_that_fails_a_tenth_of_the_time_stops_the_winch_as_one_that_fails():
    block = block_of(CLOSED, "ssc")
    rows = steady(block, 3000)
    for k in range(400, 3000, 20):
        rows[k : k + 3, SIGNALS.index("v_tip")] = NAN
    assert stopped(block, GuardedPlc(block).run(rows)[-1])


def test_a_joystick_that_failed_is_obeyed_again_when_it_was_released():
    block = block_of(CLOSED, "ssc")
    rows, at = steady(block, 1200), SIGNALS.index("v_op")
    speed = -rows[0, at] * block.plc.gains.K_1
    rows[:, SIGNALS.index("mode")] = 0.0
    rows[:400, at] = rows[0, at]
    rows[400:440, at] = NAN
    rows[700:710, at] = 0.0
    out = GuardedPlc(block).run(rows)
    assert (out[500:700, AT["u_ff"]] == 0.0).all()
    assert abs(out[-1, AT["u_ff"]]) == pytest.approx(speed, rel=1e-9)


@pytest.mark.slow
def test_a_million_random_cycles_with_faults_are_safe():
    block, n = block_of(CLOSED, "ssc"), 50_000
    plc = GuardedPlc(block)
    stops = 0
    wait = cycles_to_stop(block)
    for seed in range(RANDOM // n):
        out = plc.run(faulty(block, n, seed))
        safe(block, out)
        carried = plc.memory
        assert np.isfinite([*flat(carried.m), *flat(carried.laws.guard.g)]).all()
        long = np.convolve(out[:, AT["state"]] == STOPPED, np.ones(wait), "valid") == wait
        ends = out[wait - 1 :][long]
        assert (ends[:, AT["u_p"]] == 0.0).all()
        assert (ends[:, AT["brake"]] == 1.0).all()
        stops += len(ends)
    assert 0.1 * RANDOM < stops < 0.9 * RANDOM


@pytest.mark.long
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_random_faults_give_the_text_and_the_compiled_controller_the_same_outputs(crane, controller):
    block = block_of(crane, controller)
    rows = faulty(block, RANDOM_TEXT, 3)
    step = machine_of(crane, controller).start()
    as_bool = rows.copy()
    as_bool[:, N:] = np.abs(rows[:, N:] - 1.0) < 0.5
    ours = np.array([step(*row) for row in as_bool.tolist()])
    np.testing.assert_array_equal(ours, GuardedPlc(block).run(as_bool))
    assert len(set(ours[:, AT["state"]])) > 1


@pytest.mark.long
@pytest.mark.parametrize("dialect", DIALECTS)
def test_a_plc_that_compares_nan_in_its_own_way_stops_as_well(dialect):
    block = block_of(CLOSED, "ssc")
    machine = machine_of(CLOSED, "ssc", DIALECTS[dialect])
    k, rest = 60, 60 + cycles_to_stop(block) + 2
    for i, signal in enumerate(SIGNALS):
        rows = steady(block, rest)
        rows[k:, i] = NAN
        step = machine.start()
        out = np.array([step(*row) for row in rows.tolist()])
        safe(block, out)
        np.testing.assert_array_equal(out, GuardedPlc(block).run(rows), err_msg=signal)


@pytest.mark.long
@pytest.mark.parametrize("dialect", DIALECTS)
def test_a_memory_that_is_no_number_heals_and_stops_the_winch(dialect):
    block = block_of(CLOSED, "ssc")
    step = machine_of(CLOSED, "ssc", DIALECTS[dialect]).start()
    rows = steady(block, 90 + cycles_to_stop(block)).tolist()
    used = ("m_mode", "m_datum", "m_f", "m_p_mean", "m_u_p", "m_u_m", "m_b_p", "m_b_m", "m_brake", "m_idle", "m_stroke")
    guards = ("g_last_s_w", "g_used_s_w", "g_well_v_tip", "g_bad_v_tip", "g_stopped", "g_fault", "g_cause", "g_begun")
    cells = dict(zip(step.__code__.co_freevars, step.__closure__, strict=True))
    before = [step(*row) for row in rows[:60]]
    memory = {name: cell.cell_contents for name, cell in cells.items()}
    for name in (*used, *guards):
        for held, cell in cells.items():
            cell.cell_contents = memory[held]
        cells[f"v_{name}"].cell_contents = NAN
        made = np.array(before + [step(*row) for row in rows[60:]])
        safe(block, made)
        if name in used:
            assert stopped(block, made[-1]), name
            assert made[-1, AT["cause"]] == MEMORY_FAULT
        assert all(math.isfinite(c.cell_contents) for n, c in cells.items() if n.startswith(("v_m_", "v_g_")))


def test_a_guarded_row_has_inputs_qualities_and_a_reset():
    assert (OUTSIDE, GUARDED) == (2 * N + 1, len(AT))


LAW = '''
"""A law whose memory grows beyond all numbers."""

from typing import NamedTuple

from stillhook.control.interface import Demand
from stillhook.physics.scalar import scalar

NAME, TITLE = "grows", "a law that loses its numbers"


class Memory(NamedTuple):
    x: float = 0.0


@scalar
def cycle(r, plc, m):
    x = m.x + 4.0e28 * abs(r.y.v_tip)
    return Demand(r.u_ff + (x - x), 1.0), Memory(x)
'''


def a_law_without_numbers_stops() -> None:
    block = block_of(CLOSED, "grows")
    step, reference = machine_of(CLOSED, "grows").start(), Reference(block)
    rows = steady(block)
    out = np.array([step(*row) for row in rows.tolist()])
    wanted = np.array([reference.step(Sensed(*row[:N])) for row in rows.tolist()])
    np.testing.assert_array_equal(bits(out), bits(wanted))
    safe(block, out)
    assert stopped(block, out[-1])
    assert out[-1, AT["cause"]] == LAW_FAULT
    assert not out[:200, AT["alarm"]].any()
    assert math.isfinite(reference.laws.grows_memory.x)


@pytest.mark.long
def test_a_law_of_the_user_that_loses_its_numbers_stops_the_winch(tmp_path):
    module = tmp_path / "grows.py"
    module.write_text(LAW, encoding="utf-8")
    paths = os.pathsep.join([str(DOCS.parent / "src"), str(DOCS.parent)])
    code = f"from tests.export.plc import test_guard as t; t.{a_law_without_numbers_stops.__name__}()"
    environment = os.environ | {"STILLHOOK_EXTENSIONS": str(module), "PYTHONPATH": paths}
    ran = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
