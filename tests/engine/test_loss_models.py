"""The loss model of each set of motors, as a crane file names it: it runs, its energy closes, and a map of MJ4 gives what
MJ4 gives."""

import itertools

import numpy as np
import pytest
from tests.engine.test_c99 import SAME, compile_c
from tests.export.fmu.slave import OWN, Slave, given, same

from stillhook import Scenario, load_crane, simulate
from stillhook.analysis.loop_stability.differences import numbers_of
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.pack.winch import losses_of, pack
from stillhook.engine.scenario.checks import foresee
from stillhook.export.fmu import write_fmu
from stillhook.export.twin import export
from stillhook.identify.motor.fit import fit_loss
from stillhook.identify.motor.map import read_map
from stillhook.kernels import build
from stillhook.kernels.lanes import flatten
from stillhook.library import changed
from stillhook.library.examples import MOTOR_MAP
from stillhook.physics.hydraulics.motor import torque_loss
from stillhook.spec.scenario import Operator
from stillhook.winches.circuits.losses import LossName, loss_fit

AUDIT = 1.0e-4
"""Energy that is not accounted for, of that through the winch, as of MJ4 (`tests.conservation.test_energy`)."""
MANUAL = Operator(profile=(("0 s", "0 m/min"), ("1 s", "12 m/min"), ("8 s", "12 m/min")))


@pytest.fixture(scope="module")
def example():
    return read_map(MOTOR_MAP)


@pytest.fixture
def interpreted(monkeypatch):
    """Kernels in plain Python: a run of seconds starts at once with any loss model."""
    build._driver.cache_clear()
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    yield
    build._driver.cache_clear()


def with_model(crane, model, **active):
    """The crane with a loss model for all its motors."""
    return changed(crane, {name: {"motor": {"loss_model": model, **active}} for name in crane.circuits})


def model_of(law, example):
    if law in ("map", "mj4"):
        return {"law": law, "map": "motor-map"} if law == "map" else {"law": law}
    return {"law": law, "C": fit_loss(example, law).values.tolist()}


@pytest.mark.long
@pytest.mark.parametrize("law", [law.value for law in LossName])
def test_every_model_runs_in_the_150t_crane_and_in_digital_units_and_their_energy_closes(law, example, interpreted):
    model = model_of(law, example)
    digital = changed(load_crane("nov-250t-digital"), {"secondary": {"unit": {"loss_model": model}}})
    for crane, mode, highest in (
        (with_model(load_crane("nov-150t"), model), "ssc", "p_max"),
        (digital, "position", "p_r_max"),
    ):
        case = Scenario(load="40 t", s_w="100 m", tip="sine 1 m 8 s", mode=mode, duration="4 s", warm_up="0 s")
        run = simulate(crane, case)
        assert run.status.item() == "ok"
        assert abs(float(run.energy_unaccounted)) < AUDIT
        assert float(run[highest]) > 20e5


def map_of_mj4(motor, counts=(10, 20, 9)):
    """The motor's own MJ4 as the table of a map, with its levels."""
    ends = ((0.0, motor.D_max), (0.0, motor.n_max_full), (0.0, 4.0e7))
    levels = [np.linspace(*end, n) for end, n in zip(ends, counts, strict=True)]
    T_f = [float(torque_loss(n, D, dp, loss_fit(motor))) for D, n, dp in itertools.product(*levels)]
    units = ("m^3/rad", "rad/s", "Pa")
    names = ("D_m", "omega_m", "dp_m")
    table = {name: [f"{x!r} {unit}" for x in x_.tolist()] for name, unit, x_ in zip(names, units, levels, strict=True)}
    return {"law": "map", "map": "of MJ4", "T_f": [f"{x!r} N m" for x in T_f], **table}, levels


@pytest.mark.long
def test_a_map_of_mj4_holds_the_pressure_of_mj4_within_the_interpolation_error(interpreted):
    """At a steady speed the lines' pressure carries the loss: D dp = T_w + n T_f(dp), so that an error E of the map of
    one motor moves it by at most n E / (D - n dT_f/dp), whatever else the winch does."""
    crane = load_crane("nov-100t-pure-active")
    motor = crane.active.motor
    table, levels = map_of_mj4(motor)
    case = Scenario(
        load="40 t", s_w="100 m", tip="still", mode="manual", duration="8 s", warm_up="0 s", operator=MANUAL
    )
    runs = [simulate(c, case) for c in (crane, with_model(crane, table))]
    mj4, mapped = (float((run.p_a - run.p_b).values[-1]) for run in runs)
    fit, (h_D, h_n, h_dp) = loss_fit(motor), (float(np.diff(x).max()) for x in levels)
    D, n_max = motor.D_max, motor.n_max_full
    E = (h_D**2 * 6.0 * fit.X_2 * n_max**2 * D + h_n**2 * 2.0 * fit.X_2 * D**3 + h_dp**2 * 2.0 * fit.X_5) / 8.0
    alpha = float(runs[0].alpha_m.values[-1])
    dT = fit.X_3 * alpha * D + 2.0 * fit.X_5 * mj4
    bound = motor.count * E / (motor.count * (alpha * D - dT))
    assert 0.0 < abs(mapped - mj4) <= bound
    assert bound < 0.02 * mj4


def test_mj4_by_name_is_the_same_kernel_to_the_bit():
    crane = load_crane("nov-150t")
    named = with_model(crane, {"law": "mj4"})
    case = Scenario(load="40 t", s_w="100 m", tip="sine 1 m 8 s", mode="ssc", duration="40 s")
    assert losses_of(named) == losses_of(crane) == ()
    assert pack(named, case).params == pack(crane, case).params


def test_each_set_of_motors_has_its_own_model_in_the_key_of_its_kernel(example):
    crane = load_crane("nov-150t")
    crane = changed(crane, {"active": {"motor": {"loss_model": model_of("mj6", example)}}})
    assert losses_of(crane) == (("active.motors.fit", "mj6"),)
    crane = changed(crane, {"passive": {"motor": {"loss_model": model_of("map", example)}}})
    (place, active), (passive_place, passive) = losses_of(crane)
    assert (place, active, passive_place) == ("active.motors.fit", "mj6", "passive.motors.fit")
    assert passive.startswith("map-")


@pytest.mark.parametrize(
    ("name", "table", "motors"),
    [
        ("nov-250t-secondary", "secondary", "unit"),
        ("nov-250t-digital", "secondary", "unit"),
        ("utility-20t-open-circuit", "open", "motor"),
    ],
)
def test_motors_of_other_winch_types_take_a_model_as_well(name, table, motors, example, interpreted):
    crane = load_crane(name)
    crane = changed(crane, {table: {motors: {"loss_model": model_of("mj6", example)}}})
    assert [law for _, law in losses_of(crane)] == ["mj6"]
    case = Scenario(load="5 t", s_w="50 m", tip="sine 0.3 m 8 s", duration="2 s", warm_up="0 s")
    run = simulate(crane, case)
    assert abs(float(run.energy_unaccounted)) < AUDIT


def test_outside_the_range_of_a_map_there_is_a_note(example):
    crane = load_crane("nov-150t")
    table, levels = map_of_mj4(crane.active.motor)
    table["D_m"] = [f"{x / 3.0!r} m^3/rad" for x in levels[0].tolist()]
    case = Scenario(load="40 t", s_w="100 m", tip="sine 1 m 8 s", mode="hs")
    notes = foresee(with_model(crane, table), case).notes
    assert any("which were measured up to 33 %" in note for note in notes)
    assert not any("measured up to" in note for note in foresee(crane, case).notes)


@pytest.mark.thorough
def test_a_kernel_with_a_map_is_the_same_in_c(tmp_path, example):
    import ctypes
    from dataclasses import replace

    from numpy.ctypeslib import ndpointer

    from stillhook.engine.scenario.run import Ready, ScenarioBlock
    from stillhook.kernels.build import Setup, c_source, driver

    crane = with_model(load_crane("nov-100t-pure-active"), model_of("map", example))
    case = Scenario(load="20 t", s_w="100 m", tip="sine 1 m 8 s", mode="ssc", duration="20 s", warm_up="5 s")
    setup = Setup(losses=losses_of(crane))
    library = compile_c(c_source("pure-active", (1,), setup), tmp_path)
    array, n = ndpointer(np.float64, flags="C_CONTIGUOUS"), ctypes.c_int64
    library.run_1.argtypes, library.run_1.restype = (
        [array, array, n, array, array, array, array, *[n] * 7, ctypes.c_double],
        None,
    )
    blocks = [ScenarioBlock([Ready.of(crane, case)], lanes=1, n_sub=2, every=1) for _ in range(2)]
    blocks[1].d = replace(driver("pure-active", 1, setup), run=library.run_1)
    for block in blocks:
        for _ in block.steps():
            pass
    assert blocks[1].out == pytest.approx(blocks[0].out, rel=SAME, abs=1e-9)


def test_the_linearised_loop_has_the_numbers_of_another_model(example):
    """A plan and `stability` go by them."""
    crane = load_crane("nov-150t")
    case = Scenario(load="40 t", s_w="100 m", tip="still", mode="ssc")
    params = pack(with_model(crane, model_of("mj6", example)), case).params
    assert numbers_of([params]) == flatten(params)
    assert set(fit_loss(example, "mj6").values.tolist()) <= set(numbers_of([params]))


@pytest.mark.long
@pytest.mark.skipif(OWN is None, reason="an FMU has no library for this system")
def test_an_fmu_of_digital_units_with_another_model_has_the_signals_of_simulate(example, tmp_path):
    crane = changed(load_crane("nov-250t-digital"), {"secondary": {"unit": {"loss_model": model_of("mj6", example)}}})
    case = Scenario(load="60 t", s_w="100 m", tip="sine 1 m 8 s", mode="position", duration="4 s", warm_up="0 s")
    run, names = simulate(crane, case, every="10 ms"), ("p_r", "alpha_s", "omega_m", "T_f")
    tip = [CycleInputs(crane, case).full_row(k)[:3] for k in range(run.sizes["time"])]
    host = Slave(write_fmu(export(crane, case), tmp_path / "digital.fmu", platforms=[str(OWN)])[0], tmp_path)
    host.begin(given(tip[0]), {"input_time": 0})
    out = [host.get(*names)]
    for k, row in enumerate(tip[1:]):
        host.set(**given(row))
        host.step(k * 0.01, 0.01)
        out.append(host.get(*names))
    same(np.array(out).T, run, names)
