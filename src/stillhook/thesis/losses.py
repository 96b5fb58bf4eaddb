"""Paper A and section 2.3, paper D: torque loss of motors and friction of winches, from published parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import xarray

from stillhook.base.arrays import FloatArray
from stillhook.engine.pack.winch import wire_speed_max
from stillhook.engine.simulate import simulate
from stillhook.identify.compare import drum_torque, speeds, split
from stillhook.identify.motor.fit import CARDS, LossModel, fit_loss
from stillhook.identify.motor.map import LossMap, read_map
from stillhook.identify.motor.rank import residual_share
from stillhook.identify.system_friction.fitting.fit import predicted
from stillhook.identify.system_friction.fitting.model import Loss, Points, Y, loss_of, system_friction
from stillhook.library import load_crane, load_friction, motor
from stillhook.library import system_friction as library_friction
from stillhook.library.examples import MOTOR_MAP
from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, Scenario
from stillhook.thesis.gallery import Axis, Curve, Drawing, Panel, Printed, Table, over_time
from stillhook.units import from_display

CC, RPM, BAR = (from_display(1.0, kind) for kind in ("displacement", "rotation", "pressure"))
TERMS = {"X_1": "viscous", "X_2": "turbulent", "X_3": "in proportion to Δp D", "X_4": "Coulomb", "X_5": "Δp²"}
SPEED, TORQUE = Axis("motor speed", "rotation"), Axis("torque loss", "torque")
SYNTHETIC = "SYNTHETIC map of the library: published parameters and assumed extra losses, measured on no motor."
FIRST, SECOND = "A6VM215", "A6VM215-crane-2-second-loop"
POINTS = ((215.0, 130.0), (145.0, 130.0), (70.0, 275.0))
"""Displacement [cm^3/rev] and pressure drop [bar] at which the two loops of paper D are compared."""
TESTS: Mapping[str, tuple[str, Sequence[tuple[float, float]]]] = {
    "L4593": (
        "nov-100t-pure-active",
        [(D / 6.0, m) for m in (0.0, 55.0, 100.0) for D in (720, 960, 1120, 1290) if m < 100.0 or D > 1000],
    ),
    "crane-2": ("nov-150t", [*((D, m) for D in (215.0, 164.0) for m in (0.0, 77.0, 107.0)), (200.0, 0.0)]),
}
"""By friction set: crane, displacement of one motor [cm^3/rev] and load [t] of tests: table 2.3, paper D table 2."""
STYLES = {0.0: ":", 55.0: "--", 77.0: "--", 100.0: "-", 107.0: "-"}
"""Lines by load [t]."""


def loss_parameters(name: str) -> TorqueLossFit:
    """MJ4 of a motor of the library."""
    return TorqueLossFit(*(getattr(motor(name).loss, f) for f in TorqueLossFit._fields))


def terms_of(name: str) -> dict[str, TorqueLossFit]:
    """MJ4 with one of its terms alone, by parameter."""
    fit = loss_parameters(name)
    return {k: TorqueLossFit(**{f: getattr(fit, f) if f == k else 0.0 for f in TorqueLossFit._fields}) for k in TERMS}


def term_shares(name: str, D: float) -> dict[str, float]:
    """Share of each term of MJ4 over 300 to 2500 rev/min in steps of 10 at 200 bar (A 20) [-]; D [cm^3/rev]."""
    n = np.arange(300.0, 2501.0, 10.0) * RPM
    sums = {k: float(np.sum(torque_loss(n, D * CC, 200.0 * BAR, one) + 0.0 * n)) for k, one in terms_of(name).items()}
    return {k: s / sum(sums.values()) for k, s in sums.items()}


def shares() -> Drawing:
    """Terms of MJ4 as parts of the loss (A6)."""
    of = term_shares("A6VM280", 250.0)
    largest = sorted(of, key=lambda k: -of[k])[:2]
    rows = [(TERMS[k], s) for k, s in of.items()]
    return Drawing(
        "A6VM280, 250 cm³/rev, 200 bar, 300 to 2500 rev/min: terms of MJ4",
        tables={"data": Table(("term", "share [-]"), rows)},
        printed=[Printed("largest terms", "turbulent and Coulomb", " and ".join(TERMS[k] for k in largest))],
        note="Ours: MJ4 alone; parameters of MJ5 and MJ6 are not printed.",
    )


def terms() -> Drawing:
    """Terms of MJ4 over speed (A7)."""
    n = np.linspace(300.0, 2500.0, 100) * RPM
    of = {k: torque_loss(n, 250.0 * CC, 200.0 * BAR, one) + 0.0 * n for k, one in terms_of("A6VM280").items()}
    curves = [Curve(TERMS[k], n, y) for k, y in of.items()]
    return Drawing("Terms of the published MJ4, A6VM280, 250 cm³/rev, 200 bar", [Panel(SPEED, TORQUE, curves)])


def motor_loss() -> Drawing:
    """MJ4 of the A6VM215 over speed by displacement, 200 bar (2.11, D3)."""
    n, fit = np.linspace(0.0, 2500.0, 126) * RPM, loss_parameters(FIRST)
    of = {D: torque_loss(n, D * CC, 200.0 * BAR, fit) + 0.0 * n for D in (215.0, 172.0, 129.0, 86.0, 43.0)}
    panel = Panel(SPEED, TORQUE, [Curve(f"{D:g} cm³/rev", n, y) for D, y in of.items()])
    return Drawing("A6VM215 at 200 bar: the published MJ4", [panel], note="Ours: pressure taken.")


@cache
def example_map() -> LossMap:
    """The library's example of a supplier's map."""
    return read_map(MOTOR_MAP)


def loss_models() -> Drawing:
    """Models of the torque loss with year and number of parameters (T1.2, AT1)."""
    rows = [(c.title, c.author, c.year, len(c.names), "yes" if c.sees_displacement else "no") for c in CARDS.values()]
    head = ("model", "author", "year", "parameters", "considers displacement")
    return Drawing("Torque-loss models of stillhook identify motor", tables={"data": Table(head, rows)})


def model_errors(at: str) -> Drawing:
    """Error of every model fitted to a map: full displacement alone (A3), or the whole map (A4, A5, A10)."""
    m = example_map().full() if at == "full" else example_map()
    rows = sorted(((CARDS[model].title, fit_loss(m, model).rms_share) for model in LossModel), key=lambda r: r[1])
    printed = "Ortwig and Jeong well below the older ones" if at == "full" else "MJ4, MJ5 and MJ6"
    return Drawing(
        "Error of the models over the mean nominal torque",
        tables={"data": Table(("model", "rms error [-]"), rows)},
        printed=[Printed("smallest errors", printed, ", ".join(r[0] for r in rows[:3]))],
        note=SYNTHETIC,
    )


def model_residuals(low: str, high: str) -> Drawing:
    """Error of MJ4 against a map over speed, at displacements between two parts of the full one (A8 above 150 of
    280 cm^3/rev, A9 below)."""
    m = example_map()
    error, curves = residual_share(m, fit_loss(m, LossModel.MJ4)), []
    for D in sorted({round(float(x) / CC, 1) for x in m.D_m / 1.0}, reverse=True):
        at = (np.abs(m.D_m / CC - D) < 0.06) & (np.round(m.dp_m / BAR) == 200)
        if float(low) <= D * CC / m.D_max <= float(high):
            curves.append(Curve(f"{D:g} cm³/rev", m.omega_m[at], error[at], "o-"))
    within = 100.0 * max(float(np.abs(c.y).max()) for c in curves)
    return Drawing(
        "Map less MJ4 at 200 bar, over nominal torque",
        [Panel(SPEED, Axis("error over nominal torque"), curves)],
        printed=[
            Printed("largest error", "1 %" if float(high) > 1.0 else "less accurate than above", f"{within:.1f} %")
        ],
        note=SYNTHETIC,
    )


def staged(at: Points, loss: Loss, y: Y, crane: Crane) -> Points:
    """What motors and winch of known friction give at the speeds, displacements and loads of these points: the torque
    balance, solved."""
    dp_L = at.T_d / crane.i_hD / (at.count * at.D_m)
    found = []
    for sign in (1.0, -1.0):
        dp = dp_L
        for _ in range(40):  # the loss changes by a few per cent of the pressure's change: 40 rounds leave nothing
            dp = dp_L + sign * (loss(at.omega, at.D_m, dp) + system_friction(at.omega, at.T_d, y)) / at.D_m
        found.append(dp)
    return replace(at, omega_up=at.omega, omega_down=at.omega, dp_up=found[0], dp_down=found[1], u_dp=np.zeros(len(at)))


def friction_of_tests(name: str, part: str) -> Drawing:
    """Friction of the tests by the published models: of motors and winch, the total a motor or of all (2.12, D7, D16),
    or of the winch alone (2.13)."""
    crane_name, tests = TESTS[name]
    crane, y = load_crane(crane_name), Y.of(library_friction(name))
    n, loss, curves = np.linspace(25.0, 1500.0, 60) * RPM, loss_of(motor(FIRST)), []
    count = crane.active.motor.count + (crane.passive.motor.count if crane.passive else 0)
    for D, load in tests:
        T_d = drum_torque(crane, 1e3 * load)
        if part == "system":
            torque: FloatArray = np.asarray(system_friction(n, np.full_like(n, T_d), y))
        else:
            at = staged(Points.planned(n, T_d, D * CC, count=float(count)), loss, y, crane)
            torque = predicted(at, loss, y) * (count if part == "all" else 1)
        curves.append(Curve(f"{D:.0f} cm³/rev, {load:.0f} t", n, torque, STYLES[load]))
    words = {"system": "system friction a motor", "all": "friction of all motors"}.get(part, "friction a motor")
    return Drawing(
        f"{crane.name}: friction of {name} in the published tests",
        [Panel(SPEED, Axis(words, "torque"), curves)],
        note="Ours: the published models; measured points are not printed.",
    )


def two_cranes() -> Drawing:
    """System friction of cranes 1 and 2 at 100 t by its parts (D8)."""
    crane, curves = load_crane("nov-150t"), []
    for name in ("crane-1", "crane-2"):
        s = split(load_friction(name), drum_torque(crane, 100e3), speeds())
        for part, style in (("total", "-"), ("stiction", "--"), ("Coulomb", "-."), ("viscous", ":")):
            curves.append(Curve(f"{name.replace('-', ' ')}, {part}", s.omega, np.asarray(s.part(part)), style))
    title = "System friction a motor at 100 t, outermost layer"
    return Drawing(title, [Panel(SPEED, Axis("friction torque", "torque"), curves)])


def two_loops() -> Drawing:
    """Motor loss before and after the second loop (D10)."""
    n, curves = np.linspace(0.0, 2000.0, 100) * RPM, []
    for D, dp in POINTS:
        for name, words, style in ((FIRST, "first loop", "-"), (SECOND, "second loop", "--")):
            loss = loss_of(motor(name))
            y = np.asarray(loss(n, np.full_like(n, D * CC), np.full_like(n, dp * BAR)))
            curves.append(Curve(f"{D:.0f} cm³/rev at {dp:.0f} bar, {words}", n, y, style))
    return Drawing("Motor loss before and after the second loop", [Panel(SPEED, TORQUE, curves)])


STAIRS = [k * 0.1 for k in range(1, 10)]
"""Pump command of the steps of a friction test [-]."""
STAIR, BETWEEN = 12.0, 4.0
"""Time of a step, and at rest before it [s]."""


def _staircase(v_max: float) -> list[tuple[float, float]]:
    """Time [s] and wire speed [m/s] at the corners of a friction test: hoisting and lowering in turn, faster and
    faster."""
    corners, t = [(0.0, 0.0)], 0.0
    for k in STAIRS:
        for sign in (1.0, -1.0):
            for wait, v in ((BETWEEN, 0.0), (1.0, sign * k * v_max), (STAIR, sign * k * v_max), (1.0, 0.0)):
                t += wait
                corners.append((t, v))
    return corners


def staircase() -> Drawing:
    """Pump command of a friction test (2.5, D6)."""
    corners = np.array(_staircase(1.0)).T
    panel = Panel(Axis("time", "time"), Axis("pump command"), [Curve("command", corners[0], corners[1])])
    return Drawing("Shape of a friction test", [panel], note="Ours: heights and times of the steps are not printed.")


@cache
def _run_3() -> xarray.Dataset:
    """Test 3 of paper D in the twin: 107 t, motors full."""
    crane = load_crane("nov-150t")
    profile = tuple((f"{t:g} s", f"{v:.6f} m/s") for t, v in _staircase(0.9 * wire_speed_max(crane)))
    case = Scenario(
        load="107 t",
        s_w="100 m",
        mode="manual",
        operator=Operator(profile=profile, alpha_m=1.0),
        duration=f"{_staircase(1.0)[-1][0]:g} s",
        warm_up="1 s",
    )
    return simulate(crane, case, every="0.1 s")


def third_test(shown: str) -> Drawing:
    """Pressure drop across the active motors, or wire speed, in test 3 (D18, D19)."""
    run = _run_3()
    if shown == "v_w":
        panel = over_time({"twin": run}, ("v_w",), 0.0, float(run["time"][-1]))
    else:
        y = np.asarray((run["p_a"] - run["p_b"]).values)
        curve = Curve("twin", run["time"].values, y)
        panel = Panel(Axis("time", "time"), Axis("pressure drop across the motors", "pressure"), [curve])
    note = "Ours: the staircase is not printed; the passive motors carry the load, as in the twin's manual mode."
    return Drawing("nov-150t, 107 t, motors at 215 cm³/rev: a friction test in the twin", [panel], note=note)
