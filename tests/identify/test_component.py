"""Components from data of their own: printed tables, closed forms, a twin with known lines, and refusals of one line."""

import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete, dlsim
from tests.engine.runs import run_one

from stillhook import Scenario, load_crane, simulate
from stillhook.cli import run
from stillhook.errors import IdentifyError, LogError, SpecError, StillhookError
from stillhook.identify import crane_with, identify_component
from stillhook.identify.component.result import component_settings
from stillhook.library import changed, crane_from_toml, crane_toml, leak_table
from stillhook.library.leakage import pump_leak
from stillhook.units import parse

CONDUCTANCE = parse("1 L/min/bar", "leakage")
TABLE_2_5_AND_2_6 = {
    1500: (0.034, 0.024, 0.027, 0.030, 0.030),
    2000: (0.057, 0.039, 0.040, 0.037, 0.035),
}
"""Printed conductances [L/min/bar] at 355, 284 (printed: 384), 213, 142 and 71 cm^3/rev, by speed [rev/min]."""
SIZES = (355, 284, 213, 142, 71)


def table(folder, heading, rows, name="leak.csv"):
    path = folder / name
    path.write_text("\n".join([heading, *(",".join(map(repr, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


def mapping(folder, **settings):
    path = folder / "mapping.toml"
    path.write_text("[component]\n" + "".join(f'{k} = "{v}"\n' for k, v in settings.items()), encoding="utf-8")
    return path


def printed_tables(folder, pressures=(100, 225, 350)):
    rows = [
        (D, n, dp, C * dp, C * dp / 4.0)
        for n, values in TABLE_2_5_AND_2_6.items()
        for D, C in zip(SIZES, values, strict=True)
        for dp in pressures
    ]
    return table(folder, "D [cm^3/rev],n [rev/min],dp [bar],Q_leak [L/min],Q_case [L/min]", rows)


def motor_rows(C, eta=None):
    """A motor's flows: D [cm^3/rev], n [rev/min], dp [bar], Q [L/min]; C(D, n, dp) in L/min/bar."""
    return [
        (D, n, dp, D * n / 1000.0 + C(D, n, dp) * dp)
        for D in (250, 190, 130)
        for n in (300, 900, 1500, 2100)
        for dp in (50, 150, 250, 350)
    ]


FLOWS = "D [cm^3/rev],n [rev/min],dp [bar],Q [L/min]"


def test_the_printed_leak_of_the_a4vsg_becomes_the_library_s_table(tmp_path):
    result = identify_component("pump-leakage", printed_tables(tmp_path), mapping=mapping(tmp_path, base="nov-250t"))
    library = leak_table("A4VSG355")
    for i, speed in enumerate(TABLE_2_5_AND_2_6):
        ours = [result[f"C_{part}@{speed}"].value for part in (20, 40, 60, 80, 100)]
        assert ours == pytest.approx(library.C[i], rel=1e-9)
    assert result["internal_share"].value == pytest.approx(0.75, rel=1e-9)
    crane = crane_with(result, load_crane("nov-250t"))
    assert pump_leak(crane.active.pump) == pytest.approx(pump_leak(load_crane("nov-250t").active.pump), rel=1e-5)
    assert crane.active.internal_share == pytest.approx(0.75)


def test_conductances_alone_have_no_interval(tmp_path):
    rows = [(D, n, C) for n, values in TABLE_2_5_AND_2_6.items() for D, C in zip(SIZES, values, strict=True)]
    result = identify_component("pump-leakage", table(tmp_path, "D [cm^3/rev],n [rev/min],C_leak [L/min/bar]", rows))
    assert result["C_100@2000"].value == pytest.approx(0.057 * CONDUCTANCE)
    assert math.isnan(result["C_100@2000"].low)
    assert not result.held_out


def test_a_crane_with_a_pump_s_own_table_is_read_back_alike(tmp_path):
    result = identify_component("pump-leakage", printed_tables(tmp_path), mapping=mapping(tmp_path, base="nov-250t"))
    crane = crane_with(result, load_crane("nov-250t"))
    again = crane_from_toml(crane_toml(crane), "again")
    assert again.active == crane.active
    assert (
        changed(crane, {"active": {"pump": {"leak": "A4VSG355"}, "C_leak": "3.8 L/min/bar"}}).active.pump.table is None
    )


def test_motor_leak_is_that_of_equation_2_18(tmp_path):
    law = lambda D, n, dp: 0.021 + 7e-6 * n
    result = identify_component("motor-leakage", table(tmp_path, FLOWS, motor_rows(law)))
    assert result["C_1"].value == pytest.approx(0.021 * CONDUCTANCE, rel=1e-6)
    assert result["C_2"].value == pytest.approx(parse("7e-6 L/min/bar/rpm", "leakage_per_speed"), rel=1e-6)
    assert result["beta_inverse"].value == pytest.approx(0.0, abs=1e-13)


def test_efficiency_and_flow_say_the_same(tmp_path):
    rows = motor_rows(lambda D, n, dp: 0.02 + 5e-6 * n)
    flows = identify_component("motor-leakage", table(tmp_path, FLOWS, rows))
    eta = [(D, n, dp, D * n / 1000.0 / Q) for D, n, dp, Q in rows]
    effs = identify_component("motor-leakage", table(tmp_path, "D [cm^3/rev],n [rev/min],dp [bar],eta_v [1]", eta))
    assert effs["C_1"].value == pytest.approx(flows["C_1"].value, rel=1e-9)


def test_compression_shows_by_displacement(tmp_path):
    """Oil of 15 000 bar in 40 cm^3 of dead volume and what the stroke leaves: the leak grows as the stroke falls."""
    beta, V_dead, D_max = 15000.0, 0.040, 250

    def law(D, n, dp):
        return 0.02 + 4e-6 * n + n / beta * (V_dead + 0.5 * (D_max - D) / 1000.0)

    path = table(tmp_path, FLOWS, motor_rows(law))
    result = identify_component("motor-leakage", path, mapping=mapping(tmp_path, V_dead="40 cm^3"))
    assert 1.0 / result["beta_inverse"].value == pytest.approx(parse("15000 bar", "pressure"), rel=1e-6)
    stated = identify_component(
        "motor-leakage", path, mapping=mapping(tmp_path, V_dead="40 cm^3", bulk_modulus="15000 bar")
    )
    part = np.mean([law(D, n, 0) * dp - (0.02 + 4e-6 * n) * dp for D, n, dp, _ in motor_rows(law)])
    total = np.mean([law(D, n, 0) * dp for D, n, dp, _ in motor_rows(law)])
    assert stated["compression_share"].value == pytest.approx(part / total, rel=1e-6)


def second_order(u, h, omega_n, zeta):
    """Displacement of G = omega_n^2 / (s^2 + 2 zeta omega_n s + omega_n^2), exactly, of a command held over samples."""
    A = np.array([[0.0, 1.0], [-(omega_n**2), -2.0 * zeta * omega_n]])
    B, C = np.array([[0.0], [omega_n**2]]), np.array([[1.0, 0.0]])
    *system, _ = cont2discrete((A, B, C, np.zeros((1, 1))), h)
    return dlsim((*system, h), u, x0=[u[0], 0.0])[1][:, 0]


def swivel_log(folder, unit, u, alpha, h=0.01, name="swivel.csv"):
    letters = {"pump": "p", "motor": "m"}[unit]
    rows = zip((h * np.arange(len(u))).tolist(), u.tolist(), alpha.tolist(), strict=True)
    return table(folder, f"time [s],u_{letters} [1],alpha_{letters} [1]", rows, name)


def steps(lo, hi, n=4000):
    rng = np.random.default_rng(3)
    return np.repeat(rng.uniform(lo, hi, n // 250), 250)


@pytest.mark.parametrize(
    ("unit", "omega_n", "zeta", "ends"),
    [("pump", 31.0, 0.9, (-0.9, 0.9)), ("motor", 5.0, 0.99, (0.2, 1.0))],
    ids=["eq. C 10: pump", "eq. F 4: motor"],
)
def test_printed_servos_are_met_on_their_exact_response(tmp_path, unit, omega_n, zeta, ends):
    u = steps(*ends)
    path = swivel_log(tmp_path, unit, u, second_order(u, 0.01, omega_n, zeta))
    result = identify_component("servo", path, mapping=mapping(tmp_path, base="nov-250t"))
    assert result["omega_n"].value == pytest.approx(omega_n, rel=2e-3)
    assert result["zeta"].value == pytest.approx(zeta, rel=2e-3)
    assert result["dead_time"].value == pytest.approx(0.0, abs=1e-3)
    servo = getattr(crane_with(result, load_crane("nov-250t")).active, unit).servo
    assert servo.omega_n == pytest.approx(omega_n, rel=5e-3)


def test_dead_time_offset_hysteresis_and_rates_by_direction_are_told_apart(tmp_path):
    """Straight lines at 0.5 and 0.35 1/s, 40 ms late, 6 % above a command with 4 % of play: no law of second order."""
    h, u = 0.01, steps(0.25, 0.9, 6000)
    held, alpha, x = u[0], np.empty(len(u)), u[0] + 0.06
    v = 0.0
    for k in range(len(u)):
        held = min(max(held, u[max(k - 4, 0)] - 0.02), u[max(k - 4, 0)] + 0.02)
        alpha[k] = x
        for _ in range(20):
            a = 100.0 * (held + 0.06 - x) - 20.0 * v
            v = min(max(v + a * h / 20, -0.35), 0.5)
            x += v * h / 20
    result = identify_component(
        "servo", swivel_log(tmp_path, "motor", u, alpha), mapping=mapping(tmp_path, base="nov-250t")
    )
    assert result["rate"].value == pytest.approx(0.5, rel=0.03)
    assert result["rate_down"].value == pytest.approx(0.35, rel=0.03)
    assert result["half_width"].value == pytest.approx(0.02, abs=0.003)
    assert result["offset"].value == pytest.approx(0.06, abs=0.005)
    assert result["dead_time"].value == pytest.approx(0.04, abs=0.012)
    motor = crane_with(result, load_crane("nov-250t")).active.motor
    assert motor.servo.dead_time == pytest.approx(0.04, abs=0.012)
    assert motor.servo.rate_down == pytest.approx(0.35, rel=0.03)
    assert (motor.variant, motor.hysteresis) == ("open-loop-feedback", pytest.approx(0.04, abs=0.006))


def test_a_dead_time_of_the_twin_is_in_its_own_log_with_the_computing_time_of_its_plc(tmp_path):
    """Closed by the PLC, in waves: the command is logged as the PLC reads its inputs, and written a cycle later."""
    crane = changed(load_crane("nov-250t"), {"active": {"pump": {"servo": {"dead_time": "43 ms"}}}})
    case = Scenario(load="100 t", s_w="100 m", tip="sine 3 m 7 s", mode="ssc", duration="80 s", warm_up="0 s")
    run = simulate(crane, case, every="10 ms", series=True)
    alpha = run.alpha_p.values + np.random.default_rng(3).normal(0.0, 0.001, run.sizes["time"])
    path = swivel_log(tmp_path, "pump", run.u_p.values, alpha)
    result = identify_component("servo", path, mapping=mapping(tmp_path, base="nov-250t"))
    late = result["dead_time"]
    assert late.low <= 0.043 + crane.control.computing <= late.high
    assert late.half < 0.003
    servo = crane_with(result, load_crane("nov-250t")).active.pump.servo
    assert servo.dead_time == pytest.approx(late.value, abs=late.half)
    assert servo.omega_n == pytest.approx(31.0, rel=0.02)


DRY = 0.1
"""Part by which dry friction of the plate may raise omega_n, zeta and dead time, as the report's note says."""


def with_dry_friction(u, h, omega_n, zeta, dead_time, half, offset):
    """Displacement by the continuous law with a true delay and dry friction of the plate, which is not the fit's play:
    x'' = omega_n^2 (u(t - dead_time) + offset - x - half tanh(x'/v)) - 2 zeta omega_n x'."""
    t, v = h * np.arange(len(u)), 0.002
    starts = np.r_[0, np.flatnonzero(np.diff(u)) + 1]
    x, out = [u[0] + offset, 0.0], np.full(len(u), u[0] + offset)
    for k, end in zip(starts, [*(t[starts[1:]] + dead_time), t[-1] + h], strict=True):
        a, wanted = (0.0 if k == 0 else t[k] + dead_time), u[k] + offset

        def rates(_, y, wanted=wanted):
            pull = omega_n**2 * (wanted - y[0] - half * np.tanh(y[1] / v))
            return [y[1], pull - 2.0 * zeta * omega_n * y[1]]

        inside = np.flatnonzero((t >= a - 1e-12) & (t < end - 1e-12))
        solved = solve_ivp(rates, (a, end), x, t_eval=[*t[inside], end], method="Radau", rtol=1e-6, atol=1e-8)
        out[inside], x = solved.y[0, :-1], solved.y[:, -1]
    return out


@pytest.mark.long
@pytest.mark.parametrize(
    ("unit", "omega_n", "zeta", "dead_time", "offset", "half", "ends"),
    [
        ("pump", 31.0, 0.9, 0.02, 0.0, 0.0, (-0.9, 0.9)),
        ("motor", 5.0, 1.0, 0.06, 0.07, 0.0, (0.3, 0.9)),
        ("motor", 5.0, 1.0, 0.06, 0.07, 0.02, (0.3, 0.9)),
    ],
    ids=["pump of C 10 and F 6, late", "motor, late, with the offset of E 13", "the same with dry friction"],
)
def test_a_servo_integrated_apart_is_met(tmp_path, unit, omega_n, zeta, dead_time, offset, half, ends):
    u = steps(*ends, n=6000)
    noise = np.random.default_rng(7).normal(0.0, 0.002, len(u))
    alpha = with_dry_friction(u, 0.01, omega_n, zeta, dead_time, half, offset) + noise
    path = swivel_log(tmp_path, unit, u, alpha)
    result = identify_component("servo", path, mapping=mapping(tmp_path, base="nov-250t"))
    for name, true in {"omega_n": omega_n, "zeta": zeta, "dead_time": dead_time, "offset": offset}.items():
        estimate, form = result[name], DRY * true if half else 0.0
        assert estimate.low - form <= true <= estimate.high + form, name
    servo = getattr(crane_with(result, load_crane("nov-250t")).active, unit).servo
    form = DRY * dead_time if half else 0.0
    assert servo.dead_time == pytest.approx(dead_time, abs=result["dead_time"].half + form)
    assert not any("no key" in note for note in result.notes)
    assert any("dry friction of the plate" in note for note in result.notes) == bool(half)


def with_lines(name, R_1="0.002 bar/(L/min)", R_2="4e-6 bar/(L/min)^2"):
    return changed(load_crane(name), {"active": {"lines": {"R_1": R_1, "R_2": R_2}}})


def test_lines_of_a_twin_are_found_in_its_own_log(tmp_path):
    """Steady and swinging flows of a pure active winch; half of each line carries the pumps' flow, which is more by what
    leaks."""
    crane = with_lines("nov-100t-pure-active")
    case = Scenario(load="40 t", s_w="200 m", tip="sine 1.5 m 12 s", mode="ssc", duration="100 s")
    result = run_one(crane, case, n_sub=5, every=1)
    names = ("p_a_pump", "p_a_motor", "p_b_pump", "p_b_motor")
    rows = zip(
        (result.dt * np.arange(len(result.series))).tolist(),
        *(result.column(n).tolist() for n in (*names, "alpha_m", "omega_m")),
        strict=True,
    )
    heading = "time [s]," + ",".join(f"{n} [Pa]" for n in names) + ",alpha_m [1],omega_m [rad/s]"
    path = table(tmp_path, heading, rows)
    found = identify_component("lines", path, mapping=mapping(tmp_path, base="nov-100t-pure-active"))
    for line in "ab":
        assert found[f"R_1_{line}"].value == pytest.approx(crane.active.lines.R_1, rel=0.06)
        assert found[f"R_2_{line}"].value == pytest.approx(crane.active.lines.R_2, rel=0.02)
    assert crane_with(found, load_crane("nov-100t-pure-active")).active.lines.R_2 > 0.0


@pytest.mark.parametrize(
    ("heading", "rows", "line"),
    [
        ("D [cm^3/rev],n [rev/min],dp [bar]", [(250, 1000, 100)] * 5, 'no column with the leak. Choose one of "C_leak'),
        ("D [cm^3/rev],n [rev/min],Q_leak [L/min]", [(250, 1000, 3)] * 5, 'no column "dp [bar]" says at what pressure'),
        (
            "D [cm^3/rev],n [rev/min],dp [bar],Q_leak [L/min]",
            [(250, 1000, 100, 2.0)] * 5,
            "one speed only (1000 rev/min)",
        ),
        (FLOWS, [(250, 1000, 100, 20.0)] * 5, "0 of 5 rows hold a leak (5 rows left out for a negative leak"),
        (
            "D [m^3/rad],n [rev/min],dp [bar],Q_leak [L/min]",
            [(250, 900, 100, 2.0)] * 5,
            "Check the number and the unit.",
        ),
        ("D [cm^3/rev],n [rev/min],dp [bar],eta_v [%]", [(250, 900, 100, 120.0)] * 5, "volumetric efficiency 120 %"),
    ],
    ids=["no leak", "no pressure", "one speed", "delivery read as demand", "unit", "efficiency"],
)
def test_tables_that_say_nothing_are_refused_in_one_line(tmp_path, heading, rows, line):
    with pytest.raises(StillhookError) as problem:
        identify_component("motor-leakage", table(tmp_path, heading, rows))
    assert line in str(problem.value)
    assert "\n" not in str(problem.value)


def test_logs_that_say_nothing_are_refused_in_one_line(tmp_path):
    u = steps(0.2, 1.0)
    still = swivel_log(tmp_path, "motor", np.full(1000, 0.5), np.full(1000, 0.5), name="still.csv")
    per_cent = swivel_log(tmp_path, "motor", 100.0 * u, 100.0 * second_order(u, 0.01, 5.0, 1.0), name="per-cent.csv")
    slow = second_order(u, 0.01, 31.0, 0.9)[::10]
    cases = {
        still: "the command u_m moves by 0 of full displacement",
        per_cent: "is beyond 1.5",
        swivel_log(tmp_path, "motor", u[::10], slow, 0.1, "slow.csv"): "does not show a response of",
        table(
            tmp_path, "time [s],p_a [bar]", [(0.1 * k, 100.0 + k % 3) for k in range(400)], "p.csv"
        ): "Map u_p and alpha_p",
    }
    for path, line in cases.items():
        with pytest.raises((IdentifyError, LogError), match=r"\.csv") as problem:
            identify_component("servo", path)
        assert line in str(problem.value), path
    with pytest.raises(IdentifyError, match="no line has the pressures at both ends"):
        identify_component("lines", still)
    with pytest.raises(IdentifyError, match='component = "valve": not one of motor-leakage'):
        identify_component("valve", still)


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ({"base": "nov-100t-pure-active", "circuit": "passive"}, "has no such circuit (active)"),
        ({"base": "nov-999t"}, "nov-999t"),
        ({"circuit": "middle"}, "component"),
        ({"colour": "red"}, "colour"),
        ({"V_dead": "40 kg"}, "V_dead"),
    ],
)
def test_a_mapping_that_cannot_be_is_refused(tmp_path, settings, line, capsys):
    path = printed_tables(tmp_path)
    assert (
        run(["identify", "component", "pump-leakage", str(path), "--mapping", str(mapping(tmp_path, **settings))]) == 2
    )
    error = capsys.readouterr().err
    assert line in error
    assert len(error.splitlines()) == 1


def test_the_command_line_writes_a_crane_file_that_loads(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = printed_tables(tmp_path)
    mine = tmp_path / "mine.toml"
    mine.write_text('base = "nov-250t"\n[active.pump]\nleak_scale = 1.5\n', encoding="utf-8")
    arguments = [
        "identify",
        "component",
        "pump-leakage",
        str(path),
        "--mapping",
        str(mapping(tmp_path, base="mine.toml")),
    ]
    assert run([*arguments, "--out", "made", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["parameters"]["C_100@2000"]["value"] == pytest.approx(0.057 * CONDUCTANCE)
    mine.unlink()  # its base is in the folder above
    crane = load_crane((tmp_path / "made" / "crane.toml").rename(tmp_path / "elsewhere.toml"))
    assert crane.active.pump.leak_scale == 1.0
    assert pump_leak(crane.active.pump) == pytest.approx(pump_leak(load_crane("nov-250t").active.pump), rel=1e-5)
    page = (tmp_path / "made" / "report.html").read_text(encoding="utf-8")
    assert "Held-out data" in page
    assert "What the twin does with it" in page


def test_a_table_of_a_pump_that_is_none_is_refused(tmp_path):
    rows = {"D_ref": "355 cm^3/rev", "omega": ["2000 rpm", "1500 rpm"]}
    rows |= {f"C_{part}": ["0.03 L/min/bar"] * 2 for part in (20, 40, 60, 80, 100)}
    with pytest.raises(SpecError, match="omega must rise"):
        changed(load_crane("nov-250t"), {"active": {"pump": {"table": rows}}})
    rows |= {"omega": ["1500 rpm"]}
    with pytest.raises(SpecError, match="needs 1 values"):
        changed(load_crane("nov-250t"), {"active": {"pump": {"table": rows}}})


def test_the_base_of_a_mapping_keeps_to_its_folder(tmp_path):
    for base in ("/etc/passwd", "../crane.toml", "//host/share/crane"):
        with pytest.raises(IdentifyError, match="leads out of the folder of this file"):
            component_settings(mapping(tmp_path, base=base))
