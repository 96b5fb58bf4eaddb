"""Drives sized for one crane and compared: scaling, energy, bands, bad input."""

from __future__ import annotations

import json
import math

import pytest

import stillhook
from stillhook import Scenario, load_crane
from stillhook.analysis.drives.comparison import DriveComparison, compare_drives
from stillhook.analysis.drives.sizing import (
    EXPONENTS,
    _records,
    beyond,
    fitted,
    library_crane,
    of_one_motor,
    scaled,
)
from stillhook.engine.pack.winch import motor_speed_max, wire_speed_max
from stillhook.library import changed
from stillhook.library.write import items
from stillhook.spec.crane import INERTIA_TOLERANCE, Crane, content, effective_inertia, holding_torque
from stillhook.tables.table import Spec
from stillhook.variables import BY_NAME
from stillhook.winches.registry import WINCH_TYPES

LIBRARY = [name for name in WINCH_TYPES if any(load_crane(c).plant == name for c in stillhook.cranes())]
"""Drives of which the library has a crane."""
BALANCE = 1e-3
"""Energy that is not found again over all that flows: the audit's own bound."""
ROUNDED = 1e-9
"""What a number read back from its text may differ by, relative."""
CASE = Scenario(load="50 t", s_w="100 m", tip="sine 1 m 10 s", duration="60 s", warm_up="30 s")
PAIR = ("pure-active", "active-passive")


@pytest.fixture(scope="module", autouse=True)
def gains():
    """Position gains as given, for speed: what the margins allow is the question of other tests."""
    with pytest.MonkeyPatch.context() as patch:
        for module in ("controllers", "drives.sizing"):
            patch.setattr(f"stillhook.analysis.{module}.strong_gain", lambda crane, mode, delay=0.0: (0.2, "as given"))
        yield


@pytest.fixture(scope="module")
def pair() -> DriveComparison:
    return compare_drives(load_crane("nov-100t-pure-active"), CASE, PAIR, n=4, seed=3)


# Sizing


@pytest.mark.parametrize("name", [c for c in stillhook.cranes() if load_crane(c).plant in LIBRARY])
def test_a_drive_sized_for_its_own_crane_is_that_drive(name):
    crane = load_crane(name)
    again, size, parts = scaled(crane, crane)
    assert size == 1.0
    assert all(part.motors == part.of for part in parts)
    assert content(again) == content(crane)


@pytest.mark.parametrize("drive", LIBRARY)
def test_twice_the_load_is_held_with_the_same_reserve(drive):
    """Torque of the load over torque of the motors stays, but for the last motor; the wire is as fast."""
    of = library_crane(drive, load_crane("nov-150t"))
    twice = of.model_copy(update={"SWL": 2.0 * of.SWL + of.hook_mass})
    crane, size, parts = scaled(of, twice)
    assert size == pytest.approx(2.0, rel=ROUNDED)
    assert holding_torque(crane) == pytest.approx(2.0 * holding_torque(of), rel=ROUNDED)
    assert [part.motors for part in parts] == [2 * part.of for part in parts]
    assert wire_speed_max(crane) == pytest.approx(wire_speed_max(of), rel=ROUNDED)
    assert capability(crane) == pytest.approx(2.0 * capability(of), rel=1e-6)


def capability(crane: Crane) -> float:
    """What a drive can hold at its own largest pressure or torque, in its own measure: torque at the shaft [N m], and
    force in the wire of a cylinder [N]."""
    if cylinder := crane.table("cylinder"):
        chamber = cylinder.passive.A * cylinder.passive.accumulator.gas.p_0
        return (chamber + cylinder.A_a * cylinder.relief.p) / cylinder.falls
    if crane.table("electric"):
        return sum(m.count * m.T_max for m in crane.motors)
    return sum(m.count * m.D_max for m in crane.motors)


@pytest.mark.long
@pytest.mark.parametrize("name", stillhook.cranes())
@pytest.mark.parametrize("drive", LIBRARY)
def test_full_command_moves_no_part_of_a_sized_drive_faster_than_it_is_made_for(drive, name):
    """Whatever the reference and the wire speed; what a drive falls short of it says, with the part that ends it."""
    reference = load_crane(name)
    for v in (wire_speed_max(reference), 2.0 * wire_speed_max(reference)):
        fit = fitted(library_crane(drive, reference), reference, v)
        crane = fit.crane
        assert wire_speed_max(crane) == pytest.approx(fit.v_full, rel=ROUNDED)
        if crane.cylinder:
            assert crane.cylinder.Q / crane.cylinder.A_a <= crane.cylinder.v_max * (1.0 + ROUNDED)
            assert fit.v_full == pytest.approx(min(v, crane.cylinder.falls * crane.cylinder.v_max), rel=ROUNDED)
        for motor in crane.motors:
            assert motor_speed_max(crane) <= motor.n_max
        assert (fit.v_full < v * (1.0 - ROUNDED)) == bool(fit.held_by)
        assert not beyond(crane)


def use(crane: Crane) -> dict[str, float]:
    """What SWL and hook at full command take of the parts of a drive [-]: pressure, torque, flow, power, brake; of stores
    the part that a second at full speed takes."""
    W, T, n = (crane.SWL + crane.hook_mass) * 9.80665, holding_torque(crane), motor_speed_max(crane)
    P = W * wire_speed_max(crane)
    out = {}
    if crane.brake and crane.brake.T:
        out["brake"] = T / crane.brake.T
    if crane.hpu:
        out["power units"] = P / crane.hpu.P_max
    if a := crane.table("active"):
        out["motors"] = T / (a.motor.D_total * (a.relief.p - a.boost.p))
    if p := crane.table("passive"):
        out["passive motors"] = T / (p.motor.D_total * (p.accumulator.gas.p_0 - p.p_lp))
        out["accumulator"] = P / (p.accumulator.V_stroke * p.accumulator.gas.p_0)
    if s := crane.table("secondary"):
        out["units"] = T / (s.unit.D_total * s.accumulator.gas.p_0)
        out["accumulator"] = P / (s.accumulator.V_stroke * s.accumulator.gas.p_0)
        out["pumps"] = s.unit.D_total * n / (sum(s.pump.D) * s.pump.omega_p)
    if o := crane.table("open"):
        Q = o.motor.D_total * n
        out |= {"valve": Q / o.valve.Q_N, "counterbalance": Q / o.counterbalance.Q_N}
        out["motors"] = T / (o.motor.D_total * o.relief.p)
    if c := crane.table("cylinder"):
        out["gas"] = c.falls * W / (c.passive.A * c.passive.accumulator.gas.p_0)
        out["accumulator"] = c.passive.A * c.x_max / c.passive.accumulator.V_stroke
    if e := crane.table("electric"):
        out["machines"] = T / (e.motor.count * e.motor.T_rated)
        out["power"] = T * n / (e.motor.count * e.motor.P_max)
        out |= {"grid": T * n / e.supply.P_max, "store": T * n / e.store.P_max}
        out["current"] = T * n / (e.store.I_max * e.store.V_min)
        out["energy"] = P / (e.store.C * (e.store.V_max**2 - e.store.V_min**2))
    return out


@pytest.mark.long
@pytest.mark.parametrize("name", stillhook.cranes())
@pytest.mark.parametrize("drive", LIBRARY)
def test_no_part_of_a_sized_drive_is_used_more_than_in_the_crane_that_it_is_of(drive, name):
    """Motors, valves, gas, stores, power and brake keep what the library crane has to spare."""
    reference = load_crane(name)
    of = library_crane(drive, reference)
    sized, library = use(fitted(of, reference, wire_speed_max(reference)).crane), use(of)
    assert set(sized) >= set(library) - {"brake"}
    assert {part for part in sized if part in library and sized[part] > library[part] * (1.0 + ROUNDED)} == set()


def test_seals_end_the_speed_of_a_cylinder_and_it_says_so():
    """Two falls on seals of 0.5 m/s: 1 m/s of wire, where nov-250t has 1.21."""
    fit = fitted(load_crane("nov-100t-cylinder"), load_crane("nov-250t"), 1.2)
    assert fit.v_full == pytest.approx(1.0, rel=ROUNDED)
    assert fit.held_by == "rod seals of 30 m/min"
    slower = changed(load_crane("nov-100t-cylinder"), {"cylinder": {"falls": 3}})
    assert fitted(slower, load_crane("nov-250t"), 1.2).held_by == ""


def test_a_motor_that_is_too_fast_is_named():
    """A gear cannot be too fast for its motors in this library; a motor of a lower limit is."""
    crane = load_crane("nov-100t-pure-active")
    slow = crane.active.motor.model_copy(update={"n_max_full": 100.0})
    weak = crane.model_copy(update={"active": crane.active.model_copy(update={"motor": slow})})
    assert [(part.part, part.highest) for part in beyond(weak)] == [("motors", 100.0)]
    assert not beyond(crane)


@pytest.mark.parametrize("drive", LIBRARY)
def test_a_sized_drive_is_a_crane_of_the_reference(drive):
    reference = load_crane("nov-150t")
    crane, _, _ = scaled(library_crane(drive, reference), reference)
    for table in ("drum", "wire"):
        assert getattr(crane, table) == getattr(reference, table)
    assert (crane.SWL, crane.hook_mass) == (reference.SWL, reference.hook_mass)
    assert wire_speed_max(crane) == pytest.approx(wire_speed_max(reference), rel=ROUNDED)
    assert crane.inertia.J_m_eff == pytest.approx(effective_inertia(crane), rel=INERTIA_TOLERANCE)
    assert crane.certified is None


@pytest.mark.parametrize("drive", [name for name in LIBRARY if name != "cylinder"])
def test_friction_of_gears_and_drum_is_the_same_at_the_drum(drive):
    """Power lost per wire speed does not know how many motors turn the drum, nor through which gear."""
    reference = load_crane("nov-250t")
    crane, _, _ = scaled(library_crane(drive, reference), reference)

    def at_the_drum(c: Crane) -> float:
        y, omega = c.friction.system, 2.0 * c.i_hD
        return sum(m.count for m in c.motors) * c.i_hD * (y.Y_6 * 1e6 + y.Y_2 + y.Y_5 * omega)

    assert at_the_drum(crane) == pytest.approx(at_the_drum(reference), rel=ROUNDED)


@pytest.mark.parametrize("drive", list(WINCH_TYPES))
def test_every_kind_of_number_in_a_drive_says_how_it_scales(drive):
    """A new kind must be placed in the table of kinds, or the sizing would leave it as it is."""

    def kinds(model: type[Spec]) -> set[str]:
        from stillhook.library.write import quantity_of
        from stillhook.tables.table import model_in

        found: set[str] = set()
        for field in model.model_fields.values():
            below = model_in(field.annotation)
            found |= kinds(below) if below else {quantity_of(field) or ""}
        return found - {""}

    from stillhook.winches.circuits.tables import ActiveCircuit, PassiveCircuit

    models = {"active": ActiveCircuit, "passive": PassiveCircuit}
    for name, model in WINCH_TYPES[drive].tables.items():
        assert kinds(model or models[name]) <= set(EXPONENTS)


def test_numbers_of_one_motor_stay_and_those_of_all_grow():
    crane = load_crane("nov-100t-pure-active")
    bigger, _, _ = scaled(crane, crane.model_copy(update={"SWL": 2.0 * crane.SWL + crane.hook_mass}))
    assert bigger.active.motor.D_max == crane.active.motor.D_max
    assert bigger.active.line.V == pytest.approx(2.0 * crane.active.line.V, rel=ROUNDED)
    assert bigger.active.relief.p == crane.active.relief.p
    assert bigger.active.pump.D == pytest.approx([2.0 * D for D in crane.active.pump.D], rel=ROUNDED)
    assert of_one_motor(crane) == ("active.motor",)
    assert {path for path, _ in _records(crane.active, "active")} > {"active.motor.servo", "active.pump"}


def test_what_was_assumed_stays_assumed_and_says_what_it_was_made_from():
    reference = load_crane("nov-250t")
    crane, _, _ = scaled(load_crane("nov-100t-pure-active"), reference)
    volume = next(item for item in items(crane) if item.path == "active.line.V")
    assert volume.source.kind.value == "assumed"
    assert volume.source.text.startswith("3.5 times that of nov-100t-pure-active: ")


def test_a_faster_wire_takes_more_torque_and_so_more_motors():
    reference = load_crane("nov-250t")
    of = load_crane("nov-100t-pure-active")
    slow, size, _ = scaled(of, reference)
    fast, larger, _ = scaled(of, reference, 2.0 * wire_speed_max(reference))
    assert wire_speed_max(fast) == pytest.approx(2.0 * wire_speed_max(slow), rel=ROUNDED)
    assert larger == pytest.approx(2.0 * size, rel=ROUNDED)


# Runs


def test_what_goes_in_comes_out_or_is_stored(pair):
    for run in pair.runs:
        assert abs(run.energy.unaccounted) < BALANCE
        assert abs(run.summary["energy_unaccounted"]) < BALANCE


def test_what_is_drawn_less_what_is_returned_is_the_net(pair):
    for run in pair.runs:
        e = run.energy
        assert e.drawn - e.returned == pytest.approx(e.net, rel=1e-6)
        assert e.drawn >= 0.0
        assert e.returned >= 0.0


def test_a_pure_active_winch_returns_the_weights_energy_and_draws_it_again(pair):
    """Lowering the tonnes with the tip gives back what hoisting took: 4 h m g v, less friction and leaks."""
    run = next(r for r in pair.runs if r.name == "pure-active")
    swing = (CASE.load + run.drive.crane.hook_mass) * 9.80665 * 2.0 * 360.0
    assert 0.3 * swing < run.energy.returned < swing < run.energy.drawn


def test_the_same_seed_gives_the_same_numbers(pair):
    again = compare_drives(load_crane("nov-100t-pure-active"), CASE, PAIR, n=4, seed=3)
    assert json.dumps(again.to_dict()) == json.dumps(pair.to_dict())
    for run, other in zip(pair.runs, again.runs, strict=True):
        assert (run.drawn["e_c_pp"] == other.drawn["e_c_pp"]).all()


def test_bands_that_overlap_tell_nothing_apart(pair):
    better = pair.better("energy_net")
    for a in pair.runs:
        for b in pair.runs:
            apart = a.band("energy_net").high < b.band("energy_net").low
            assert (b.name in better[a.name]) == apart
    assert sorted(name for group in pair.ranking("energy_net") for name in group) == sorted(PAIR)


@pytest.fixture(scope="module")
def slow() -> DriveComparison:
    """At 1.2 m/s of full command, of which a cylinder has 1."""
    return compare_drives(load_crane("nov-100t-pure-active"), CASE, ("cylinder", "pure-active"), n=2, v_top=1.2)


def test_a_drive_that_does_not_reach_the_speed_is_shown_and_not_ranked(slow):
    cylinder, pure_active = slow.runs
    assert (cylinder.short, pure_active.short) == (
        "60 m/min of wire at full command, held by rod seals of 30 m/min",
        "",
    )
    assert cylinder.to_dict()["v_w_full"] == pytest.approx(1.0, rel=ROUNDED)
    for name in ("e_c_pp", "energy_net"):
        assert slow.ranking(name) == [["pure-active"], ["cylinder"]]
        assert slow.better(name) == {"cylinder": [], "pure-active": []}
        assert slow.verdict(name).endswith(
            "pure-active alone is fast enough to be ranked; not ranked: cylinder, 60 m/min of wire at full command,"
            " held by rod seals of 30 m/min."
        )
    assert "held by rod seals" in cylinder.drive.describe()


def test_every_key_of_the_answer_is_a_documented_name(pair):
    free = {"by_error", "by_energy", "factors", "seed", "controller", "twin", "crane"}
    data = pair.to_dict()
    keys = {*data, *data["told_apart"], *(key for row in data["drives"].values() for key in row)}
    assert {key for key in keys - free if key not in BY_NAME} == set()


# Bad input


def test_a_type_without_a_crane_is_refused(monkeypatch):
    monkeypatch.setattr("stillhook.analysis.drives.sizing.cranes", lambda: ("nov-250t",))
    with pytest.raises(stillhook.errors.SpecError, match='no crane with the drive "pure-active"'):
        library_crane("pure-active", load_crane("nov-250t"))


def test_a_changed_position_gain_does_not_change_the_size():
    crane = load_crane("nov-100t-pure-active")
    other = changed(crane, {"control": {"K_p": "0.3 1/m"}})
    assert scaled(crane, other)[2] == scaled(crane, crane)[2]


def test_one_drive_alone_is_compared_with_nothing_and_says_so():
    found = compare_drives(load_crane("nov-100t-pure-active"), CASE, ("pure-active",), n=0)
    assert found.verdict("e_c_pp") == "By error: one drive alone; name others to compare it with."


def test_without_draws_nothing_is_distinguished_and_a_motion_faster_than_the_drives_are_sized_for_is_said(pair):
    """The wire of a sine of 1.8 m and 10 s runs at 1.13 m/s; nov-100t-pure-active has 0.85 m/s at full command."""
    fast = CASE.model_copy(update={"tip": Scenario(tip="sine 1.8 m 10 s", load="50 t", s_w="100 m").tip})
    found = compare_drives(load_crane("nov-100t-pure-active"), fast, PAIR, n=0)
    assert math.isnan(found.runs[0].band("e_c_pp").low)
    assert "not distinguished" in found.verdict("e_c_pp")
    assert "not validated" in " ".join(found.rule)
    assert "This motion requires 67.9 m/min" in found.rule[-1]
    assert not any("This motion asks" in line for line in pair.rule)
