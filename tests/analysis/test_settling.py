"""Settling after a step of wire speed: the test is a fair one, the time is the response's, and what never settles says
why."""

import itertools

import numpy as np
import pytest

from stillhook import Scenario, load_crane, simulate
from stillhook.analysis.maps.settling import (
    AFTER,
    BAND,
    HOLD,
    RAMP,
    _invalid_reason,
    operator_of,
    settling_map,
    settling_of,
)
from stillhook.analysis.steady.steady_state import wire_out_on
from stillhook.engine.tasks import cluster
from stillhook.errors import SimulationError, StillhookError
from stillhook.library import changed
from stillhook.metrics import settling_time

LIBRARY = load_crane("nov-250t")
CALM = changed(LIBRARY, {"wire": {"zeta": 0.95, "zeta_low": 0.95, "zeta_high": 0.95}})
"""A wire on which the load does not swing (that of paper C), so that the time is the winch's own."""
CRANE = CALM.model_copy(update={"hpu": None})
"""The same with power units without end: the joystick lifts the load, which takes a power that compensating it does
not."""
DV = 5.0 / 60.0
START = RAMP + HOLD
PLACE_TOLERANCE = 1.0  # m of 299 m on the layer: the winch lags the joystick by the control error of a ramp
HALVING_TOLERANCE = 0.021  # s: two PLC cycles; a crossing of the band may move by one on either side
BLOCK_TOLERANCE = (
    1e-9  # s: the same run alone and in a block of sixteen is the same to the bit; rounding of times is left
)


@pytest.fixture(scope="module")
def found():
    return settling_of(CRANE, loads="50 t, 150 t, 250 t", speeds="10 m/min, 40 m/min, 110 m/min")


def single(load: str, v: float, mode: str):
    """One test as a run of its own, with its series; v in m/s."""
    s_w = wire_out_on(CRANE, 12) + v * (0.5 * RAMP + HOLD)
    times = {"duration": f"{START + AFTER!r} s", "warm_up": f"{START!r} s"}
    case = Scenario(load=load, s_w=f"{s_w!r} m", mode=mode, operator=operator_of(v, DV, False), gas_held=True, **times)
    return simulate(CRANE, case, every="0.01 s")


class TestTest:
    def test_the_winch_is_steady_before_the_step_and_moves_on_at_the_new_speed(self):
        run = single("150 t", 40.0 / 60.0, "ssc")
        before = run["v_w"].sel(time=slice(START - 2.0, START - 0.01))
        assert float(np.abs(before - 40.0 / 60.0).max()) < BAND * DV
        assert float(np.abs(run["v_w"][-1] - 45.0 / 60.0)) < BAND * DV

    def test_the_step_is_made_in_the_middle_of_the_layer(self):
        run = single("150 t", 110.0 / 60.0, "ssc")
        assert float(run["s_w"].sel(time=START, method="nearest")) == pytest.approx(
            wire_out_on(CRANE, 12), abs=PLACE_TOLERANCE
        )
        assert int(np.ceil(run["layer"].min())) == int(np.ceil(run["layer"].max())) == 12

    def test_the_accumulator_s_pressure_stands(self):
        run = single("250 t", 40.0 / 60.0, "ns")
        p = run["p_hp"].sel(time=slice(START, None))
        assert float(p.max() - p.min()) < 0.01 * float(p.mean())

    def test_the_joystick_rises_smoothly_and_jumps_once(self):
        points = operator_of(1.0, DV, False).profile
        jumps = [(a, b) for a, b in itertools.pairwise(points) if a[0] == b[0]]
        assert [(b[1] - a[1]) for a, b in jumps] == pytest.approx([DV])
        assert jumps[0][0][0] == START
        assert operator_of(1.0, DV, True).profile[-1][1] == -(1.0 + DV)


class TestTime:
    @pytest.mark.slow
    def test_a_cell_is_what_the_metric_reads_from_a_run_of_its_own(self, found):
        for i, mode in enumerate(("ns", "hs", "ssc")):
            run = single("150 t", 40.0 / 60.0, mode)
            t = settling_time(run, start=f"{START!r} s", target="45 m/min", step=f"{DV!r} m/s")
            assert found.values["settling_time"][i, 1, 1, 0, 0] == pytest.approx(float(t), abs=BLOCK_TOLERANCE)
            assert found.values["alpha_m_end"][i, 1, 1, 0, 0] == float(run["alpha_m"][-1])

    @pytest.mark.slow
    def test_more_oil_in_the_lines_settles_later(self):
        soft = changed(CRANE, {"active": {"line": {"V": "160 L"}}})
        a, b = (
            settling_of(c, ["ns"], loads="150 t", speeds="40 m/min").values["settling_time"][0, 0, 0, 0, 0]
            for c in (CRANE, soft)
        )
        assert b > 1.5 * a

    @pytest.mark.slow
    def test_semi_secondary_control_settles_first_at_low_speed(self, found):
        t = found.values["settling_time"]
        assert (t[2, :, :2] < t[0, :, :2]).all()
        assert (t[0, :, :2] < t[1, :, :2]).all()

    def test_a_load_that_rings_on_its_wire_settles_later_than_the_winch(self, found):
        """A swing of zeta = 0.01 takes ln(50) / (zeta omega) to die down to 2 %: minutes, where the winch takes a
        second."""
        ringing = settling_of(LIBRARY, ["ssc"], loads="150 t, 250 t", speeds="10 m/min, 40 m/min")
        assert ringing.cause[0, :, 0, 0, 0].tolist() == ["keeps swinging"] * 2
        assert ringing.values["settling_time"][0, 0, 1, 0, 0] > 5.0 * found.values["settling_time"][2, 1, 1, 0, 0]

    @pytest.mark.slow
    def test_step_halving_does_not_move_the_time(self, found):
        fine = settling_of(CRANE, ["ssc"], loads="150 t", speeds="40 m/min", step="1 ms")
        assert fine.values["settling_time"][0, 0, 0, 0, 0] == pytest.approx(
            found.values["settling_time"][2, 1, 1, 0, 0], abs=HALVING_TOLERANCE
        )

    def test_lowering_is_the_other_way_round(self):
        data = settling_map(CRANE, ["ssc"], loads="150 t", speeds="40 m/min", lowering=True)
        assert 0.5 < float(data["settling_time"][0, 0, 0]) < 2.0
        assert data["settling_time"].attrs["units"] == "s"

    def test_blocks_do_not_change_a_cell(self, found):
        one = settling_of(CRANE, ["ssc"], loads="250 t", speeds="40 m/min", threads=1)
        assert one.values["settling_time"][0, 0, 0, 0, 0] == found.values["settling_time"][2, 2, 1, 0, 0]

    @pytest.mark.slow
    def test_a_cluster_gives_the_same_numbers_and_must_run_the_same_code(self, found, monkeypatch):
        distributed = pytest.importorskip("distributed")
        asked = {"loads": "50 t, 150 t, 250 t", "speeds": "10 m/min, 40 m/min, 110 m/min"}
        with distributed.Client(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as client:
            away = settling_of(CRANE, **asked, client=client)
            monkeypatch.setattr(cluster, "answer_to", lambda packed: b"stillhook answer other code\n")
            with pytest.raises(
                SimulationError, match=r"^cluster: a worker runs Stillhook other code, this machine .*\."
            ):
                settling_of(CRANE, **asked, client=client)
        for name, a in found.values.items():
            np.testing.assert_array_equal(away.values[name], a)
        assert (away.cause == found.cause).all()


class TestNever:
    def test_full_pumps_never_settle_and_say_so(self, found):
        assert np.isnan(found.values["settling_time"][0, 0, 2, 0, 0])
        assert found.cause[0, 0, 2, 0, 0] == "pumps saturated"

    def test_power_units_at_their_limit_are_named(self):
        """150 t and the hook at 40 m/min take 1.0 MW of 1.1 MW by their weight alone, at 10 m/min a quarter of that."""
        units = changed(CALM, {"hpu": {"P_max": "1100 kW", "P_back": "550 kW"}})
        m = settling_of(units, ["ssc"], loads="150 t", speeds="10 m/min, 40 m/min")
        assert 0.9 * units.hpu.P_max < (150e3 + units.hook_mass) * 9.81 * 40.0 / 60.0 < units.hpu.P_max
        assert m.cause[0, 0, :, 0, 0].tolist() == ["", "hydraulic power"]

    def test_classic_motors_stand_at_their_two_settings(self, found):
        assert found.values["alpha_m_end"][0, :, :2] == pytest.approx(CRANE.control.alpha_ns, abs=1e-3)
        assert found.values["alpha_m_end"][1, :, :2] == pytest.approx(CRANE.control.alpha_hs, abs=1e-3)

    def test_a_swing_is_told_from_a_slow_approach(self):
        t = np.arange(0.0, AFTER, 0.01)
        swinging = DV * (1.0 - np.cos(6.0 * t) * 0.1)
        slow = DV * 0.9 * (1.0 - np.exp(-t / 0.2))
        assert _invalid_reason(swinging - swinging[0], DV, 0.01, "") == "keeps swinging"
        assert _invalid_reason(slow, DV, 0.01, "") == "slower than 15 s"
        assert _invalid_reason(slow + 0.5 * DV, DV, 0.01, "") == "not steady before the step"
        assert _invalid_reason(slow, DV, 0.01, "pumps saturated") == "pumps saturated"

    def test_a_gain_above_marginal_stability_is_unstable(self):
        wild = changed(CRANE, {"control": {"K_p": "3 1/m"}})
        m = settling_of(wild, ["ssc"], loads="50 t", speeds="40 m/min")
        assert m.cause[0, 0, 0, 0, 0] == "unstable"

    @pytest.mark.parametrize(
        ("asked", "words"),
        [
            ({"speeds": "900 m/min"}, "on either side of its middle"),
            ({"wire_step": "0 m/min"}, "must be above 0"),
            ({"wire_step": "5 m"}, "unit"),
        ],
    )
    def test_bad_input_is_one_line(self, asked, words):
        with pytest.raises(StillhookError, match=words):
            settling_of(CRANE, **asked)
