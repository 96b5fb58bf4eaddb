"""A payload in air, water and soil: momentum, energy, floating, sinking, landing, and waves, against solutions of another kind."""

import math
import re
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from stillhook.engine.pack.payload import pack_payload, wetted_at
from stillhook.kernels.lanes import VL, access
from stillhook.library.catalogue import read_payload
from stillhook.physics.load_path import payload as phys
from stillhook.physics.load_path.payload import LEVELS, Water, WettedLevel
from stillhook.physics.scalar import STRICT, G
from stillhook.spec.lift.payload import Payload

pytestmark = pytest.mark.slow

RHO = 1025.0
STILL = Water(*[0.0] * len(Water._fields))
STEP = 1.0e-3
ODE = 2.0e-3
"""Relative: straight pieces between levels against the smooth curves, and steps that pass over their corners."""
ENERGY = 1.0e-3
"""Relative: steps that pass over the corners of the levels."""
SLOPE = 1.0e-4
"""Relative: slope of the added mass over a millionth of a level, and a micrometre under the surface."""
ROUNDING = 1.0e-9


def slope_felt(z, v, wet, water, load):
    """Slope of the added mass over submergence [kg/m], and the rate of the submergence [m/s]."""
    slope = phys.surface_slope(water.eta - z, wet.dA33, load) * (1.0 + load.bottom_A * phys.felt(z, load))
    return slope, water.eta_dot - v


def mass_rate(z, v, wet, water, load):
    """Rate of the added mass as the payload moves and the surface with it [kg/s].

    For the audit: d/dt 1/2 (m + m_a) v^2 = v (all forces but -m_a dv/dt) + 1/2 mass_rate v^2.
    """
    slope, h_dot = slope_felt(z, v, wet, water, load)
    return slope * h_dot + wet.A33 * load.bottom_A * phys.felt_slope(z, load) * v


def spray_loss(z, v, wet, water, load):
    """Power that goes with the spray on entry and with the water that stays behind on exit, never negative [W]."""
    slope, h_dot = slope_felt(z, v, wet, water, load)
    return 0.5 * abs(slope * h_dot) * h_dot * h_dot


class Lane(NamedTuple):
    """What one payload needs at an instant."""

    z: float
    v: float
    h: float
    lo: WettedLevel
    hi: WettedLevel
    water: Water
    pay: phys.Payload


def plate(**more):
    """A solid plate of 6 m by 5 m, heavy for its size."""
    return Payload(
        **{
            "name": "plate",
            "mass": "60 t",
            "shape": "plate",
            "length": "6 m",
            "width": "5 m",
            "height": "0.5 m",
            **more,
        }
    )


def at(z, record, rows, water=STILL):
    """Wetted numbers with the underside at z, read from the levels."""
    return wetted_at(phys.submergence(z, water.eta, record.reach), rows)


def alike(eta, eta_dot, w, a):
    """Water that moves alike over the whole payload."""
    return Water(eta, eta_dot, a, a, w, w, a, a)


def force(z, v, record, rows, water=STILL):
    return phys.water_force(z, v, at(z, record, rows, water), water, record)


def rate(t, z, v, record, rows, lift=0.0, sea=None):
    water = STILL if sea is None else sea(t, z)
    f = force(z, v, record, rows, water)
    return (f.buoyancy + f.inertia + f.drag + f.slam + f.bottom - record.W + lift) / (record.m + f.m_a)


def simulate(z, v, record, rows, duration, lift=0.0, sea=None, step=STEP):
    """Columns t, z, v of a payload that moves freely from z, v under a constant lift, by the classic Runge-Kutta method."""
    out = [(0.0, z, v)]
    for i in range(round(duration / step)):
        t = i * step
        k_1 = rate(t, z, v, record, rows, lift, sea)
        k_2 = rate(t + step / 2, z + v * step / 2, v + k_1 * step / 2, record, rows, lift, sea)
        k_3 = rate(t + step / 2, z + v * step / 2 + k_1 * step**2 / 4, v + k_2 * step / 2, record, rows, lift, sea)
        k_4 = rate(t + step, z + v * step + k_2 * step**2 / 2, v + k_3 * step, record, rows, lift, sea)
        z += v * step + (k_1 + k_2 + k_3) * step**2 / 6
        v += (k_1 + 2 * k_2 + 2 * k_3 + k_4) * step / 6
        out.append((t + step, z, v))
    return np.array(out).T


def smooth(h, load):
    """Numbers of the plate from its curves, not from the levels."""
    at = load.at(np.array([h]), RHO)
    return float(at.V[0]), float(at.A33[0]), 0.5 * RHO * load.C_D * float(at.A_p[0])


def test_a_drop_onto_still_water_follows_the_balance_of_momentum():
    """Another form of the equation, d/dt (m + A33) U = m g - buoyancy - drag, on the smooth curves, by another solver. Drag comes in over
    the first level."""
    load = plate()
    record, rows = pack_payload(load, RHO, 1000.0)

    def momentum(t, y):
        z, p = y[0], y[1]
        z = min(z, 0.0)
        V, A33, B = smooth(max(-z, 0.0), load)
        U = p / (load.mass + A33)
        return [-U, load.mass * G - RHO * G * V - B * U * abs(U) * min(-z / float(rows[1, 0]), 1.0)]

    U_0 = 3.0
    exact = solve_ivp(
        momentum, (0.0, 2.0), (0.0, load.mass * U_0), rtol=1e-9, atol=1e-9, max_step=0.01, dense_output=True
    )
    t, z, v = simulate(0.0, -U_0, record, rows, 2.0)
    speeds = np.array([exact.sol(s)[1] / (load.mass + smooth(max(-exact.sol(s)[0], 0.0), load)[1]) for s in t[::50]])
    assert np.abs(-v[::50] - speeds).max() < ODE * U_0
    assert z[-1] == pytest.approx(exact.y[0, -1], rel=ODE)


@pytest.mark.thorough
def test_without_weight_and_drag_the_water_takes_its_share_of_the_momentum_and_half_of_the_lost_energy_is_spray():
    """Von Karman: m U_0 = (m + A33) U, so the body and its water keep m / (m + A33) of the energy."""
    load = plate(C_D=0.0)
    record, rows = pack_payload(load, RHO, 1000.0)
    record, rows = record._replace(W=0.0, g=0.0, m=load.mass), rows
    t, z, v = simulate(0.05, -3.0, record._replace(k_soil=0.0), rows, 12.0)
    A33 = load.covered(RHO).A33
    assert z[-1] < -record.reach
    assert v[-1] == pytest.approx(-3.0 * load.mass / (load.mass + A33), rel=ODE)
    spray = [spray_loss(a, b, at(a, record, rows), STILL, record) for a, b in zip(z, v, strict=True)]
    lost = 0.5 * load.mass * 3.0**2 - 0.5 * (load.mass + A33) * v[-1] ** 2
    assert float(np.trapezoid(spray, t)) == pytest.approx(lost, rel=5.0 * ENERGY)


def test_no_force_of_momentum_pulls_a_payload_back_that_leaves_the_water():
    record, rows = pack_payload(plate(), RHO, 1000.0)
    for z in np.linspace(-record.reach, 0.0, 50):
        assert force(z, 2.0, record, rows).slam == 0.0
        assert force(z, -2.0, record, rows).slam >= 0.0


def test_the_peak_of_slamming_is_that_of_the_slamming_coefficient():
    """1/2 rho C_s A_s v^2 at the first touch."""
    load = plate(C_s=6.0)
    record, rows = pack_payload(load, RHO, 1000.0)
    assert force(-1e-6, -2.0, record, rows).slam == pytest.approx(0.5 * RHO * 6.0 * 30.0 * 2.0**2, rel=SLOPE)


def test_a_payload_floats_where_it_displaces_its_mass_and_heaves_with_the_period_of_its_water_plane():
    A_w, H, m = 30.0, 4.0, 60e3
    record, rows = floating(A_w, H, m)
    draught = m / (RHO * A_w)
    f = force(-draught, 0.0, record, rows)
    assert f.buoyancy == pytest.approx(record.W, rel=ROUNDING)
    t, z, _ = simulate(-draught + 0.01, 0.0, record, rows, 20.0, step=5e-3)
    crossings = [a for (a, x), (_, y) in pairwise(zip(t, z + draught, strict=True)) if x > 0.0 >= y]
    T = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    assert pytest.approx(2.0 * math.pi * math.sqrt((m + 40e3) / (RHO * G * A_w)), rel=5e-3) == T


def floating(A_w, H, m):
    """A box of constant added mass 40 t that floats: its record is made here, for a winch could not lower it."""
    h = np.linspace(0.0, H, LEVELS)
    rows = np.zeros((LEVELS, len(WettedLevel._fields)))
    for name, column in {"h": h, "V": A_w * h, "A33": 40e3, "y_m": h / 2.0, "r_m": h / math.sqrt(12.0)}.items():
        rows[:, WettedLevel._fields.index(name)] = column
    record = phys.Payload(m, m * G, H, RHO, G, 0.0, 1000.0, 1e6, 1e5, 1.0, 1.0, 0.0, 0.0, H)
    return record, rows


def test_a_sinking_payload_reaches_the_speed_at_which_drag_carries_its_submerged_weight():
    load = plate()
    record, rows = pack_payload(load, RHO, 1e4)
    W = load.mass * G - RHO * G * load.mass / 7850.0
    _, _, v = simulate(-10.0, 0.0, record, rows, 60.0, step=2e-2)
    assert v[-1] == pytest.approx(-math.sqrt(2.0 * W / (RHO * 2.5 * 30.0)), rel=1e-6)


def test_linear_drag_alone_gives_the_speed_of_weight_over_drag():
    load = plate(C_D=0.0, C_lin="200 kN s/m")
    record, rows = pack_payload(load, RHO, 1e4)
    W = load.mass * G * (1.0 - RHO / 7850.0)
    _, _, v = simulate(-10.0, 0.0, record, rows, 30.0, step=2e-2)
    assert v[-1] == pytest.approx(-W / 200e3, rel=1e-6)


def test_nothing_acts_in_air():
    record, rows = pack_payload(plate(), RHO, 100.0)
    assert force(0.5, -3.0, record, rows, alike(0.2, 1.0, 1.0, 2.0)) == (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


# Seabed


@pytest.mark.thorough
def test_the_seabed_carries_the_submerged_weight_at_the_stated_settlement():
    load = plate(seabed={"settlement": "0.2 m"})
    record, rows = pack_payload(load, RHO, 50.0)
    _, z, v = simulate(-49.0, 0.0, record, rows, 20.0, step=2e-3)
    assert z[-1] == pytest.approx(-50.2, abs=1e-4)
    assert abs(v[-1]) < 1e-4


@given(st.floats(-3.0, 3.0), st.floats(-2.0, 0.0))
@settings(max_examples=200, deadline=None)
def test_the_seabed_never_pulls(v, p):
    record, _ = pack_payload(plate(), RHO, 50.0)
    assert phys.soil_force(-50.0 + p, v, record) >= 0.0
    assert phys.soil_force(-50.0 - p + 1e-9, v, record) == 0.0


def test_a_payload_nears_the_bottom_and_leaves_it_again_without_loss_where_nothing_drags():
    """Kirchhoff's energy 1/2 (m + m_a) v^2 of a payload that flies through the felt layer is kept, whichever way it moves."""
    load = plate(C_D=0.0, seabed={"gap": "3 m", "added_mass": 1.5})
    record, rows = pack_payload(load, RHO, 50.0)
    record = record._replace(W=RHO * G * load.covered(RHO).V)
    for z_0, v_0 in ((-46.0, -1.0), (-49.9, 0.5)):
        _, z, v = simulate(z_0, v_0, record, rows, 2.0)
        E = [0.5 * (load.mass + force(a, b, record, rows).m_a) * b * b for a, b in zip(z, v, strict=True)]
        assert min(z) > -50.0
        assert E == pytest.approx([E[0]] * len(E), rel=1e-6)


def test_the_cushion_of_the_bottom_slows_a_payload_down_without_touch():
    load = plate(C_D=0.0, seabed={"gap": "3 m", "added_mass": 1.5})
    record, rows = pack_payload(load, RHO, 50.0)
    assert force(-49.0, -1.0, record, rows).bottom > 0.0
    assert force(-46.9, -1.0, record, rows).bottom == 0.0


def test_water_under_a_suction_anchor_leaves_through_its_hatches_at_landing():
    """Bernoulli through the hatches: the speed at which the submerged weight drives all water under the roof through them."""
    load = Payload(
        name="a",
        mass="80 t",
        shape="suction-anchor",
        diameter="5 m",
        height="10 m",
        wall="30 mm",
        roof="0.3 m",
        hatch=0.04,
        seabed={"settlement": "8 m"},
    )
    record, rows = pack_payload(load, RHO, 500.0)
    z, W = -500.0 - 1e-6, record.W - RHO * G * float(load.covered(RHO).V)
    inner = math.pi / 4.0 * 4.94**2
    jet = math.sqrt(2.0 * (W / inner) / RHO)
    v = -jet * 0.04 * 0.62
    assert force(z, v, record, rows).drag == pytest.approx(W, rel=1e-3)


@given(st.floats(0.0, 3.0), st.floats(0.01, 0.5))
@settings(max_examples=100, deadline=None)
def test_bottom_effects_grow_steadily_towards_the_touch(gap, less):
    record, _ = pack_payload(plate(), RHO, 50.0)
    for law in (phys.felt, phys.squeeze):
        far, near = law(-50.0 + gap, record), law(-50.0 + max(gap - less, 0.0), record)
        assert 0.0 <= far <= near <= 1.0
        assert law(-50.0, record) == pytest.approx(1.0)
        assert law(-50.0 + record.gap_0, record) == pytest.approx(0.0, abs=1e-12)


# Waves


def test_a_weightless_payload_without_drag_moves_as_the_water_does():
    """Mass equal to the displaced water: Froude-Krylov force and added mass give it the water's own acceleration."""
    load = plate(C_D=0.0)
    record, rows = pack_payload(load, RHO, 1000.0)
    m = RHO * load.covered(RHO).V
    record = record._replace(m=m, W=m * G)
    omega, w_0 = 0.7, 1.2

    def sea(t, z):
        return alike(0.0, 0.0, w_0 * math.cos(omega * t), -w_0 * omega * math.sin(omega * t))

    t, _, v = simulate(-40.0, w_0, record, rows, 9.0, sea=sea, step=5e-3)
    assert v == pytest.approx(w_0 * np.cos(omega * t), abs=1e-6)


def test_a_floating_payload_rides_on_waves_that_are_long_against_it():
    A_w, H, m = 30.0, 4.0, 60e3
    record, rows = floating(A_w, H, m)
    omega, a = 0.05, 1.0

    def sea(t, z):
        s, c = math.sin(omega * t), math.cos(omega * t)
        return alike(a * s, a * omega * c, a * omega * c, -a * omega * omega * s)

    t, z, _ = simulate(-m / (RHO * A_w), a * omega, record, rows, 60.0, sea=sea, step=2e-2)
    assert z == pytest.approx(a * np.sin(omega * t) - m / (RHO * A_w), abs=5e-3)


class Part(NamedTuple):
    """A part for the quadrature by slices: `at` above the underside, `tall`; A33 [kg] and A_p [m^2] of it as far as it is wet."""

    at: float
    tall: float
    A33: float
    A_p: float


def by_slices(z, v, parts, V_per_m, tall, wave, n=4000):
    """Force of a regular deep-water wave [N] on parts under water, cut into n slices: every slice in its own water.

    Froude-Krylov force, added mass (of water that stands still: the payload is moved), and drag; V_per_m displaced volume per height at the
    heights y, wave eta, k, omega.
    """
    eta, k, omega, t = wave
    slices = (np.arange(n) + 0.5) / n

    def water(y):
        decay = np.exp(k * np.minimum(z + y, 0.0))
        return -eta * omega * math.sin(omega * t) * decay, -eta * omega**2 * math.cos(omega * t) * decay

    top = eta * math.cos(omega * t) - z
    y = slices * min(tall, top)
    inertia = float(np.mean(RHO * V_per_m(y) * water(y)[1])) * min(tall, top)
    drag = 0.0
    for p in parts:
        w, a = water(p.at + slices * min(p.tall, max(top - p.at, 0.0)))
        inertia += p.A33 * float(np.mean(a))
        drag += 0.5 * RHO * 2.5 * p.A_p * float(np.mean(np.abs(w - v) * (w - v)))
    return inertia, drag


def in_wave(z, v, record, rows, wave):
    """The same by the kernel: water at the heights that it asks for."""
    eta, k, omega, t = wave
    surface = eta * math.cos(omega * t)
    wet = wetted_at(phys.submergence(z, surface, record.reach), rows)
    decay = np.exp(k * np.array(phys.heights(z, wet)))
    a, w = -eta * omega**2 * math.cos(omega * t) * decay, -eta * omega * math.sin(omega * t) * decay
    f = phys.water_force(z, v, wet, Water(surface, 0.0, a[0], a[1], w[2], w[3], a[2], a[3]), record)
    return f.inertia, f.drag


SLICES = 0.01
"""Part of the largest force over a wave: two heights against 4,000 slices of bodies over whose height a wave decays to a fifth; measured 0.9 %
in drag, where that counts twice, and 0.1 % in inertia."""
CREST = 0.025
"""The same under a crest: water above still water moves as that at the surface, a corner that two heights do not resolve."""


@pytest.mark.parametrize("T", [5.0, 7.0, 10.0])
@pytest.mark.parametrize("z", [-12.0, -8.0, -4.0])
def test_a_tall_box_in_a_wave_is_moved_as_its_slices_are(z, T):
    """A flooded box of 10 m in its own water at every height, covered and half under water. In the water of its middle it has up to 15 % of
    the inertia force less, and 20 % of the drag."""
    load = Payload(
        name="box", mass="60 t", volume="20 m^3", shape="box", length="6 m", width="5 m", height="10 m", wall="20 mm"
    )
    record, rows = pack_payload(load, RHO, 1000.0)
    omega = 2.0 * math.pi / T
    pairs = []
    for t in np.linspace(0.0, T, 12, endpoint=False):
        wave = (1.25, omega**2 / G, omega, t)
        h = 1.25 * math.cos(omega * t) - z
        A33 = float(load.at(np.array([h]), RHO).A33[0])
        ours = in_wave(z, -0.3, record, rows, wave)
        pairs.append(
            (*ours, *by_slices(z, -0.3, [Part(0.0, 10.0, A33, 30.0)], lambda y: np.full_like(y, 2.0), 10.0, wave))
        )
    a, b, c, d = np.array(pairs).T
    most = SLICES if z < -11.25 else CREST
    assert np.abs(a - c).max() < most * np.abs(c).max()
    assert np.abs(b - d).max() < most * np.abs(d).max()


def test_every_part_of_a_template_is_in_its_own_water():
    """Anchors at the bottom carry the water inside them, a frame above them has most of the drag: neither is in the water of the middle."""
    load = read_payload("template-230t")
    record, rows = pack_payload(load, RHO, 1000.0)
    z, omega, k = -12.0, 2.0 * math.pi / 7.0, (2.0 * math.pi / 7.0) ** 2 / G
    anchor, frame = (p.shape for p in load.shape.parts)
    deep = np.array([12.0])
    parts = [
        Part(0.0, 6.0, 4.0 * float(anchor.added_mass(deep, RHO)[0]), 4.0 * anchor.solid_area),
        Part(5.0, 5.0, float(frame.added_mass(deep - 5.0, RHO)[0]), frame.solid_area),
    ]
    fine = np.linspace(0.0, 10.0, 100_001)
    V = load.at(fine, RHO).V
    per_m = np.gradient(V, fine)
    pairs = []
    for t in np.linspace(0.0, 7.0, 12, endpoint=False):
        wave = (1.25, k, omega, t)
        pairs.append(
            (
                *in_wave(z, 0.2, record, rows, wave),
                *by_slices(z, 0.2, parts, lambda y: np.interp(y, fine, per_m), 10.0, wave),
            )
        )
    a, b, c, d = np.array(pairs).T
    assert np.abs(a - c).max() < SLICES * np.abs(c).max()
    assert np.abs(b - d).max() < SLICES * np.abs(d).max()


def test_water_is_taken_at_two_heights_of_the_wet_part_and_never_above_still_water():
    """For what is spread evenly: the two points of Gauss's quadrature, in a payload that is half under water those of the wet half."""
    record, rows = pack_payload(plate(height="4 m"), RHO, 100.0)
    for z, wet in ((-2.0, 2.0), (-4.0, 4.0), (-10.0, 4.0)):
        at = phys.heights(z, wetted_at(min(-z, record.reach), rows))
        low, high = z + wet / 2.0 - wet / math.sqrt(12.0), z + wet / 2.0 + wet / math.sqrt(12.0)
        assert at == pytest.approx((low, high, low, high), rel=1e-6)
    assert phys.heights(1.0, wetted_at(0.0, rows)) == (0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("name", ["template-230t", "template-120t", "suction-anchor-85t", "spool-20t"])
def test_slamming_has_its_peak_at_the_face_that_hits_the_water(name):
    """The slope of the added mass just below each level against that of the curve: highest at a face, where it jumps."""
    load = read_payload(name)
    _, rows = pack_payload(load, RHO, 1000.0)
    h = np.linspace(0.0, load.reach(RHO), 400_001)
    steepest = np.max(np.diff(load.at(h, RHO).A33) / np.diff(h))
    slopes = rows[:, [WettedLevel._fields.index(n) for n in ("dA33", "dA33_next")]]
    assert slopes.max() == pytest.approx(steepest, rel=SLOPE)


# Energy and machine code


@pytest.mark.thorough
def test_every_joule_of_a_lowering_from_air_to_soil_is_accounted_for():
    """Weight that was lifted, energy of body and water, and the work of each force; the audit's rule for changing added mass."""
    load = plate(mass="90 t", seabed={"settlement": "0.1 m"})
    record, rows = pack_payload(load, RHO, 12.0)
    t, z, v = simulate(1.0, -1.0, record, rows, 16.0)
    parts = [force(a, b, record, rows) for a, b in zip(z, v, strict=True)]
    m_a = np.array([f.m_a for f in parts])
    work = np.array(
        [(f.buoyancy + f.inertia + f.drag + f.slam + f.bottom - record.W) * b for f, b in zip(parts, v, strict=True)]
    )
    growth = np.array(
        [mass_rate(a, b, at(a, record, rows), STILL, record) * b * b / 2.0 for a, b in zip(z, v, strict=True)]
    )
    E = 0.5 * (load.mass + m_a) * v * v
    through = np.trapezoid(np.abs(work), t)
    assert abs(E[-1] - E[0] - np.trapezoid(work + growth, t)) < ENERGY * through
    assert z[-1] == pytest.approx(-12.1, abs=1e-3)


def test_machine_code_gives_what_python_gives(numba):
    record, rows = pack_payload(plate(), RHO, 8.0)
    lo, hi, water = WettedLevel(*rows[16]), WettedLevel(*rows[17]), Water(0.3, 0.2, 0.1, -0.4, 0.5, 0.4, -0.1, 0.3)
    h = 0.7 * lo.h + 0.3 * hi.h

    @numba.njit
    def kernel(z, v):
        wet = phys.wetted(h, lo, hi)
        return (
            phys.water_force(z, v, wet, water, record),
            phys.heights(z, wet),
        )

    for z, v in ((1.0, -1.0), (-0.2, -1.0), (-2.0, 0.5), (-7.5, -0.3), (-8.05, -0.1)):
        wet = phys.wetted(h, lo, hi)
        python = (
            *phys.water_force(z, v, wet, water, record),
            *phys.heights(z, wet),
        )
        compiled = kernel(z, v)
        assert (*compiled[0], *compiled[1]) == pytest.approx(python, rel=1e-12)


def test_sixteen_payloads_side_by_side_are_vector_code(numba):
    load, put = access(Lane, VL).load, access(phys.WaterForce, VL).store

    def kernel(A, B):
        for l in range(VL):
            b = load(A, l)
            put(B, l, phys.water_force(b.z, b.v, phys.wetted(b.h, b.lo, b.hi), b.water, b.pay))

    compiled = numba.njit(nogil=True, **STRICT)(kernel)
    compiled.compile((numba.float64[::1], numba.float64[::1]))
    listing = compiled.inspect_llvm(compiled.signatures[0])
    operations = re.findall(r"= f(?:add|sub|mul|div) [^\n]*?(<\d+ x double>|double)", listing)
    scalars = operations.count("double")
    assert len(operations) - scalars > 50
    assert len(operations) - scalars >= scalars
