"""The tip's motion is predicted where it is asked for: exactly for a wave that an oscillator is, better than
extrapolated in a sea, and in the text of the PLC to the bit."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest
import scipy.linalg
from tests.export.fmu.slave import OWN, Slave, given
from tests.export.plc.structured_text import Machine
from tests.export.twin.test_core import CLOSE, case_of, rows

import stillhook
from stillhook import Scenario, load_crane, simulate
from stillhook.control.controllers import ff
from stillhook.control.interface import Reading, Sensed
from stillhook.control.plc import ahead, foreseen
from stillhook.engine.pack.prediction import predicting, steady_filter
from stillhook.engine.pack.winch import kernel_of, pack, plc_record
from stillhook.errors import StillhookError
from stillhook.export.fmu import write_fmu
from stillhook.export.plc import structured_text
from stillhook.export.plc.block import controller_block
from stillhook.export.plc.sequence import Reference, inputs, numbers
from stillhook.export.twin import export
from stillhook.library import changed
from stillhook.live.hil.controller import LibraryController
from stillhook.physics.tip_prediction import E_MOST, MODES, Memory, State, followed
from stillhook.spec.control import own_settings
from stillhook.spec.scenario import Mode

NAME = "nov-250t"
REST = Memory(0.0, 0.0, *[State(0.0, 0.0)] * len(MODES))
T, T_FF = 0.2, 0.25
LEADS = {"t_lead": f"{T} s", "t_lead_ff": f"{T_FF} s"}
STEP, ROUNDING = 0.01, 1e-12
REMAINDER = 1e-8
"""Of the series, in a command [-]: 2e-11 of the speed of a wave of 7.3 s after 0.3 s, and more in its rates over a cycle."""
PERIODS = tuple(np.geomspace(24.0, 3.0, len(MODES)).tolist())
LATE = {
    "delay": "200 ms", "seed": 5, "noise_s_tip": "2 mm", "noise_v_tip": "3 mm/s", "noise_a_tip": "0.02 m/s^2"
}  # fmt: skip


def plain(**control: object) -> stillhook.Crane:
    return changed(load_crane(NAME), {"control": LEADS | control})


@functools.cache
def crane(**prediction: str) -> stillhook.Crane:
    return plain(prediction=prediction)


class Follower:
    """A filter that follows a motion (n, 3) of position, speed and acceleration, and what it foresees (n, 3)."""

    def __init__(self, of: stillhook.Crane, memory: Memory = REST) -> None:
        self.plc, self.s, self.m = plc_record(of), predicting(of)["prediction"], memory
        self.shares: list[float] = []
        self.times: list[float] = []

    def run(self, motion: np.ndarray) -> np.ndarray:
        out = []
        for s, v, a in motion.tolist():
            self.m = followed(v, a, self.m, self.s, self.plc.t_cycle)
            y, t_a = foreseen(seen(s, v, a), self.m, self.s, self.plc)
            out.append((y.s_tip, y.v_tip, y.a_tip))
            self.shares.append(self.m.share)
            self.times.append(t_a)
        return np.array(out)


def seen(s: float, v: float, a: float) -> Sensed:
    return Sensed(*[0.0] * len(Sensed._fields))._replace(s_tip=s, v_tip=v, a_tip=a)


def wave(t: np.ndarray, mode: int, mean: float = 3.0) -> np.ndarray:
    """Position, speed, acceleration of a mode that swings freely, of amplitude 1 m about a mean."""
    s = predicting(crane())["prediction"][MODES.index(f"mode_{mode}") - len(MODES)]
    p = -0.5 * s.c + 1j * math.sqrt(s.omega2 - 0.25 * s.c**2)
    z = np.exp(p * t)
    return np.column_stack([mean + z.real, (p * z).real, (p**2 * z).real])


def later(t: np.ndarray, mode: int) -> np.ndarray:
    """What is foreseen of it: position after T, speed and acceleration after T_FF."""
    return np.column_stack([wave(t + T, mode)[:, :1], wave(t + T_FF, mode)[:, 1:]])


def slowest(of: object) -> float:
    """Time constant of the slowest part of the filter's error [s]."""
    F = (np.eye(len(of.A)) - of.K @ of.H) @ of.A
    return -STEP / math.log(np.abs(np.linalg.eigvals(F)).max())


@functools.cache
def steady():
    return steady_filter(STEP, PERIODS, 0.14, (0.003, 0.02))


@pytest.mark.long
@pytest.mark.parametrize("mode", range(1, len(MODES) + 1))
def test_a_wave_of_one_mode_that_is_known_is_foreseen_exactly(mode):
    t = STEP * np.arange(1, 3000)
    of = 2 * (mode - 1)
    start = np.zeros(2 * len(MODES))
    start[of : of + 2] = wave(np.zeros(1), mode, 0.0)[0, :2]
    memory = Memory(0.0, 1.0, *(State(*pair) for pair in start.reshape(-1, 2).tolist()))
    foretold = Follower(crane(), memory).run(wave(t, mode))
    omega = 2.0 * math.pi / PERIODS[mode - 1]
    remainder = omega**2 * (omega * T_FF) ** 7 / math.factorial(7)  # of the series' acceleration, which has six powers
    assert np.abs(foretold - later(t, mode)).max() < max(1.1 * remainder, ROUNDING)


@pytest.mark.long
def test_a_wave_of_the_longest_mode_is_foreseen_exactly_after_the_filter_has_settled():
    t = STEP * np.arange(25_000)
    error = np.abs(Follower(crane()).run(wave(t, 1)) - later(t, 1)).max(axis=1)
    tau, end = slowest(steady()), len(t) - 1
    assert tau < 25.0
    assert error[end] < 3.0 * error[500] * math.exp(-(t[end] - t[500]) / tau) < 1e-3


@pytest.mark.long
def test_the_noise_gain_is_that_of_the_lyapunov_equation():
    """The sum of squares of what a single wrong reading does later is the variance that white noise leaves."""
    f = steady()
    F, L = (np.eye(len(f.A)) - f.K @ f.H) @ f.A, scipy.linalg.expm
    rates = scipy.linalg.block_diag(*([[0.0, 1.0], [-(w**2), -0.1 * w]] for w in 2.0 * np.pi / np.array(PERIODS)))
    speed = np.tile([0.0, 1.0], len(PERIODS)) @ L(rates * T_FF)
    for channel, size in ((0, 1e-3), (1, 1e-2)):
        X = scipy.linalg.solve_discrete_lyapunov(F, np.outer(f.K[:, channel], f.K[:, channel]))
        still = np.zeros((100, 3))
        pulse = np.zeros((12_000, 3))
        pulse[0, 1 + channel] = size
        follower = Follower(crane())
        follower.run(still)
        response = follower.run(pulse)[:, 1] / size
        assert min(follower.shares[100:]) == 1.0
        assert np.sum(response**2) == pytest.approx(speed @ X @ speed, rel=1e-4)


def sea(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Time, and position, speed and acceleration of the tip in two peaks: a swell of 13 s and a wind sea of 6 s."""
    rng, t = np.random.default_rng(seed), STEP * np.arange(15_000)
    f = np.arange(0.04, 0.35, 0.0037)
    S = sum(h**2 * f**-5.0 * fp**4 * np.exp(-1.25 * (fp / f) ** 4) for h, fp in ((1.2, 1 / 13.0), (0.8, 1 / 6.0)))
    p = 2j * np.pi * f
    z = np.sqrt(0.6 * S * 0.0037) * np.exp(np.outer(t, p) + 1j * rng.uniform(0.0, 2.0 * np.pi, f.size))
    return t, np.column_stack([z.sum(1).real, (p * z).sum(1).real, (p**2 * z).sum(1).real])


@pytest.mark.long
def test_a_sea_of_two_peaks_is_foreseen_much_better_than_it_is_extrapolated():
    _t, true = sea(3)
    read = true + np.random.default_rng(4).normal(size=true.shape) * [0.002, 0.003, 0.02]
    foretold = Follower(crane()).run(read)
    plc = plc_record(crane())
    far = np.array(
        [(y.s_tip, y.v_tip) for y in (ahead(seen(*row), plc.t_lead, plc.t_lead_ff) for row in read.tolist())]
    )
    k, z = round(T_FF / STEP), slice(6000, 14_900)

    def error(values: np.ndarray, column: int) -> float:
        return float(np.std(values[z] - np.roll(true[:, column], -k)[z]))

    assert 0.2 < np.std(true[z, 1]) < 1.0
    assert error(foretold[:, 1], 1) < 0.5 * error(far[:, 1], 1)
    assert error(foretold[:, 2], 2) < 0.4 * error(read[:, 2], 2)


@pytest.mark.long
def test_the_filter_goes_over_to_the_extrapolation_when_the_motion_unit_fails_and_back_without_a_bump():
    _t, motion = sea(5)
    bad = motion.copy()
    bad[6000:6100, 2] += 20.0 * (-1.0) ** np.arange(100)  # acceleration that no tip has
    follower = Follower(crane())
    foretold = follower.run(bad)
    shares, far = np.array(follower.shares), bad[:, 1] + T_FF * bad[:, 2]
    assert shares[5999] == 1.0
    assert shares[-1] == 1.0
    off = np.flatnonzero(shares == 0.0)
    off = off[off > 6000]
    assert off[0] < 6060
    assert np.array_equal(foretold[off, 1], far[off])
    assert np.abs(np.diff(shares)).max() < 0.0201  # 1 over the 0.5 s of a blend
    back = slice(6101, None)
    assert np.abs(np.diff(foretold[back, 1])).max() < 1.5 * np.abs(np.diff(far[back])).max()


@pytest.mark.long
def test_a_jump_of_the_position_alone_passes_as_it_is():
    _, motion = sea(6)
    jumped = motion[:4000].copy()
    jumped[2000:, 0] += 1.0
    as_it_was, now = Follower(crane()).run(motion[:4000]), Follower(crane()).run(jumped)
    np.testing.assert_allclose(now[:, 0] - as_it_was[:, 0], np.repeat([0.0, 1.0], 2000), atol=1e-12)
    np.testing.assert_array_equal(now[:, 1:], as_it_was[:, 1:])


def case(**other: object) -> Scenario:
    return Scenario(**{
        "load": "100 t", "s_w": "487 m", "mode": "ssc", "duration": "60 s", "warm_up": "30 s",
        "tip": "sine 2 m 8 s", "sensors": LATE, **other,
    })  # fmt: skip


def test_without_the_table_nothing_is_carried_and_below_the_shortest_lead_the_run_is_the_same_to_the_bit():
    assert not kernel_of(plain()).predicts
    assert predicting(plain()) == {}
    off = simulate(crane(t_least="0.5 s"), case(), series=True)
    for name, values in simulate(plain(), case(), series=True).data_vars.items():
        np.testing.assert_array_equal(values, off[name], err_msg=str(name))


def test_the_wire_follows_a_late_motion_unit_better_and_a_case_alone_as_in_a_batch():
    cases = [case(tip=f"sine {h} m 6 s") for h in (0.8, 1.0, 1.2)]
    plain_run, run = simulate(plain(), cases), simulate(crane(), cases)
    assert (run.e_c_pp < 0.8 * plain_run.e_c_pp).values.all(), (plain_run.e_c_pp.values, run.e_c_pp.values)
    quiet = [each.model_copy(update={"sensors": case(sensors={"delay": "200 ms"}).sensors}) for each in cases]
    assert float(simulate(crane(), quiet[1:2]).e_c_pp[0]) == float(simulate(crane(), quiet).e_c_pp[1])


@pytest.mark.long
@pytest.mark.parametrize("controller", ["ssc", "ff"])
def test_the_text_of_the_plc_has_the_bits_of_the_cycle(controller):
    block = controller_block(crane(), controller)
    text = structured_text(block)
    assert all(f"w_mode_{i}_v" in text for i in range(1, len(MODES) + 1))
    step = Machine(text).start()
    for outside, drive in inputs(block, Reference(block)):
        np.testing.assert_array_equal(step(*numbers(outside)), drive)


@pytest.mark.long
@pytest.mark.parametrize("controller", ["ssc", "ff"])
def test_the_compiled_controller_has_the_bits_of_the_cycle(controller):
    library = LibraryController(crane(), controller)
    cycles = list(inputs(library.block, Reference(library.block)))
    got = library.cycles(np.array([numbers(outside) for outside, _ in cycles]))
    np.testing.assert_array_equal(got, np.array([drive for _, drive in cycles]))


def commands_of_ff(late: float) -> np.ndarray:
    """Pump commands of ff, fully trusted, in a wave that is an oscillator's, read this late [s] by a PLC that knows it:
    the winch follows the tip."""
    lead, n, t = late + 0.048, MODES.index("mode_5"), STEP * np.arange(1, 200) - late
    of = plain(prediction={}, t_lead=f"{lead} s", t_lead_ff=f"{lead} s")
    start = [State(0.0, 0.0)] * len(MODES)
    start[n] = State(*wave(t[:1] - STEP, n + 1, 0.0)[0, :2].tolist())
    follower, plc, out = Follower(of, Memory(0.0, 1.0, *start)), pack(of, case(mode="ff")).params.plc, []
    own, m = own_settings(of.control, Mode("ff").law), ff.Memory(trust=1.0)
    shaft = wave(t + late, n + 1)[:, 1].tolist()
    for (s, v, a), v_w in zip(wave(t, n + 1).tolist(), shaft, strict=True):
        follower.m = followed(v, a, follower.m, follower.s, STEP)
        y, t_a = foreseen(seen(s, v, a), follower.m, follower.s, plc)
        y = y._replace(mode=1.0, f_pump=1.0, alpha_m=1.0, K_wire=1.0, F=1e6, omega_m=-v_w * 200.0)
        demand, m = ff.cycle(Reading(y=y, e_c=0.0, F=1e6, u_ff=0.0, u_fb=0.0, t_a=t_a), plc, own, m)
        out.append(demand.u_p)
    return np.array(out)


def test_in_a_known_wave_ff_commands_by_a_late_motion_unit_what_it_does_by_one_in_time():
    in_time, late = commands_of_ff(0.05), commands_of_ff(0.25)
    assert np.ptp(in_time) > 0.4
    assert np.abs(late - in_time).max() < REMAINDER


@pytest.mark.long
def test_ff_follows_a_late_motion_unit_better_by_prediction():
    tips = ("sine 1 m 6 s", "sine 0.5 m 7 s + sine 0.5 m 9 s", "sine 1 m 8 s + sine 1.2 m 11 s")
    cases = [case(mode="ff", tip=tip, duration="100 s", warm_up="60 s") for tip in tips]
    leads = {"t_lead": "228 ms", "t_lead_ff": "228 ms"}
    extrapolated, run = (simulate(plain(**leads, **table), cases).e_c_pp.values for table in ({}, {"prediction": {}}))
    assert (run < 0.6 * extrapolated).all(), (run, extrapolated)


def test_a_restored_session_goes_on_with_the_same_bits():
    session, other = (stillhook.Session(crane(), case(mode="ff")) for _ in range(2))
    session.step(cycles=600)
    state = session.save()
    assert {f"prediction_memory.{mode}.v" for mode in MODES} <= set(session.states)
    session.step(cycles=300)
    other.restore(state)
    other.step(cycles=300)
    assert other.save() == session.save()


@pytest.mark.long
@pytest.mark.skipif(OWN is None, reason="an FMU has no library for this system")
def test_an_fmu_predicts_as_simulate_does(tmp_path):
    still = case_of(crane())
    run, tip = simulate(crane(), still, every="10 ms", series=True), rows(crane(), still)
    slave = Slave(write_fmu(export(crane(), still), tmp_path / "late.fmu", platforms=[str(OWN)])[0], tmp_path)
    slave.begin(given(tip[0]), {"input_time": 0})
    e_c = []
    for k, row in enumerate(tip[1:]):
        slave.set(**given(row))
        slave.step(k * STEP, STEP)
        e_c.append(slave.get("e_c")[0])
    assert np.abs(np.array(e_c) - run.e_c.values[1 : len(e_c) + 1]).max() < CLOSE
    assert np.abs(run.e_c.values - simulate(plain(), still, every="10 ms", series=True).e_c.values).max() > 1e-3


def test_a_lead_that_changes_while_it_runs_is_predicted_as_one_from_the_start():
    t = STEP * np.arange(2000)
    follower = Follower(crane())
    follower.run(wave(t, 3))
    follower.plc = follower.plc._replace(t_lead_ff=0.6)
    other = Follower(plain(prediction={}, t_lead_ff="0.6 s"))
    other.run(wave(t, 3))
    now = wave(t[-1:] + STEP, 3)
    np.testing.assert_array_equal(follower.run(now), other.run(now))


@pytest.mark.parametrize(
    ("prediction", "leads", "message"),
    [
        ({"kind": "fourier"}, {}, "modes"),
        ({"period_least": "10 s", "period_most": "15 s"}, {}, "period_most"),
        ({"noise_v": "0 m/s"}, {}, "noise_v"),
        ({"t_least": "2 s"}, {}, "t_least"),
        ({"order": 20}, {}, "order"),
        ({}, {"t_lead": "1.5 s"}, "a lead of 1.5 s is beyond"),
    ],
)
def test_what_cannot_be_predicted_is_refused_in_one_line(prediction, leads, message):
    with pytest.raises(StillhookError) as refused:
        changed(load_crane(NAME), {"control": {"prediction": prediction, **leads}})
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.long
def test_differences_of_a_sea_are_far_from_implausible():
    follower = Follower(crane())
    _, true = sea(7)
    follower.run(5.0 * true + np.random.default_rng(8).normal(size=true.shape) * [0.002, 0.003, 0.02])
    assert min(follower.shares[2000:]) == 1.0
    assert follower.m.e < 0.2 * E_MOST
