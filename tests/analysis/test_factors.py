"""Uncertain factors: the quick way to a drawn crane gives what a crane file gives, and every drawn crane is one."""

import numpy as np
import pytest

from stillhook import MotionUnit, Scenario, VesselTip, load_crane
from stillhook.analysis.uncertainty.draws import HELD, Drawing, Uncertainty, draws, unit_points
from stillhook.analysis.uncertainty.factors import FACTORS, Distribution, Law, distribution
from stillhook.engine.pack.winch import gains
from stillhook.errors import SpecError, StillhookError, UnitError
from stillhook.library import changed, cranes
from stillhook.spec.crane import effective_inertia

CASE = Scenario(load="50 t", s_w="100 m", tip="sine 2 m 12 s", duration="60 s")
OPEN_LOOP = {"active": {"motor": {"variant": "open-loop"}}}
ROUNDING = 1e-12
"""Relative: a value written with all its digits and read again."""
TAILS = 0.02
"""Share of 4096 Sobol points beyond a quantile: a few of their steps."""


def everything(crane):
    return [name for name, f in FACTORS.items() if not f.absent(crane, CASE)]


def middle(name, factor=1.1):
    """A value off the crane's own: a multiple, or the upper end of a default in SI."""
    f = FACTORS[name]
    return factor if any(t.share is not None for t in f.targets) else f.default.values[-1]


@pytest.mark.parametrize("name", cranes())
def test_a_drawn_crane_is_what_a_crane_file_with_the_same_numbers_gives(name):
    crane = load_crane(name)
    crane = changed(crane, OPEN_LOOP) if crane.circuits else crane
    of_crane = CASE.with_mode(crane.plant.type.default_mode).model_copy(update={"load": 0.2 * crane.SWL})
    drawing = Drawing(crane, of_crane, everything(crane))
    draw = np.array([middle(n) for n in drawing.columns])
    quick, case = next(drawing.pairs(draw[None, :]))
    slow, _ = drawing.checked(draw, "a test")
    a, b = (c.model_dump(exclude={"sources"}) for c in (quick, slow))
    assert_alike(a, b)
    assert case.load == pytest.approx(1.1 * of_crane.load)
    assert case.sensors.delay == pytest.approx(0.02)


def assert_alike(a, b):
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            assert_alike(a[key], b[key])
    elif isinstance(a, float):
        assert a == pytest.approx(b, rel=ROUNDING)
    else:
        assert a == b


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tables"),
    [
        (
            "bulk_modulus",
            {"active": {"line": {"bulk_modulus": "19250 bar"}}, "passive": {"line": {"bulk_modulus": "19250 bar"}}},
        ),
        ("line_volume", {"active": {"line": {"V": "88 L"}}}),
        ("boost", {"active": {"boost": {"p": "27.5 bar"}}}),
        ("gas_pressure", {"passive": {"accumulator": {"gas": {"p_0": "308 bar"}}}}),
        ("wire_stiffness", {"wire": {"E": "231 GPa"}}),
        ("pump_leakage", {"active": {"pump": {"leak_scale": 1.1}}, "passive": {"pump": {"leak_scale": 1.1}}}),
        ("motor_servo", {c: {"motor": {"servo": {"omega_n": "5.5 rad/s"}}} for c in ("active", "passive")}),
    ],
)
def test_a_factor_changes_what_it_says_and_nothing_else(name, tables):
    crane = load_crane("nov-250t")
    quick, case = next(Drawing(crane, CASE, [name]).pairs(np.array([[1.1]])))
    by_file = changed(crane, tables)
    assert_alike(quick.model_dump(exclude={"sources"}), by_file.model_dump(exclude={"sources"}))
    assert case is CASE


ON_ITS_BRAKE = "nov-100t-cylinder"
"""A winch on its brake while its cylinder compensates: no shaft moves."""


def test_a_winch_whose_shaft_stands_has_no_factors_of_it():
    crane = load_crane(ON_ITS_BRAKE)
    listed = Uncertainty.default().on((crane, CASE)).factors
    assert not {"friction", "inertia"} & set(listed)
    assert "rod_friction" in listed
    with pytest.raises(
        SpecError, match=r"factor friction: it has no effect here: .*moves by no number of \[friction\]"
    ):
        Uncertainty.of({"friction": "default"}).on((crane, CASE))


@pytest.mark.parametrize("name", [name for name in cranes() if name != ON_ITS_BRAKE])
@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_drawn_inertia_is_still_the_sum_of_its_parts_and_the_wire_keeps_its_mass(name, factor):
    crane = load_crane(name)
    drawn, _ = next(Drawing(crane, CASE, ["inertia"]).pairs(np.array([[factor]])))
    assert drawn.inertia.J_m_eff == pytest.approx(factor * crane.inertia.J_m_eff)
    assert effective_inertia(drawn) == pytest.approx(factor * effective_inertia(crane))
    assert drawn.wire is crane.wire


def test_the_plc_does_not_know_that_its_pumps_are_slower():
    """K_2 follows from the servo that the crane was set up for, not from the drawn one."""
    crane = load_crane("nov-250t")
    for name in HELD:
        drawn, _ = next(Drawing(crane, CASE, [name]).pairs(np.array([[0.85]])))
        assert gains(drawn) == gains(crane)
        assert drawn.active.pump.servo != crane.active.pump.servo


def test_factors_of_one_change_nothing_to_the_last_bit():
    crane = load_crane("nov-250t")
    names = [n for n in everything(crane) if all(t.share is not None for t in FACTORS[n].targets)]
    drawn, case = next(Drawing(crane, CASE, names).pairs(np.ones((1, len(names)))))
    leak = {c: {"pump": {"leak_scale": 1.0}} for c in ("active", "passive")}
    plain = changed(crane, leak | {"control": {"K_2": f"{gains(crane).K_2!r} s^2/m"}})
    assert drawn.model_dump(exclude={"sources"}) == plain.model_dump(exclude={"sources"})
    assert case == CASE


def test_untouched_parts_are_shared_by_all_drawn_cranes():
    crane = load_crane("nov-250t")
    names = everything(crane)
    drawing, draws = Drawing(crane, CASE, names), np.array([[middle(n) for n in names]] * 5)
    drawn = [c for c, _ in drawing.pairs(draws)]
    assert all(c.drum is crane.drum and c.passive.relief is crane.passive.relief for c in drawn)


def test_ends_that_are_no_crane_are_refused_by_name():
    crane = load_crane("nov-250t")
    with pytest.raises(StillhookError, match=r"factor boost = 20: .*relief.p"):
        Drawing(crane, CASE, ["boost"]).check_ends(np.array([[1.0], [20.0]]))
    heavy = CASE.model_copy(update={"load": 249e3})
    with pytest.raises(StillhookError, match=r"factor load = 1.03: Load 256.5 t exceeds the SWL"):
        Drawing(crane, heavy, ["load"]).check_ends(np.array([[1.0], [1.03]]))
    with pytest.raises(StillhookError, match="factor inertia"):
        Drawing(crane, CASE, ["inertia"]).check_ends(np.array([[0.2], [1.0]]))


def test_every_factor_says_why_its_default_is_as_wide_as_it_is():
    for name, f in FACTORS.items():
        assert f.name == name
        assert f.reason.startswith(("assumed", "published", "paper")), name
        assert not f.default.problem(f.least, f.most), name


@pytest.mark.parametrize(
    ("text", "quantiles"),
    [
        ({"normal": [2.0, 0.5]}, {0.5: 2.0, 0.8413447: 2.5}),
        ({"lognormal": [2.0, 1.5]}, {0.5: 2.0, 0.8413447: 3.0}),
        ({"uniform": [1.0, 3.0]}, {0.25: 1.5, 0.5: 2.0}),
        ({"triangular": [0.0, 1.0, 2.0]}, {0.5: 1.0, 0.125: 0.5}),
        (1.5, {0.1: 1.5, 0.9: 1.5}),
    ],
)
def test_quantiles_of_every_law(text, quantiles):
    found = distribution(text, "", "test", 0.0)
    for u, x in quantiles.items():
        assert float(found.at(np.array([u]))[0]) == pytest.approx(x, rel=1e-6)


def test_a_normal_distribution_is_cut_where_physics_ends_and_not_clipped():
    cut = Distribution(Law.NORMAL, (1.0, 0.5)).at((np.arange(4096) + 0.5) / 4096, 0.0)
    assert cut.min() > 0.0
    assert len(np.unique(cut)) == len(cut)  # clipped ones would be alike
    assert np.mean(cut < 1.0) == pytest.approx(
        (0.5 - 0.02275) / (1.0 - 0.02275), abs=TAILS
    )  # normal table: 2.275 % lie below 0


@pytest.mark.parametrize(
    ("table", "error", "words"),
    [
        ({"stiction": 1.0}, SpecError, "unknown factor. Allowed: friction"),
        ({"boost": {"normal": [1.0]}}, SpecError, "normal takes 2 values, came 1"),
        ({"boost": {"normal": [1.0, -0.1]}}, SpecError, "a deviation above 0"),
        ({"boost": {"normal": [1.0, 2.0]}}, SpecError, "31% of it is outside"),
        ({"boost": {"uniform": [1.2, 0.8]}}, SpecError, "values that rise"),
        ({"boost": {"beta": [1, 2]}}, SpecError, "choose one of normal, lognormal"),
        ({"boost": "1 bar"}, SpecError, "must be a number"),
        ({"boost": -1.0}, SpecError, "beyond 0 to inf"),
        ({"delay": 0.02}, UnitError, "a bare number"),
        ({"delay": {"uniform": ["0 ms", "20 s"]}}, SpecError, "beyond 0 to 10"),
        ({"boost": {"set": "crane-2"}}, SpecError, "only friction and motor_loss are drawn from a set"),
        ({"friction": {"set": "crane-2"}}, SpecError, r"has no \[evidence\]"),
        ({"friction": {"set": "crane-22"}}, SpecError, "not in the library"),
    ],
)
def test_bad_factors_are_refused_in_one_line(table, error, words):
    with pytest.raises(error, match=words) as caught:
        Uncertainty.of(table, "my.toml")
    assert "\n" not in str(caught.value)
    assert "my.toml" in str(caught.value)


def test_a_drawn_heave_filter_is_that_of_a_unit_with_the_same_corner():
    boom, crane = "x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg", load_crane("nov-250t")
    tip = VesselTip(boom, heave="sine 1 m 12 s", unit=MotionUnit(heave_period="25 s", delay="20 ms"))
    case = CASE.model_copy(update={"tip": tip})
    t = np.arange(0.0, 30.0, 0.01)
    before = tip.measured(t)[0]  # what the unit remembers is not that of the other one
    _, drawn = next(Drawing(crane, case, ["heave_filter"]).pairs(np.array([[1.2]])))
    slower = VesselTip(boom, heave="sine 1 m 12 s", unit=MotionUnit(heave_period="30 s", delay="20 ms"))
    assert drawn.tip == slower
    np.testing.assert_array_equal(drawn.tip.measured(t)[0], slower.measured(t)[0])
    np.testing.assert_array_equal(tip.measured(t)[0], before)
    assert np.abs(drawn.tip.measured(t)[0] - before).max() > 0.1
    assert "heave_filter" in Uncertainty.default().on((crane, case)).factors
    assert "heave_filter" not in Uncertainty.default().on((crane, CASE)).factors
    with pytest.raises(
        SpecError, match=r"factor heave_filter: it has no effect here: no motion unit of the case filters"
    ):
        Uncertainty.of({"heave_filter": "default"}).on((crane, CASE))


EMPTY = Scenario(load="0 t", s_w="15 m", tip="sine 2 m 12 s", duration="60 s")
HEAVY = Scenario(load="150 t", s_w="15 m", tip="sine 2 m 12 s", duration="60 s")


def test_passive_motors_inside_their_fit_have_no_uncertainty_of_being_outside():
    crane, factor = load_crane("nov-250t"), FACTORS["passive_motor_loss"]
    assert factor.absent(crane, EMPTY) == ""
    assert "work where their loss was fitted" in factor.absent(crane, HEAVY)
    drawn, _ = next(Drawing(crane, HEAVY, ["passive_motor_loss"]).pairs(np.array([[2.0]])))
    assert (
        drawn.passive.motor.loss == crane.passive.motor.loss
    )  # in a batch with an empty hook it is left alone as well


def test_losses_of_passive_motors_carry_both_factors():
    crane = load_crane("nov-250t")
    drawn, _ = next(Drawing(crane, EMPTY, ["motor_loss", "passive_motor_loss"]).pairs(np.array([[1.1, 2.0]])))
    assert drawn.active.motor.loss.X_4 == pytest.approx(1.1 * crane.active.motor.loss.X_4)
    assert drawn.passive.motor.loss.X_4 == pytest.approx(2.2 * crane.passive.motor.loss.X_4)


def test_a_drawn_set_of_motor_losses_is_scaled_where_passive_motors_are_outside_their_fit():
    crane = load_crane("nov-250t")
    columns = [*(f"motor_loss.X_{i}" for i in range(1, 6)), "passive_motor_loss"]
    losses = np.array([[5e-3, 4e10, 0.006, 15.0, 1.2e-14, 0.5]])
    drawn, _ = next(Drawing(crane, EMPTY, columns).pairs(losses))
    assert drawn.active.motor.loss.X_4 == 15.0
    assert drawn.passive.motor.loss.X_4 == pytest.approx(7.5)


MJ3, MJ2 = (
    {"law": law, "C": C} for law, C in (("mj3", [12.0, 1e-7, 0.5, 4e7]), ("mj2", [13.0, 1e-7, 0.5, 4e7, 1e-14]))
)


def alike_models():
    """A crane whose motors have two models that fit as well as MJ4."""
    return changed(load_crane("nov-150t"), {"active": {"motor": {"alternatives": {"mj3": MJ3, "mj2": MJ2}}}})


def test_models_that_fit_equally_well_are_drawn_alike_often_and_scaled_with_the_loss():
    crane = alike_models()
    uncertainty = Uncertainty.of({"loss_model": "default", "motor_loss": {"uniform": [0.9, 1.1]}}).on((crane, CASE))
    sample = draws(uncertainty, 256, 1)
    pairs = list(Drawing(crane, CASE, sample.columns).pairs(sample.values))
    laws = [drawn.active.motor.law for drawn, _ in pairs]
    assert {law: laws.count(law) for law in set(laws)} == pytest.approx(
        dict.fromkeys(("mj4", "mj3", "mj2"), 256 / 3), abs=6
    )
    factor = sample.values[:, sample.columns.index("motor_loss")]
    for (drawn, _), x in zip(pairs, factor.tolist(), strict=True):
        motor = drawn.active.motor
        scale = motor.loss.X_4 / crane.active.motor.loss.X_4 if motor.law == "mj4" else motor.loss_model.scale
        assert scale == pytest.approx(x)
        assert drawn.passive.motor.law == "mj4"


@pytest.mark.parametrize(
    ("name", "table", "motors"),
    [
        ("nov-250t-secondary", "secondary", "unit"),
        ("nov-250t-digital", "secondary", "unit"),
        ("utility-20t-open-circuit", "open", "motor"),
    ],
)
def test_models_of_units_on_a_rail_and_of_open_circuits_are_drawn_as_well(name, table, motors):
    crane = changed(load_crane(name), {table: {motors: {"alternatives": {"mj3": MJ3, "mj2": MJ2}}}})
    case = Scenario(load="5 t", s_w="50 m", tip="sine 0.3 m 8 s", mode=crane.plant.type.default_mode)
    known = Uncertainty.of({"loss_model": "default", "motor_loss": {"uniform": [0.9, 1.1]}}).on((crane, case))
    sample = draws(known, 48, 1)
    drawn = [getattr(getattr(c, table), motors) for c, _ in Drawing(crane, case, sample.columns).pairs(sample.values)]
    laws = [motor.law for motor in drawn]
    assert {law: laws.count(law) for law in set(laws)} == pytest.approx(dict.fromkeys(("mj4", "mj3", "mj2"), 16), abs=3)
    for motor, x in zip(drawn, sample.values[:, sample.columns.index("motor_loss")].tolist(), strict=True):
        own = getattr(getattr(crane, table), motors).loss.X_4
        assert (motor.loss.X_4 / own if motor.law == "mj4" else motor.loss_model.scale) == pytest.approx(x)


def test_a_drawn_model_is_that_of_a_crane_file():
    crane = alike_models()
    drawing = Drawing(crane, CASE, ["loss_model"])
    quick, _ = next(drawing.pairs(np.array([[2.5]])))
    slow, _ = drawing.checked(np.array([2.5]), "a test")
    assert quick.active.motor.loss_model == slow.active.motor.loss_model
    assert slow.active.motor.law == "mj3"


def test_a_crane_without_models_that_fit_equally_well_has_no_such_factor():
    crane = load_crane("nov-150t")
    with pytest.raises(SpecError, match="does not give alternatives of its motors' loss models"):
        Uncertainty.of({"loss_model": "default"}).on((crane, CASE))
    assert "loss_model" not in Uncertainty.default().on((crane, CASE)).factors
    assert "loss_model" in Uncertainty.default().on((alike_models(), CASE)).factors


STORED = ([0.21451920736581087, 0.34854538552463055], [0.14095560275018215, 0.7400441095232964])
"""Draws of the first two factors, and of the last two before loss_model, as they were without it."""


def test_a_new_factor_moves_no_draw_of_the_others():
    u = unit_points(8, 0)[0]
    assert u[3, :2] == pytest.approx(STORED[0], abs=1e-15)
    assert u[3, 38:40] == pytest.approx(STORED[1], abs=1e-15)


def test_the_wider_ends_of_motor_loss_are_for_motors_outside_their_fit():
    crane = load_crane("nov-250t")
    slow = HEAVY.model_copy(update={"tip": EMPTY.tip.__class__.from_si(0.3, 12.0)})
    assert FACTORS["motor_loss"].outside_fit(crane, EMPTY)
    assert not FACTORS["motor_loss"].outside_fit(crane, slow)
    assert not FACTORS["friction"].outside_fit(crane, EMPTY)
