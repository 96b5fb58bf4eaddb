"""What holds for every winch type beside the closed circuits, whose tests are in tests/engine and tests/conservation: no
joule is lost unseen, what is passed is named, one lane of sixteen is a run alone, a finer step and C give the same."""

import ctypes
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.ctypeslib import ndpointer
from tests.engine.runs import run_many, run_one
from tests.engine.test_c99 import SAME, compile_c

from stillhook import Scenario, load_crane, simulate
from stillhook.engine.pack.winch import pack
from stillhook.engine.scenario.run import Ready, ScenarioBlock
from stillhook.engine.scenario.summary import limits_passed
from stillhook.errors import StillhookError
from stillhook.kernels.c99 import library as native
from stillhook.kernels.c99.source import Translator, entry_types
from stillhook.kernels.lanes import VL, flatten
from stillhook.library import changed
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Operator, PowerLoss

INTERPRETED = 1.0e-9
"""Relative: exp of the kernels differs from the library's in the last digits."""
JUMP = 10.0
"""Times the audit of a run whose flow is taken away within a cycle: powers are sampled once per cycle, 4e-4 at 20 ms, 2e-4 at
10 ms, 4e-5 at 2 ms."""


class Winch(NamedTuple):
    """A crane of a type, and the run that it is tried with."""

    crane: Crane
    case: dict[str, Any]
    loads: tuple[int, int]  # first and step over sixteen lanes [t]
    audit: float  # energy that may be missing, of that through the winch; the specification asks for 1e-3
    finer: float  # wire that a finer step may change [m]
    losses: tuple[str, ...]  # powers that are never negative


WINCHES = {
    "cylinder": Winch(
        load_crane("nov-100t-cylinder"),
        {"load": "50 t", "s_w": "100 m", "tip": "sine 1 m 10 s", "duration": "60 s", "warm_up": "20 s"},
        (5, 5),
        1.0e-3,  # powers are summed once per PLC cycle
        1.0e-4,
        ("friction", "leakage", "relief", "flushing", "cushion", "piston"),
    ),
    "electric": Winch(
        load_crane("nov-100t-electric"),
        {"load": "47 t", "s_w": "200 m", "tip": "sine 1 m 10 s", "duration": "100 s", "warm_up": "40 s"},
        (10, 5),
        3.0e-4,  # by trapezoids over 10 ms; 5e-4 where a brake slips
        1.0e-4,
        ("copper", "iron", "inverter", "store", "resistor", "friction"),
    ),
    "open-circuit": Winch(
        load_crane("utility-20t-open-circuit"),
        {"load": "10 t", "s_w": "100 m", "tip": "sine 1 m 10 s", "duration": "60 s", "warm_up": "20 s"},
        (1, 1),
        1.0e-4,
        1.0e-3,  # a fortieth of the error of compensation
        ("friction", "valve", "counterbalance", "leakage", "relief"),
    ),
    "secondary": Winch(
        load_crane("nov-250t-secondary"),
        {"load": "125 t", "s_w": "200 m", "tip": "sine 1 m 10 s", "duration": "60 s", "warm_up": "30 s"},
        (10, 14),
        1.0e-4,  # the worst seen is 2e-5
        1.0e-4,
        ("friction", "leakage", "relief", "piston"),
    ),
}
WINCHES["digital"] = WINCHES["secondary"]._replace(crane=load_crane("nov-250t-digital"))
every_winch = pytest.mark.parametrize("name", WINCHES)


def scenario(name: str, case: dict[str, Any]) -> Scenario:
    return Scenario(**({"mode": "position"} | WINCHES[name].case | case))


def profile(*points: tuple[int, str]) -> Operator:
    """Speeds of the operator at times [s]."""
    return Operator(profile=tuple((f"{t} s", v) for t, v in points))


def driven(speed: str, duration: int = 60) -> dict[str, Any]:
    """A steady wire speed by the operator over still water."""
    operator = profile((0, "0 m/min"), (5, speed), (duration, speed))
    return {"mode": "manual", "tip": "still", "operator": operator, "duration": f"{duration} s"}


def moves(speed: str) -> dict[str, Any]:
    """A speed of the operator from 10 s on, and a stop."""
    operator = profile((0, "0 m/min"), (10, speed), (100, speed), (105, "0 m/min"))
    return driven(speed, 110) | {"operator": operator, "s_w": "400 m", "warm_up": "0 s"}


HOISTING = {"operator": profile((0, "0 m/min"), (10, "20 m/min"), (50, "20 m/min"), (55, "0 m/min")), "s_w": "200 m"}
UNEQUAL = {"cylinder": {"A_b": "270 cm^2"}}
ENERGY: dict[str, dict[str, Any]] = {
    "cylinder": {
        "wave": {},
        "operator": HOISTING,
        "manual": HOISTING | {"mode": "manual", "tip": "still"},
        "ends": {"tip": "sine 4 m 40 s", "duration": "120 s"},
        "saturated": {"tip": "sine 2 m 9 s"},
        "regularised": {"friction": "regularised"},
        "modes": {"mode": "manual", "modes": (("20 s", "position"), ("45 s", "manual"))},
        "unequal areas": {},
    },
    "electric": {
        "wave": {},
        "saturated": {"load": "97 t", "tip": "sine 1.5 m 8 s"},
        "large": {"tip": "sine 3 m 10 s"},
        "empty": {"load": "0 t"},
        "regularised": {"friction": "regularised"},
        "hoisting": driven("0.8 m/s"),
        "lowering": driven("-0.8 m/s"),
        "modes": {"modes": (("50 s", "manual"), ("70 s", "position"))},
    },
    "open-circuit": {
        "wave": {},
        "empty": {"load": "0 t"},
        "slack": {"load": "2 t", "tip": "sine 3.5 m 9 s"},
        "heavy": {"load": "20 t", "tip": "sine 1.5 m 9 s"},
        "regularised": {"friction": "regularised"},
        "unit lost": {"power_loss": PowerLoss(time="30 s", unit=2)},
        "lowering": driven("-20 m/min") | {"tip": "sine 1 m 10 s"},
        "hoisting": driven("20 m/min") | {"tip": "sine 1 m 10 s"},
    },
    "secondary": {
        "half": {},
        "overload": {"load": "250 t", "tip": "sine 3 m 8 s"},
        "hook": {"load": "0 t"},
        "lowering": moves("-20 m/min"),
        "emptied": moves("55 m/min"),
        "overfilled": moves("-55 m/min"),
        "unit lost": {"power_loss": PowerLoss(time="40 s", unit=3)},
        "regularised": {"friction": "regularised"},
        "gas held": {"gas_held": True},
    },
}
ENERGY["digital"] = ENERGY["secondary"]


@pytest.mark.parametrize(("name", "run"), [(name, run) for name, runs in ENERGY.items() for run in runs])
def test_no_energy_is_lost_unseen(name: str, run: str) -> None:
    winch, case = WINCHES[name], ENERGY[name][run]
    crane = changed(winch.crane, UNEQUAL) if run == "unequal areas" else winch.crane
    result = run_one(crane, scenario(name, case), n_sub=5, every=0)
    jump = JUMP if (name, run) == ("open-circuit", "unit lost") else 1.0
    assert abs(result.energy_unaccounted) < winch.audit * jump
    for loss in winch.losses:
        assert getattr(result.stats.power, loss) >= 0.0, loss


@every_winch
def test_a_metre_of_wave_at_half_the_load_passes_no_limit(name: str) -> None:
    run = simulate(WINCHES[name].crane, scenario(name, {}))
    assert run.status.item() == "ok"
    assert float(run.eta_c) > 0.96


def table(name: str, **tables: dict[str, Any]) -> dict[str, Any]:
    return {name: tables}


SUPERSONIC = table("electric", motor={"n_max": "2000 rev/min"})
NO_BACK = table("electric", supply={"P_back": "0 kW", "P_resistor": "50 kW", "P_rated": "25 kW"})
LIMITS: list[tuple[str, str, dict[str, Any], dict[str, Any]]] = [
    ("cylinder", "cylinder stroke", {}, {"tip": "sine 4 m 40 s"}),
    ("cylinder", "pump flow", {}, {"tip": "sine 2 m 9 s"}),
    ("cylinder", "rod speed", {"cylinder": {"v_max": "0.2 m/s"}}, {}),
    (
        "cylinder",
        "relief",
        table("cylinder", passive={"p_min": "60 bar", "accumulator": {"gas": {"p_0": "60 bar"}}}),
        {"load": "95 t"},
    ),
    (
        "cylinder",
        "accumulator",
        table("cylinder", passive={"accumulator": {"V_stroke": "241.3 L"}}),
        {"tip": "sine 4 m 40 s"},
    ),
    ("cylinder", "power", {"hpu": {"P_max": "15 kW", "P_back": "0 kW"}}, {}),
    ("cylinder", "boost", table("cylinder", boost={"Q_max": "2 L/min"}), {}),
    ("cylinder", "cavitation", table("cylinder", boost={"Q_max": "0.1 L/min"}), {"duration": "120 s"}),
    ("cylinder", "brake", {"brake": {"T": "5.57 kN m"}}, {"load": "100 t", "tip": "sine 1.2 m 8 s"}),
    ("cylinder", "winch speed", {}, {"operator": profile((0, "0 m/min"), (20, "-55 m/min"))}),
    (
        "electric",
        "torque",
        table("electric", motor={"T_max": "1150 N m"}),
        {"load": "97 t", "tip": "sine 1.4 m 8 s"},
    ),
    ("electric", "power", table("electric", motor={"P_max": "110 kW"}), {"load": "97 t"}),
    ("electric", "overspeed", SUPERSONIC, {"tip": "sine 3 m 10 s"}),
    ("electric", "store full", NO_BACK, {"load": "80 t", "warm_up": "5 s"} | driven("-0.5 m/s")),
    ("electric", "store current", table("electric", store={"I_max": "300 A"}), {}),
    (
        "electric",
        "store temperature",
        table("electric", store={"theta_max": "26 degC"}),
        {"load": "97 t", "tip": "sine 1.5 m 10 s"},
    ),
    (
        "electric",
        "undervoltage",
        table("electric", supply={"P_max": "1 kW"}, store={"C": "0.5 F"}),
        {"load": "0 t", "tip": "still", "mode": "manual"},
    ),
    ("open-circuit", "flow", {}, {"tip": "sine 1.3 m 9 s"}),
    ("open-circuit", "power", table("open", drive={"share": 0.9}), {"load": "19 t", "tip": "sine 1.2 m 10 s"}),
    ("open-circuit", "valve", table("open", valve={"Q_N": "80 L/min"}), {}),
    ("open-circuit", "relief", table("open", relief={"p": "140 bar"}, counterbalance={"p_crack": "130 bar"}), {}),
    ("open-circuit", "overspeed", table("open", motor={"n_max_full": "1000 rev/min"}), {}),
    (
        "open-circuit",  # a counterbalance valve set below the load lets it run away, and nothing fills the other line
        "cavitation",
        table(
            "open",
            counterbalance={"p_crack": "20 bar", "dp_open": "20 bar"},
            tank={"conductance": "0 L/min/bar"},
            pump={"p_standby": "20 bar"},
        ),
        {},
    ),
    ("secondary", "torque", {}, {"load": "250 t", "tip": "sine 4 m 8 s"}),
    ("secondary", "overspeed", {}, {"tip": "sine 4 m 8 s"}),
    *(("secondary", limit, {}, moves("55 m/min")) for limit in ("power", "rail pressure", "accumulator")),
    ("secondary", "relief", {}, moves("-55 m/min")),
    (
        "secondary",
        "cavitation",
        {},
        {"load": "200 t", "tip": "sine 4 m 12 s", "s_w": "100 m", "ramp": "0 s", "warm_up": "0 s"},
    ),
    ("secondary", "brake", {}, moves("0 m/min") | {"tip": "sine 4 m 4.5 s", "load": "250 t"}),
]
SLOWER = {"secondary": {"unit": {"n_max_full": "1810 rev/min"}}}
LIMITS += [
    ("digital", limit, SLOWER if limit == "overspeed" else changes, case)
    for name, limit, changes, case in LIMITS
    if name == "secondary"
]
BESIDE = {
    "electric": {"saturated", "overspeed", "power", "store empty", "brake slipping"},
}
"""What else a run of `LIMITS` may pass, where nothing else may."""
ELSEWHERE = {
    "electric": {"temperature", "store empty", "resistor temperature", "overvoltage", "brake slipping"},
    "open-circuit": {"brake"},
}
"""Limits that tests of the type itself pass."""


@pytest.mark.parametrize(("name", "limit", "changes", "case"), LIMITS, ids=[f"{n}-{i}" for n, i, *_ in LIMITS])
def test_what_is_passed_is_named(name: str, limit: str, changes: dict[str, Any], case: dict[str, Any]) -> None:
    crane = changed(WINCHES[name].crane, changes)
    passed = set(limits_passed(crane.plant.type, run_one(crane, scenario(name, case), n_sub=5, every=0).stats))
    assert limit in passed
    assert passed <= {limit} | BESIDE.get(name, passed)


@every_winch
def test_every_limit_has_a_run_that_passes_it(name: str) -> None:
    here = {limit for each, limit, *_ in LIMITS if each == name} | ELSEWHERE.get(name, set())
    assert here == set(WINCHES[name].crane.plant.type.causes.values())


def mixed(name: str, n: int = VL) -> list[Scenario]:
    """Cases that differ in load and motion."""
    first, step = WINCHES[name].loads
    short = {"duration": "40 s", "warm_up": "10 s"}
    return [
        scenario(name, short | {"load": f"{first + step * i} t", "tip": f"sine {0.3 + 0.08 * i:.2f} m {7 + i % 5} s"})
        for i in range(n)
    ]


@pytest.mark.slow
@every_winch
def test_sixteen_lanes_give_the_bits_of_one(name: str) -> None:
    crane, cases = WINCHES[name].crane, mixed(name)
    together = run_many(crane, cases, n_sub=2)
    for i in (0, 7, 15):
        alone = run_one(crane, cases[i], n_sub=2, every=0)
        assert flatten(alone.stats) == flatten(together[i].stats)
        assert alone.state == together[i].state


@every_winch
def test_a_finer_step_gives_the_same(name: str) -> None:
    winch = WINCHES[name]
    coarse, fine = (run_one(winch.crane, scenario(name, {}), n_sub=n).column("s_w") for n in (2, 20))
    assert np.max(np.abs(coarse - fine)) < winch.finer


def series(name: str, cases: list[Scenario], other: Callable[[Any], Any] | None = None) -> np.ndarray:
    """Time series of cases side by side, by another kernel than that of a driver where one is named."""
    ready = [Ready.of(WINCHES[name].crane, case) for case in cases]
    block = ScenarioBlock(ready, lanes=len(cases), n_sub=2, every=1)
    if other is not None:
        block.d = replace(block.d, run=other(block.d))
    for _ in block.steps():
        pass
    return np.asarray(block.out)


def differ(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest difference, relative to the largest value of each signal."""
    return float(np.max(np.abs(theirs - ours) / np.maximum(np.max(np.abs(ours), axis=0), 1e-6)))


@every_winch
def test_compiled_physics_is_the_physics_that_python_runs(name: str) -> None:
    case = scenario(name, {"duration": "0.5 s", "warm_up": "0.1 s", "ramp": "0.2 s"})
    compiled = series(name, [case])
    assert differ(series(name, [case], lambda d: d.run.py_func), compiled) < INTERPRETED


@pytest.mark.thorough
@pytest.mark.parametrize("lanes", [1, VL])
@every_winch
def test_c_runs_the_same_physics(name: str, lanes: int, tmp_path: Path) -> None:
    def in_c(d: Any) -> Any:
        translator = Translator()
        translator.function(d.run, entry_types(d.run), export="run")
        run = compile_c(translator.source(), tmp_path).run
        array, n = ndpointer(np.float64, flags="C_CONTIGUOUS"), ctypes.c_int64
        run.argtypes, run.restype = [array, array, n, array, array, array, *[n] * 7, ctypes.c_double], None
        return run

    cases = mixed(name, lanes)
    assert differ(series(name, cases), series(name, cases, in_c)) < SAME


@pytest.mark.thorough
@pytest.mark.skipif(native.compiler() is None, reason="Zig is not installed (extra native), or left out")
@every_winch
@pytest.mark.usefixtures("numba")
def test_compiled_c_and_numba_agree_to_the_bit(name: str) -> None:
    cases = mixed(name, 1)
    np.testing.assert_array_equal(series(name, cases), series(name, cases, lambda d: d.run.other()))


@pytest.mark.parametrize(("name", "top"), [("open-circuit", 25), ("secondary", 300), ("electric", 120)])
def test_more_load_is_never_faster(name: str, top: int) -> None:
    crane = WINCHES[name].crane
    winch, p = crane.plant.type, pack(crane, scenario(name, {})).params
    geo = winch.module.geometry(p.hoist.s_w_0, p)
    for lowering in (False,) if name == "open-circuit" else (False, True):
        speeds = [winch.speed_limit(p, geo, top * k * 980.665, lowering)[0] for k in range(11)]
        assert all(a >= b for a, b in pairwise(speeds))


PURE, CYLINDER, ELECTRIC = (f"nov-100t-{kind}" for kind in ("pure-active", "cylinder", "electric"))
OPEN, SECONDARY = "utility-20t-open-circuit", "nov-250t-secondary"
REFUSED: list[tuple[str, dict[str, Any], str]] = [
    (CYLINDER, {"cylinder": {"A_b": "100 cm^2"}}, "closed circuit"),
    (CYLINDER, {"cylinder": {"x_max": "30 m"}}, "V_stroke"),
    (CYLINDER, table("cylinder", stops={"x_c": "2 m"}), "two cushions"),
    (CYLINDER, table("cylinder", passive={"p_min": "300 bar"}), "must rise in this order"),
    (CYLINDER, table("cylinder", relief={"p": "26 bar"}), "Raise relief.p"),
    (CYLINDER, {"cylinder": {"falls": 2.5}}, "whole number"),
    (CYLINDER, {"cylinder": {"A_a": "302 cm"}}, "cm^2"),
    (CYLINDER, {"cylinder": {"bore": "280 mm"}}, "unknown field"),
    (ELECTRIC, table("electric", motor={"n_max": "1500 rev/min"}), "n_max 1500 rev/min is below n_full 2000 rev/min"),
    (ELECTRIC, table("electric", motor={"theta_max": "20 degC"}), "theta_max 20 degC is not above theta_c 30 degC"),
    (ELECTRIC, table("electric", motor={"K_t": "2.5 N m"}), 'unit "N m" is not one of N m/A'),
    (ELECTRIC, table("electric", motor={"R": "-1 mohm"}), "electric.motor.R"),
    (ELECTRIC, table("electric", store={"V_set": "800 V"}), "V_max are 510 V, 800 V, 720 V: they must rise"),
    (ELECTRIC, table("electric", speed={"T_i": "0 s"}), "electric.speed.T_i"),
    (ELECTRIC, table("electric", speed={"K": "0 N m s/rad"}), "electric.speed.K"),
    (ELECTRIC, table("electric", supply={"P_rated": "500 kW"}), "P_rated 500 kW is above P_resistor 400 kW"),
    (ELECTRIC, table("electric", supply={"P_rated": "0 kW"}), "P_rated is 0 and P_resistor 400 kW"),
    (ELECTRIC, table("electric", store={"theta_max": "20 degC"}), "theta_max 20 degC is not above theta_c 25 degC"),
    (ELECTRIC, table("electric", store={"I_max": "0 A"}), "electric.store.I_max"),
    (ELECTRIC, table("electric", store={"C": "nan F"}), "not a finite number"),
    (ELECTRIC, {"cylinder": {"falls": 2}}, 'plant "electric" has no table [cylinder]. Change plant, or remove'),
    (ELECTRIC, {"active": {"C_leak": "1 L/min/bar"}}, 'plant "electric" has no table [active]'),
    (ELECTRIC, {"hpu": {"P_max": "3 kW", "P_back": "0 kW"}}, "has no pumps that table [hpu] could limit"),
    (PURE, {"plant": "electric"}, 'plant "electric" needs table [electric]'),
    ("nov-250t", {"plant": "open-circuit"}, "open-circuit"),
    (OPEN, table("open", pump={"p_standby": "300 bar"}), "pump.p_standby 300 bar is above pump.p_max"),
    (OPEN, table("open", supply_relief={"p": "250 bar"}), "is not below supply_relief.p 250 bar. Raise"),
    (OPEN, table("open", relief={"p": "250 bar"}), "counterbalance.p_crack 255 bar is not below"),
    (OPEN, table("open", valve={"deadband": 0.7}), "deadband"),
    (OPEN, table("open", counterbalance={"ratio": 0.2}), "it must be greater than or equal to 1"),
    (OPEN, table("open", valve={"Q_N": "220 bar"}), 'unit "bar" is not one of'),
    (OPEN, table("open", valve={"Q_M": "220 L/min"}), "unknown field"),
    (SECONDARY, {"secondary": {"p_min": "300 bar"}}, "p_lp 15 bar, p_min 300 bar, accumulator.gas.p_0 280 bar"),
    (SECONDARY, table("secondary", drive={"n_full": "2100 rev/min"}), "is not below unit.n_max_full 2000 rev/min"),
    (SECONDARY, table("secondary", drive={"K": "60 1/s"}), "drive.K 60 1/s makes the speed control unstable"),
    (SECONDARY, table("secondary", drive={"T_i": "0.05 s"}), "unstable with every drive.K"),
    (SECONDARY, table("secondary", drive={"T_i": "0.07 s"}), "Lower drive.K or raise drive.T_i"),
    (SECONDARY, table("secondary", unit={"D_max": "355 cm^3"}), 'unit "cm^3" is not one of m^3/rad'),
    (SECONDARY, table("secondary", unit={"count": 0}), "secondary.unit.count = 0"),
    (SECONDARY, table("secondary", drive={"load_ahead": 0.5}), "secondary.drive.load_ahead = 0.5"),
    (SECONDARY, table("secondary", accumulator={"V_stroke": "11 m^3"}), "gas.V_0 5000 L is not above half of V_stroke"),
    (SECONDARY, table("secondary", accumulator={"V_strok": "9 m^3"}), "unknown field"),
]


@pytest.mark.parametrize(("crane", "changes", "words"), REFUSED)
def test_a_table_that_cannot_be_is_refused_in_one_line(crane: str, changes: dict[str, Any], words: str) -> None:
    with pytest.raises(StillhookError) as refused:
        changed(load_crane(crane), changes)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
