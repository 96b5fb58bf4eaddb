"""The operating envelope: what stops a winch, and how fast each controller lets it go."""

import math
from functools import cache

import numpy as np
import pytest

from stillhook import Scenario, Sine, load_crane, simulate
from stillhook.analysis.steady.envelope import PHYSICAL, envelope, setting_curves
from stillhook.analysis.steady.figures import load_speed_figure
from stillhook.analysis.steady.limits import Direction, Limit, Station
from stillhook.analysis.steady.operating_point import NoSteadyOperation, operating_point
from stillhook.analysis.steady.steady_state import wire_out_on
from stillhook.engine.pack.winch import wire_speed_max
from stillhook.errors import StillhookError
from stillhook.library import changed
from stillhook.report.plots.colours import CONTROLLERS
from stillhook.spec.scenario import Mode

pytestmark = pytest.mark.slow

C150, E250, PURE = "nov-150t", "nov-250t", "nov-100t-pure-active"
SAME = 1e-6
"""Part by which speeds solved in two ways may differ: the solvers' own 1e-9 m/s and 1e-6 of displacement."""
CORNER = 1e-5
"""The same where two limits meet: the pressure falls by some parts in a million over the 1e-6 of displacement."""
ENGINE = 4e-3
"""Part by which the wire's highest speed may differ from the steady one: with full pumps it catches up while the tip
slows down, with less pressure and so less leakage than at constant speed. Measured 2e-3; leakage itself is 3e-2."""
M_PER_MIN = 1.0 / 60.0

load = cache(load_crane)


UNITS = {C150: ("820 kW", "410 kW"), E250: ("1110 kW", "550 kW"), PURE: ("880 kW", "440 kW")}
"""Power units P_max, P_back so small that they bind with a heavy load, whatever the library's are: corner power of the
pumps at 275 bar."""


@cache
def outer(name, share, way=Direction.HOISTING, units="library"):
    """The station of a part of the SWL on the outermost layer; units of the library, "small" ones of `UNITS`, or
    "endless"."""
    crane = {"library": load, "small": small, "endless": unlimited}[units](name)
    return Station(crane, share * crane.SWL, wire_out_on(crane, crane.drum.layers), way)


@cache
def small(name):
    P_max, P_back = UNITS[name]
    return changed(load(name), {"hpu": {"P_max": P_max, "P_back": P_back}})


@cache
def unlimited(name):
    return load(name).model_copy(update={"hpu": None})


@cache
def envelope_of(name):
    crane = load(name)
    return envelope(crane, layers=[1, crane.drum.layers], loads=["0 %", "60 %", "100 %"], modes=["ns", "hs", "ssc"])


@cache
def curves_of_100_t():
    return setting_curves(load(E250), load="100 t", v_w="0 m/s to 2.2 m/s by 0.05 m/s")


def gain(data, mode: str, over: str):
    """Part by which one mode's highest speed is above another's; NaN where either may not be used."""
    v = data["v_w_top"]
    return v.sel(mode=mode) / v.sel(mode=over) - 1.0


def power_used(crane, o):
    """Power that the active pumps take from the power units, or give back to them, over what these can [-]."""
    ideal = o.alpha_p * crane.active.pump.D_total * crane.active.pump.omega_p * (o.p_a - o.p_b)
    return ideal / crane.hpu.P_max if ideal > 0.0 else -ideal / crane.hpu.P_back


class TestSpecification:
    """Numbers of the ideal machine."""

    def test_ssc_and_ns_cross_where_full_displacement_would_fill_the_pumps(self):
        """0.8 is the middle of u_thr 0.6 .. 1 and of displacements 1 .. 0.6: there u_ff = 0.8 = K_1 v 0.8."""
        crossing = float(
            setting_curves(load(E250), modes=["ssc"], v_w=["0 m/s"])["v_w_cross_ideal"].sel(mode="ssc", classic="ns")
        )
        assert crossing == pytest.approx(72.47127 * M_PER_MIN, rel=SAME)


class TestSettings:
    @pytest.fixture
    def curves(self):
        return curves_of_100_t()

    def test_leakage_takes_more_pump_than_the_ideal_machine_on_the_same_diameter(self):
        layer_6 = setting_curves(load(E250), load="100 t", layer=6, modes=["ns"], v_w="0 m/s to 2 m/s by 0.25 m/s")
        assert bool((layer_6["alpha_p"] > layer_6["alpha_p_ideal"])[:, 1:].all())

    def test_pumps_rise_and_motors_fall_with_speed(self, curves):
        assert bool((curves["alpha_p"].diff("v_w") > 0.0).all())
        assert bool((curves["alpha_m"].diff("v_w") <= 1e-12).all())

    def test_a_mode_meets_a_classic_displacement_at_its_crossing_and_not_before(self, curves):
        v = float(curves["v_w_cross"].sel(mode="ssc", classic="ns"))
        at = setting_curves(load(E250), modes=["ns", "ssc"], v_w=[f"{x!r} m/s" for x in (0.99 * v, v)], load="100 t")[
            "alpha_m"
        ]
        assert float(at.sel(mode="ssc")[1]) == pytest.approx(float(at.sel(mode="ns")[1]), abs=SAME)
        assert float(at.sel(mode="ssc")[0]) > float(at.sel(mode="ns")[0])
        assert math.isnan(float(curves["v_w_cross"].sel(mode="ns", classic="ns")))

    def test_points_are_those_of_the_whole_plant(self, curves):
        at = curves.sel(mode="ns").isel(v_w=25)
        crane, v = load(E250), float(at["v_w"])
        o = operating_point(
            crane, v, float(at["alpha_m"]), load=100e3, s_w=wire_out_on(crane, crane.drum.layers), v_tip=-v
        )
        assert float(at["alpha_p"]) == pytest.approx(o.alpha_p, abs=1e-12)


class TestLimits:
    @pytest.mark.thorough
    @pytest.mark.parametrize("units", ["library", "small"])
    @pytest.mark.parametrize("name", [C150, E250, PURE])
    @pytest.mark.parametrize("way", list(Direction))
    def test_the_limit_that_binds_is_used_up_and_the_others_are_not(self, name, way, units):
        for share in (0.0, 1.0):
            s = outer(name, share, way, units)
            for top in (s.top_of_mode(Mode.NS), s.top_of_mode(Mode.SSC), s.top_of_machine()):
                o, a = top.point, s.crane.active
                assert abs(o.alpha_p) <= 1.0 + SAME
                assert max(o.p_a, o.p_b) <= a.relief.p * (1.0 + SAME)
                assert min(o.p_a, o.p_b) > 0.0  # the boost pump keeps the low line filled
                assert o.alpha_m >= s.alpha_reserve - SAME
                assert o.omega_m * s.sign == pytest.approx(top.v_w / s.winch.geometry.r_eff)
                used = {
                    Limit.PUMP: abs(o.alpha_p),
                    Limit.PRESSURE: max(o.p_a, o.p_b) / a.relief.p,
                    Limit.POWER: power_used(s.crane, o),
                    Limit.RESERVE: s.alpha_reserve / o.alpha_m,
                    Limit.PASSIVE: abs(o.omega_m) * s.alpha_pm / s.crane.passive.motor.n_max_full
                    if s.crane.passive
                    else math.nan,
                }
                assert used[Limit.POWER] <= 1.0 + SAME
                assert used[top.binds] == pytest.approx(1.0, abs=CORNER)

    @pytest.mark.thorough
    def test_no_mode_goes_faster_than_the_machine(self):
        for name in (C150, E250, PURE):
            few = envelope(small(name), loads=["60 %", "100 %"], modes=["ns", "hs", "ssc"])
            for data in (envelope_of(name), few):
                v = data["v_w_top"]
                assert bool((v.fillna(0.0) <= v.sel(mode=PHYSICAL) * (1.0 + SAME)).all())

    @pytest.mark.long
    @pytest.mark.parametrize("name", [C150, pytest.param(E250, marks=pytest.mark.thorough), PURE])
    def test_hoisting_gets_slower_with_the_load(self, name):
        v = envelope_of(name)["v_w_top"].sel(direction="hoisting", mode=["ns", "ssc", PHYSICAL])
        assert bool((v.diff("load") < 0.0).all())

    @pytest.mark.parametrize("name", [C150, pytest.param(E250, marks=pytest.mark.thorough), PURE])
    def test_the_machine_is_slower_on_inner_layers(self, name):
        v = envelope_of(name)["v_w_top"].sel(mode=PHYSICAL, load=0.0)
        assert bool((v.diff("layer") > 0.0).all())

    def test_constant_wire_force_keeps_the_speed_of_ns_on_layers_where_its_motors_are_above_their_least(self):
        crane = load(E250)
        v = envelope(crane, layers=[10, 11, 12], loads=["100 t"], modes=["ns"])["v_w_top"].sel(
            mode="ns", direction="hoisting"
        )
        assert float(v.max() / v.min()) == pytest.approx(1.0, abs=0.003)  # what leaks by speed and friction by diameter

    def test_controllers_have_the_colours_of_every_other_picture(self):
        ax = load_speed_figure(envelope_of(C150)).axes[0]
        lines = {str(line.get_label()).split(" ")[0]: line.get_color() for line in ax.lines}
        assert {name: lines[name] for name in ("ns", "hs", "ssc")} == {n: CONTROLLERS[n] for n in ("ns", "hs", "ssc")}

    def test_hs_carries_60_per_cent_of_the_swl_and_no_more(self):
        data = envelope_of(C150)
        hs = data.sel(mode="hs", direction="hoisting", layer=11)
        assert np.isfinite(hs["v_w_top"].values).tolist() == [True, True, False]
        assert [str(b) for b in hs["binds"].values[2:]] == [Limit.LOAD.value]
        assert float(data["load_most"].sel(mode="hs")) == pytest.approx(90e3)

    def test_a_heavy_load_slows_the_passive_motors_and_they_bind_at_the_swl_of_the_150_t_crane(self):
        light, heavy = outer(C150, 0.2), outer(C150, 1.0, units="endless")
        assert heavy.alpha_pm > light.alpha_pm
        top = heavy.top_of_machine()
        assert top.binds is Limit.PASSIVE
        motor = heavy.crane.passive.motor
        assert top.point.omega_m == pytest.approx(motor.n_max_full / heavy.alpha_pm, rel=SAME)

    def test_motor_speed_limit_rises_as_displacement_falls(self):
        """With pumps and power units of any size the shaft stops at n_max_full / alpha_m."""
        crane = changed(
            unlimited(E250),
            {"active": {"pump": {"D": ["5000 cm^3/rev"]}}, "passive": {"motor": {"n_max_full": "4800 rev/min"}}},
        )
        s = Station(crane, 0.0, 20.0, Direction.HOISTING)
        tops = [s.top(lambda v, a=a: a) for a in (0.95, 0.8, 0.7)]
        assert {t.binds for t in tops} == {Limit.MOTOR}
        assert [t.point.omega_m * t.point.alpha_m for t in tops] == pytest.approx([crane.active.motor.n_max_full] * 3)

    def test_best_displacement_of_the_machine_is_where_flow_and_pressure_meet(self):
        s = outer(E250, 1.0, units="endless")
        best = s.top_of_machine()
        assert best.binds is Limit.PRESSURE
        assert s.alpha_reserve < best.point.alpha_m < 1.0
        for nearby in (best.point.alpha_m - 0.01, best.point.alpha_m + 0.01):
            assert not s.top(lambda v, a=nearby: a).v_w > best.v_w

    @pytest.mark.thorough
    @pytest.mark.parametrize(("name", "share"), [(E250, 1.0), (PURE, 0.6), (PURE, 1.0)])
    @pytest.mark.parametrize("way", list(Direction))
    def test_no_displacement_gives_more_speed_where_power_binds(self, name, share, way):
        """Power has no order in the displacement: each of these has its best one elsewhere, in the middle or at an
        end."""
        s = outer(name, share, way, "small")
        best = s.top_of_machine()
        assert best.binds is Limit.POWER
        assert power_used(s.crane, best.point) == pytest.approx(1.0, abs=CORNER)
        least = max(s.crane.active.motor.alpha_min, s.alpha_reserve)
        others = [s.top(lambda v, a=a: a).v_w for a in np.linspace(least, 1.0, 14)]
        assert np.nanmax(others) <= best.v_w * (1.0 + SAME)
        assert np.nanmin(others) < 0.999 * best.v_w  # it matters which

    @pytest.mark.thorough
    def test_power_units_without_a_limit_bind_nothing(self):
        limited, free = outer(E250, 1.0, units="small"), outer(E250, 1.0, units="endless")
        assert free.top_of_machine().limits[Limit.POWER] == math.inf
        assert free.top_of_machine().v_w > limited.top_of_machine().v_w
        assert free.top_of_mode(Mode.SSC).v_w == limited.top_of_mode(Mode.SSC).v_w  # its pumps are full before

    def test_what_the_boost_pump_cannot_fill_is_no_steady_operation(self):
        """At 1,500 bar the relief valves let go more than a boost pump of 490 L/min makes up for, whatever the low
        line's pressure; a boost pump and valve without end do."""
        crane = changed(unlimited(E250), {"active": {"pump": {"D": ["5000 cm^3/rev"]}}})
        endless = changed(crane, {"active": {"boost": {"Q_max": "1e6 L/min", "conductance": "1e5 L/min/bar"}}})
        asked = {"alpha_m": 0.8, "load": 0.0, "s_w": 20.0}
        with pytest.raises(NoSteadyOperation, match="boost pump does not compensate"):
            operating_point(crane, 11.0, **asked)
        assert operating_point(endless, 11.0, **asked).relief_open

    def test_too_little_reserve_forbids_a_fixed_displacement(self):
        s = outer(PURE, 1.0)
        top = s.top(lambda v: s.alpha_reserve - 0.01)
        assert top.binds is Limit.RESERVE
        assert math.isnan(top.v_w)
        assert top.point is None

    def test_pure_active_motors_hold_the_weight_and_the_reserve(self):
        s = outer(PURE, 0.8)
        assert s.T_hold == pytest.approx(s.F_w * s.winch.geometry.r_eff)
        assert outer(C150, 0.8).T_hold == pytest.approx(0.0, abs=1e-6)

    def test_the_hyperbola_of_the_rule_passes_through_the_speed_of_ns_at_the_swl(self):
        data, s = envelope_of(C150), outer(C150, 1.0)
        ours = float(data["v_w_power_rule"].sel(layer=11, load=150e3))
        assert ours == pytest.approx(wire_speed_max(s.crane, s.crane.control.alpha_ns, s.winch.geometry.d))
        power = data["v_w_power_rule"] * (data["load"] + s.crane.hook_mass)
        assert float(power.max() / power.min()) == pytest.approx(
            1.0, abs=1e-9
        )  # the same on every layer and at every load


class TestAgainstTheEngine:
    """Runs that were not made for the envelope stop where it says."""

    @pytest.mark.parametrize(("part", "full"), [(0.97, False), (1.03, True)])
    @pytest.mark.parametrize("mode", [Mode.NS, Mode.SSC])
    def test_pumps_saturate_above_the_top_of_a_mode_and_not_below(self, mode, part, full):
        """A swell of 60 s is slow enough to be steady; the gas is held, for it moves more oil than the accumulator
        takes."""
        top = outer(C150, 0.6).top_of_mode(mode).v_w
        v = part * top
        tip = Sine.from_si(v * 60.0 / (2.0 * math.pi), 60.0)
        case = Scenario(
            load="90 t", s_w="150 m", mode=mode, tip=tip, duration="100 s", ramp="10 s", warm_up="30 s", gas_held=True
        )
        run = simulate(load(C150), case, series=False)
        assert (float(run["saturation_time"]) > 0.0) is full
        if full and mode is Mode.NS:  # SSC comes down further with the tip's speed, whatever the wire does
            assert float(run["v_w_max"]) == pytest.approx(top, rel=ENGINE)


class TestPaperC:
    def test_loads_above_90_t_go_a_quarter_faster_with_ssc(self):
        """+30 % without leakage; 24 % of it are left (validation page)."""
        crane = load(C150)
        data = envelope(crane, loads=["90.1 t"], modes=["ns", "ssc"])
        assert 0.2 < float(gain(data, "ssc", "ns").min()) < crane.control.alpha_ns / crane.active.motor.alpha_min - 1.0

    def test_without_leakage_all_30_per_cent_are_there(self):
        tight = {"motor": {"C_1": "0 L/min/bar", "C_2": "0 L/min/bar/(rev/min)"}, "pump": {"leak_scale": 1e-9}}
        data = envelope(changed(load(C150), {"active": tight}), loads=["90.1 t"], modes=["ns", "ssc"])
        assert float(gain(data, "ssc", "ns").min()) == pytest.approx(0.30, abs=0.002)

    def test_leakage_keeps_linear_ssc_from_its_least_displacement(self):
        top = outer(C150, 0.6).top_of_mode(Mode.SSC)
        assert top.binds is Limit.PUMP
        assert top.point.alpha_m > 0.71


class TestRefusals:
    @pytest.mark.parametrize(
        ("asked", "told"),
        [
            ({"layers": []}, "layers 1 to 11"),
            ({"loads": []}, "at least one value with its unit"),
            ({"loads": [100e3]}, "a bare number; write it as text with its unit"),
            ({"loads": ["100 m"]}, "not one of kg, t, te"),
            ({"modes": 3}, "give a list"),
            ({"reserve": 1.5}, "from 0 to 1"),
        ],
    )
    def test_bad_input_is_one_line(self, asked, told):
        with pytest.raises(StillhookError, match=told):
            envelope(load(C150), **asked)

    def test_every_number_has_a_unit_and_a_meaning(self):
        for data in (envelope_of(C150), setting_curves(load(C150), modes=["ns"], v_w=["1 m/s"])):
            for name in data.data_vars:
                assert data[name].attrs["long_name"], name

    def test_progress_ends_at_one(self):
        told = []
        envelope(load(PURE), loads=["0 t"], modes=["ns"], progress=told.append)
        assert told[-1] == pytest.approx(1.0)
        assert told == sorted(told)
