"""The linear form of a passive heave compensator against the running lowering, and its closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.engine.lowering.summary import LoweringRun
from stillhook.engine.simulate import run_cases, unchanged
from stillhook.physics.scalar import G
from stillhook.response.forcing import Forcing
from stillhook.response.frequency_domain import compensated_sigmas, sigmas
from stillhook.response.suspended_load import linear_joint, natural_periods, suspended_load, transfers
from stillhook.response.winch.linear_form import Residual
from stillhook.sea.motion.irregular import IrregularTip
from stillhook.sea.motion.motion import Motion, Sine, Still
from stillhook.spec.lift.lowering import Lowering, Rigging
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.winches.load_path.gas_spring import Compensator

SMALL = 3e-3
"""Of an amplitude at 5 mm: brake, drag at that speed and the wire's elements."""
GAUSSIAN = 0.05
"""Of a deviation: one motion of 20 minutes, and the orifice as linear damper of a Gaussian speed; measured 4 %."""
SEALS = 0.15
"""The same with seals that hold as much as the swing pulls: a rod that sticks and slips is not
Gaussian; measured 8 % of the stroke, 12 % of the load."""
BRAKE = Residual.constant(1.0, "winch on its brake")
Z = -120.0


def unit(**changes: object) -> Compensator:
    given = {"stroke": "4 m", "area": "0.09 m^2", "p_0": "80 bar", "V_0": "1.35 m^3", "length": "7 m"}
    return Compensator(**{**given, "mass_cylinder": "8 t", "mass_rod": "2 t", **changes})


def box() -> Payload:
    levels = tuple(
        {"h": f"{h} m", "V": f"{V} m^3", "A33": f"{A} t", "A_p": f"{S} m^2"}
        for h, V, A, S in ((0, 0, 0, 0), (5, 10, 40, 20))
    )
    return Payload(name="box", mass="100 t", height="5 m", C_D=1.0, levels=levels)


def lift(tip: Motion, link: Compensator | None, duration: str = "300 s") -> Lowering:
    return Lowering(
        payload=box(), tip=tip, h_tip="40 m", depth="600 m", start_depth=f"{-Z} m", programme=(Phase(mode="manual", time="9000 s"),),
        duration=duration, ramp="20 s", rigging=Rigging(), compensator=link,
    )  # fmt: skip


def run(case: Lowering) -> LoweringRun:
    return run_cases(load_crane("nov-250t"), [case], step=2, lanes=1, every=2, keep=unchanged)[0]


@pytest.mark.slow
@pytest.mark.parametrize("period", [5.0, 12.0])
def test_linear_form_is_the_twin_at_small_amplitude(period: float) -> None:
    """Payload and force on the rod per tip motion, the winch on its brake."""
    omega, link = 2.0 * math.pi / period, unit(rod_area="0.01 m^2")
    case = lift(Sine(amplitude="5 mm", period=f"{period} s"), link)
    load = suspended_load(load_crane("nov-250t"), case, Z)
    t = transfers(np.array([omega]), load.rod, load.end)
    r = run(case)
    assert r.series is not None
    rows = r.series[r.series.shape[0] // 2 :]
    time, own = r.dt * np.arange(len(rows)), 2.0 * math.pi / float(natural_periods(load.rod, load.end, 1)[0])
    waves = [f(w * time) for w in (omega, own) for f in (np.cos, np.sin)]
    base = np.stack([np.ones_like(time), time, *waves], axis=1)

    def amplitude(name: str) -> float:
        x = np.linalg.lstsq(base, rows[:, r.signals.index(name)], rcond=None)[0]
        return math.hypot(x[2], x[3])

    tip = amplitude("s_tip")
    assert amplitude("s_load") / tip == pytest.approx(float(abs(t.load_u[0])), rel=SMALL)
    assert amplitude("F_sling") / tip == pytest.approx(float(abs(t.sling_u[0])), rel=SMALL)


SOFT = {"V_0": "4 m^3", "p_0": "94 bar"}
"""A unit of 12.9 s under this load."""


def irregular(sigma: float) -> tuple[IrregularTip, Forcing]:
    """A tip that moves at random with this deviation [m] about 8 s, and the same as a forcing."""
    length = 1200.0
    k = np.arange(1, 400)
    omega = 2.0 * math.pi / length * k
    S = np.exp(-0.5 * ((omega - 0.8) / 0.12) ** 2)
    S *= sigma**2 / S.sum()
    phases = np.random.default_rng(3).random(len(k))
    tip = IrregularTip(np.concatenate(([0.0], np.sqrt(2.0 * S) * np.exp(2j * math.pi * phases))), length)
    none = np.zeros((1, len(k)))
    return tip, Forcing(omega, np.full(len(k), omega[0]), S[None, :], none, none.astype(complex))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("link", "within"),
    [
        (unit(**SOFT), GAUSSIAN),
        (unit(**SOFT, orifice="200 kN s^2/m^2"), GAUSSIAN),
        (unit(**SOFT, friction="20 kN"), SEALS),
    ],
    ids=["gas", "orifice", "seals"],
)
def test_deviations_of_stroke_and_load_are_those_of_the_twin(link: Compensator, within: float) -> None:
    tip, forcing = irregular(0.25)
    case = lift(tip, link, "1200 s")
    load = suspended_load(load_crane("nov-250t"), case, Z)
    s, way = compensated_sigmas(forcing, load, BRAKE)
    assert way is not None
    r = run(case)
    assert r.series is not None
    rows = r.series[r.series.shape[0] // 20 :]
    for name, theirs in (("s_c", way.stroke), ("s_load", s.load), ("F_sling", s.sling)):
        assert float(np.std(rows[:, r.signals.index(name)])) == pytest.approx(float(theirs[0]), rel=within)


def test_seals_hold_the_rod_in_a_small_sea_and_slings_alone_are_left() -> None:
    """The thesis's main problem of passive compensation: what moves less than the seals hold is not compensated."""
    case = lift(Still(), unit(**SOFT, friction="30 kN", v_friction="0.1 mm/s"))
    crane = load_crane("nov-250t")
    small, large = (irregular(sigma)[1] for sigma in (0.005, 0.8))
    load, without = suspended_load(crane, case, Z), suspended_load(crane, lift(Still(), None), Z)
    held, moved = compensated_sigmas(small, load, BRAKE), compensated_sigmas(large, load, BRAKE)
    plain_small, plain_large = sigmas(small, without, BRAKE), sigmas(large, without, BRAKE)
    assert held[1] is not None
    assert held[1].stroke[0] < 0.1 * held[0].load[0]
    assert held[0].load[0] == pytest.approx(plain_small.load[0], rel=0.1)
    assert moved[0].sling[0] < 0.7 * plain_large.sling[0]


def test_natural_period_is_that_of_the_gas_spring() -> None:
    """T_n = 2 pi sqrt((m + m_A)/k), k = n p A^2/V in series with the wire; the wire gives way by a per cent."""
    load = suspended_load(load_crane("nov-250t"), lift(Still(), unit()), Z)
    assert load.link is not None
    T = float(natural_periods(load.rod, load.end, 1)[0])
    assert T == pytest.approx(2.0 * math.pi * math.sqrt((102e3 + 40e3) / load.link.k), rel=0.02)
    assert load.F_sling == pytest.approx((102e3 - 1025.0 * 10.0) * G, rel=1e-9)


def test_at_an_end_of_its_stroke_the_slings_are_left() -> None:
    case = lift(Still(), unit(p_0="150 bar"))
    load = suspended_load(load_crane("nov-250t"), case, Z)
    link = linear_joint(case, Z)
    assert link is not None
    assert not link.moves
    assert load.end.k_s == case.rigging.stiffness
    assert compensated_sigmas(irregular(0.3)[1], load, BRAKE)[1] is None


def test_orifice_and_seals_take_the_power_that_a_gaussian_speed_gives_them() -> None:
    """c sigma^2 = E[C |v|^3] and E[F_f |v|]."""
    v = np.random.default_rng(1).normal(0.0, 0.4, 400_000)
    case = lift(Still(), unit(orifice="50 kN s^2/m^2"))
    link = linear_joint(case, Z)
    assert link is not None
    assert link.damping(0.4) * 0.4**2 == pytest.approx(50e3 * np.mean(np.abs(v) ** 3), rel=0.01)
    seals = replace(link, C=0.0, F_f=20e3)
    assert seals.damping(0.4) * 0.4**2 == pytest.approx(20e3 * np.mean(np.abs(v)), rel=0.01)
