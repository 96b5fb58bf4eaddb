"""One rule on the public face: a quantity is text with a unit, or it is refused in one line of our own error."""

import inspect
import math
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np
import pytest

import stillhook
from stillhook import analysis, metrics, response
from stillhook.cli import run
from stillhook.errors import SeaError, StillhookError, UnitError
from stillhook.formats.lift_file import load_lift
from stillhook.library import load_crane
from stillhook.sea.motion.motion import Profile, Sine
from stillhook.sea.vessel.boom import Boom

CRANE = load_crane("nov-250t")
WAVES = "jonswap Hs=2 m Tp=8 s gamma=3.3"
FACES = ("", ".analysis", ".identify", ".library", ".metrics", ".plan", ".response", ".validate")
PURE = {"alpha_m", "alpha_pp", "reserve", "K_wire", "gain_margin", "sensitivity", "spread", "band", "threshold"}
PURE |= {
    "printed",
    "values",
}  # values of a sweep over displacement or layers: pure numbers; with their unit over anything else
"""Parameters of the public face that are pure numbers."""
ARRAYS = {"forcing_of_seas", "forcing_of_series", "static_stretch", "transfers", "natural_periods"}
"""Building blocks of the frequency-domain method, which calculate on arrays and records in SI."""


def public_functions() -> list[tuple[str, Callable[..., Any]]]:
    found = []
    for face in FACES:
        module = import_module(f"stillhook{face}")
        found += [
            (f"{module.__name__}.{n}", getattr(module, n))
            for n in module.__all__
            if inspect.isfunction(getattr(module, n))
        ]
    return found


@pytest.mark.parametrize(("name", "function"), public_functions(), ids=lambda x: x if isinstance(x, str) else "")
def test_no_public_function_takes_a_quantity_as_a_bare_number(name, function):
    """A new parameter that is a float is a pure number, or it has to be text with a unit."""
    if name.rpartition(".")[2] in ARRAYS:
        assert "[" in (function.__doc__ or "") or "forcing_of_series" in (function.__doc__ or ""), "says its SI units"
        return
    for parameter in inspect.signature(function).parameters.values():
        if "float" in str(parameter.annotation) or "ArrayLike" in str(parameter.annotation):
            assert parameter.name in PURE, f"{name}({parameter.name})"


def steady_run() -> Any:
    import xarray

    t = np.arange(0.0, 60.0, 0.1)
    series = {n: ("time", np.sin(t)) for n in ("e_c", "s_tip", "v_w")}
    return xarray.Dataset(series, coords={"time": t})


POINT = {"load": "100 t", "s_w": "100 m", "v_tip": "60 m/min", "delay": "50 ms"}
CALLS: list[tuple[Callable[..., Any], dict[str, Any]]] = [
    (lambda **k: stillhook.parse_sea(WAVES, **k), {"heading": "180 deg"}),
    (lambda **k: analysis.stability(CRANE, **k), {"v_tip": "60 m/min", "delay": "50 ms"}),
    (lambda **k: analysis.full_stability(CRANE, **k), POINT),
    (lambda **k: analysis.sweep(CRANE, "delay", **k), {"values": ["0 ms", "50 ms"]}),
    (lambda **k: analysis.sweep(CRANE, "damping", **k), {"values": ["2 N m s/rad"], "delay": "10 ms"}),
    (lambda **k: analysis.strongest_gain(CRANE, **k), {"delay": "50 ms", "phase_margin": "60 deg"}),
    (lambda **k: analysis.strong_ssc(CRANE, **k), {"delay": "100 ms", "command_delay": "20 ms"}),
    (
        lambda **k: analysis.operating_point(CRANE, alpha_m=0.8, **k),
        {"v_w": "60 m/min", "load": "90 t", "s_w": "100 m", "v_tip": "-60 m/min", "V_o": "600 L"},
    ),
    (lambda **k: analysis.envelope(CRANE, modes=["ns"], **k), {"loads": ["100 t"]}),
    (lambda **k: analysis.setting_curves(CRANE, modes=["ns"], **k), {"v_w": ["30 m/min"], "load": "100 t"}),
    (lambda **k: response.Waves(stillhook.parse_sea(f"{WAVES} heading=180 deg"), **k), {"beta": "180 deg"}),
    (lambda **k: response.Waves(stillhook.parse_sea(f"{WAVES} heading=180 deg"), **k), {"ship": "180 deg"}),
    (lambda **k: metrics.e_c_pp(steady_run(), **k), {"window": "30 s"}),
    (lambda **k: metrics.settling_time(steady_run(), **k), {"start": "1 s", "target": "0 m/s", "step": "1 m/s"}),
    (lambda **k: Sine(**k), {"amplitude": "1 m", "period": "10 s", "phase": "90 deg"}),
    (lambda **k: Boom(pedestal=("0 m", "0 m", "15 m"), main=("25 m", "50 deg"), **k), {"slew": "270 deg"}),
    (lambda **k: stillhook.Scenario(**k), {"load": "100 t", "s_w": "100 m", "duration": "60 s"}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("call", "texts"), CALLS)
def test_text_with_a_unit_is_taken(call, texts):
    call(**texts)


@pytest.mark.parametrize(("call", "texts"), CALLS)
def test_a_number_without_its_unit_or_with_one_of_another_kind_is_refused_in_one_line(call, texts):
    for name, text in texts.items():
        for wrong, says in ((180.0, "unit"), ("180", "unit"), ("1 kWh", "not one of")):
            with pytest.raises(StillhookError, match=says) as error:
                call(**(texts | {name: [wrong] if isinstance(text, list) else wrong}))
            assert "\n" not in str(error.value)


def test_a_profile_of_bare_speeds_is_refused():
    with pytest.raises(StillhookError, match="bare number"):
        Profile([("0 s", 1.0)])


def test_a_heading_in_degrees_is_a_heading_in_degrees():
    """As a bare number it was taken for radians, and the motion of the tip came out 86 % too high."""
    (train,) = stillhook.parse_sea(WAVES, heading="180 deg").trains
    assert train.beta == pytest.approx(math.pi)


@pytest.mark.parametrize("heading", ["400 deg", "-30 deg", "1.01 rev", "7 rad"])
def test_a_direction_beyond_one_turn_is_refused(heading):
    for call in (
        lambda: stillhook.parse_sea(WAVES, heading=heading),
        lambda: stillhook.parse_sea(f"{WAVES} heading={heading}"),
        lambda: response.Waves(stillhook.parse_sea(f"{WAVES} heading=0 deg"), beta=heading),
    ):
        with pytest.raises(SeaError, match="not between 0 deg and 360 deg"):
            call()


@pytest.mark.parametrize("heading", ["0 deg", "360 deg", "1 rev"])
def test_one_whole_turn_is_a_direction(heading):
    assert len(stillhook.parse_sea(WAVES, heading=heading).trains) == 1


class TestEnvelope:
    @pytest.mark.slow
    def test_loads_are_texts_or_parts_of_the_swl(self):
        data = analysis.envelope(CRANE, loads=["100 t", "60 %"], modes=["ns"])
        assert data["load"].values.tolist() == [100e3, 150e3]

    def test_loads_that_fall_are_refused(self):
        with pytest.raises(StillhookError, match="the smallest first"):
            analysis.envelope(CRANE, loads=["100 t", "50 t"], modes=["ns"])


def test_limits_of_a_tuning_are_read_as_texts():
    from stillhook.analysis.controllers import controller

    with pytest.raises(UnitError, match=r"limit p_max = .*no unit"):
        analysis.tune(CRANE, controller("ssc"), limits=["p_max <= 300"])


def test_a_lift_response_has_its_depth_and_duration_in_units():
    file = load_lift("anchor-to-3000m", moving=False)
    waves = response.Waves(stillhook.parse_sea(f"{WAVES} heading=180 deg"))
    with pytest.raises(UnitError, match=r"^depth = 1500\.0: a bare number"):
        response.lift_response(file, waves, depth=1500.0)
    with pytest.raises(UnitError, match=r"^duration = 3600\.0: a bare number"):
        response.lift_response(file, waves, depth="1500 m", duration=3600.0)
    with pytest.raises(StillhookError, match="depth 4000 m"), pytest.warns(FutureWarning, match="z is depth"):
        response.lift_response(file, waves, z="-4000 m")


TIP = ("tip", "supply-vessel-82m", "--at", "x=-20 m, y=-12 m", "--wave", WAVES)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("line", "says"),
    [
        ((*TIP, "--heading", "180"), '--heading = "180": no unit; write "180 deg"'),
        ((*TIP, "--heading", "400 deg"), '--heading = "400 deg": not between 0 deg and 360 deg'),
        ((*TIP, "--heading", "180 deg", "--duration", "3"), '--duration = "3": no unit'),
        (("envelope", "nov-250t", "--loads", "100"), '--loads = "100": no unit; write "100 t"'),
        (("stability", "nov-250t", "--delay", "50"), '--delay = "50": no unit'),
        (("stability", "nov-250t", "--full", "--v-tip", "60"), '--v-tip = "60": no unit'),
        (("compare", "--load", "100"), '"100": no unit'),
        (("map", "nov-250t", "--periods", "12"), '"12": no unit'),
        (("calc", "inertia", "nov-250t", "s_w=100"), 's_w = "100": no unit'),
        (("payload", "suction-anchor-85t", "--rho", "1025"), '--rho = "1025": no unit'),
        (("response", "anchor-to-3000m", "--depth", "1500"), '--depth = "1500": no unit'),
        (("lower", "anchor-to-3000m", "--duration", "60"), '"60": no unit'),
        (
            ("weather", "persistence", "SYNTHETIC-norwegian-sea", "--limit", "Hs <= 2", "--window", "6 h"),
            '"2": no unit',
        ),
        (
            ("weather", "persistence", "SYNTHETIC-norwegian-sea", "--limit", "Hs <= 2 m", "--window", "6"),
            '--window = "6": no unit',
        ),
    ],
)
def test_the_command_line_refuses_a_number_without_its_unit_with_exit_code_2(line, says, capsys):
    assert run(list(line)) == 2
    err = capsys.readouterr().err
    assert says in err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
