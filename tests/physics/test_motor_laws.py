"""The loss of motors as the twin takes it: dry friction and what grows with speed, whatever the model; and a map."""

import ctypes
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.engine.test_c99 import compile_c
from tests.physics.test_motor_losses import TYPICAL

from stillhook.identify.motor.fit import LossModel
from stillhook.kernels.c99.source import Translator
from stillhook.kernels.lanes import Array, access, flatten
from stillhook.library import motor
from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss, torque_loss_dry, torque_loss_moving
from stillhook.physics.hydraulics.motor_laws import (
    BLIND,
    LAWS,
    map_record,
    motor_loss,
    motor_loss_dry,
    motor_loss_moving,
    record_of,
)
from stillhook.physics.hydraulics.motor_losses import OMEGA_LOW, LossMotor
from stillhook.physics.scalar import _power, power

ROUNDING = 1.0e-12
"""Relative: sums of a few terms in another order."""
SAME = 1.0e-12
"""Relative: compilers fuse different operations in the exponential of the power."""
D_MAX = motor("A6VM280").D_max
MJ4 = TorqueLossFit(*TYPICAL[LossModel.MJ4])
BY_DISPLACEMENT = [law for law in LAWS if law not in (*BLIND, "mj4")]
RANGE = {"D": (0.2 * D_MAX, D_MAX), "omega": (0.0, 300.0), "dp": (0.0, 4.0e7)}


def fit_of(law: str):
    return record_of(law)(LAWS[law].record(*TYPICAL[LossModel(law)]), LossMotor(D_MAX), 1.0)


def map_of_mj4(counts=(6, 12, 9), **ends):
    """A map that MJ4 makes, with its levels."""
    levels = [np.linspace(*(RANGE | ends)[name], n) for name, n in zip(RANGE, counts, strict=True)]
    T = [float(torque_loss(omega, D, dp, MJ4)) for D, omega, dp in itertools.product(*levels)]
    return map_record(*(tuple(x.tolist()) for x in levels), tuple(T))(1.0), levels


FITS = {law: fit_of(law) for law in BY_DISPLACEMENT} | {"mj4": MJ4, "map": map_of_mj4()[0]}
laws = pytest.mark.parametrize("law", list(FITS))
point = {"omega": st.floats(-300.0, 300.0), "D": st.floats(0.0, D_MAX), "dp": st.floats(-4.0e7, 4.0e7)}


@laws
@settings(deadline=None, max_examples=40)
@given(**point)
def test_dry_friction_and_what_grows_with_speed_are_the_loss_and_neither_drives_the_shaft(law, omega, D, dp):
    at = (omega, D, dp, FITS[law])
    dry, moving = motor_loss_dry(*at), motor_loss_moving(*at)
    assert min(dry, moving) >= 0.0
    assert dry + moving == pytest.approx(motor_loss(*at), rel=ROUNDING, abs=1e-300)


@laws
@settings(deadline=None, max_examples=20)
@given(D=point["D"], dp=point["dp"])
def test_at_standstill_all_loss_is_dry_and_finite(law, D, dp):
    assert motor_loss_moving(0.0, D, dp, FITS[law]) == 0.0
    assert np.isfinite(motor_loss_dry(0.0, D, dp, FITS[law]))


@pytest.mark.parametrize("law", ["mj1", "mj6"])
def test_dry_friction_falls_with_speed_as_the_loss_at_the_notches_does(law):
    record = LAWS[law].record
    notches = FITS[law]._replace(law=record(*[0.0] * len(record._fields))._replace(C_k=1.0e-6))
    at_rest, slow, fast = (motor_loss_dry(omega, D_MAX, 2e7, notches) for omega in (0.0, OMEGA_LOW, 2.0 * OMEGA_LOW))
    assert at_rest == slow
    assert fast == pytest.approx(0.5 * slow, rel=ROUNDING)


@pytest.mark.parametrize("law", ["ortwig", "huhtala-28"])
def test_a_model_that_interpolates_is_held_below_its_data_and_never_below_zero(law):
    fit = FITS[law]
    assert motor_loss(0.0, D_MAX, 2e7, fit) == motor_loss(fit.motor.omega_low, D_MAX, 2e7, fit)
    negative = fit._replace(law=type(fit.law)(*(-x for x in fit.law)))
    assert motor_loss(100.0, D_MAX, 2e7, negative) == 0.0


def test_mj4_is_taken_as_it_is():
    at = (130.0, 0.7 * D_MAX, 2.2e7)
    assert motor_loss(*at, MJ4) == torque_loss(*at, MJ4)
    assert motor_loss_dry(*at, MJ4) == torque_loss_dry(*at[1:], MJ4)
    assert motor_loss_moving(*at, MJ4) == torque_loss_moving(*at[:2], MJ4)


def test_the_scale_of_a_loss_scales_both_parts():
    for law in set(FITS) - {"mj4"}:
        at, twice = (130.0, 0.7 * D_MAX, 2.2e7), FITS[law]._replace(scale=2.0)
        for part in (motor_loss_dry, motor_loss_moving):
            assert part(*at, twice) == pytest.approx(2.0 * part(*at, FITS[law]), rel=ROUNDING, abs=1e-12)


def interpolation_bound(levels) -> float:
    """Largest error of linear interpolation of MJ4 in each axis in turn: sum of h^2 / 8 times the largest second
    derivative, 6 X_2 omega^2 D, 2 X_2 D^3 and 2 X_5."""
    h_D, h_omega, h_dp = (float(np.diff(x).max()) for x in levels)
    D, omega = float(levels[0][-1]), float(levels[1][-1])
    return (h_D**2 * 6.0 * MJ4.X_2 * omega**2 * D + h_omega**2 * 2.0 * MJ4.X_2 * D**3 + h_dp**2 * 2.0 * MJ4.X_5) / 8.0


@pytest.mark.parametrize("counts", [(6, 12, 9), (3, 5, 4)])
def test_a_map_errs_between_its_levels_by_no_more_than_the_closed_form(counts):
    fit, levels = map_of_mj4(counts)
    rng = np.random.default_rng(0)
    omega, D, dp = (rng.uniform(x[0], x[-1], 4000) for x in (levels[1], levels[0], levels[2]))
    error = np.abs(motor_loss(omega, D, dp, fit) - torque_loss(omega, D, dp, MJ4))
    bound = interpolation_bound(levels)
    assert error.max() <= bound
    assert error.max() > 0.3 * bound


def test_a_map_passes_through_its_cells_and_is_held_outside():
    fit, levels = map_of_mj4()
    for i, j, k in [(0, 0, 0), (3, 7, 4), (5, 11, 8)]:
        at = float(levels[1][j]), float(levels[0][i]), float(levels[2][k])
        assert motor_loss(*at, fit) == pytest.approx(torque_loss(*at, MJ4), rel=ROUNDING)
    edge = motor_loss(300.0, D_MAX, 4e7, fit)
    assert motor_loss(900.0, 2.0 * D_MAX, 9e7, fit) == edge


def test_the_lowest_speed_level_of_a_map_is_its_dry_friction():
    fit, levels = map_of_mj4(omega=(50.0, 300.0))
    low = float(levels[1][0])
    assert motor_loss_dry(0.0, D_MAX, 2e7, fit) == motor_loss(low, D_MAX, 2e7, fit)
    assert motor_loss_moving(0.5 * low, D_MAX, 2e7, fit) == 0.0


def test_one_level_of_an_axis_holds_everywhere_on_it():
    fit = map_record((2e-5,), (50.0, 150.0), (1e7,), (10.0, 30.0))(1.0)
    assert [motor_loss(100.0, D, dp, fit) for D, dp in ((1e-6, 1e5), (2e-5, 1e7), (9e-5, 9e7))] == [20.0] * 3


@settings(deadline=None)
@given(x=st.floats(1e-9, 1e6), n=st.floats(0.1, 5.0))
def test_the_power_of_kernels_is_that_of_the_library(x, n):
    assert _power(x, n) == pytest.approx(power(x, n), rel=1e-13)


@pytest.mark.long
@laws
def test_c_and_numba_give_the_same_loss(law, tmp_path, numba):
    from stillhook.kernels.by_numba import machine_code

    load, fit = access(type(FITS[law]), 1).load, FITS[law]

    def probe(A: Array, out: Array, n: int):
        fit = load(A, 3 * n)
        for i in range(n):
            out[2 * i] = motor_loss_dry(A[3 * i], A[3 * i + 1], A[3 * i + 2], fit)
            out[2 * i + 1] = motor_loss_moving(A[3 * i], A[3 * i + 1], A[3 * i + 2], fit)

    rng, n = np.random.default_rng(1), 200
    points = np.column_stack([rng.uniform(-300, 300, n), rng.uniform(0, D_MAX, n), rng.uniform(-4e7, 4e7, n)])
    A = np.array([*points.ravel(), *flatten(fit)])
    t = Translator()
    t.function(probe, (Array, Array, int), export="probe")
    library, pointer = compile_c(t.source(), tmp_path), np.ctypeslib.ndpointer(np.float64)
    library.probe.argtypes, library.probe.restype = [pointer, pointer, ctypes.c_int64], None
    by_c, by_numba = np.empty(2 * n), np.empty(2 * n)
    library.probe(A, by_c, n)
    machine_code(probe, tmp_path)(A, by_numba, n)
    in_python = [f(*p, fit) for p in points.tolist() for f in (motor_loss_dry, motor_loss_moving)]
    assert by_c == pytest.approx(by_numba, rel=SAME, abs=1e-12)
    assert by_numba == pytest.approx(in_python, rel=SAME, abs=1e-11)
