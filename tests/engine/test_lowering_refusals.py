"""What a lowering refuses, each in one line before anything compiles, and what becomes of extreme ones."""

from functools import cache

import numpy as np
import pytest

from stillhook import load_crane
from stillhook.engine.lowering.case import LoweringType
from stillhook.engine.lowering.run import longest_step
from stillhook.engine.simulate import run_cases, simulate
from stillhook.errors import LiftError, SimulationError, SpecError
from stillhook.sea.motion.motion import Profile, Sine
from stillhook.sea.vessel.realisation import WaveField
from stillhook.spec.crane import Crane
from stillhook.spec.lift.lowering import DeepWire, Lowering
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.phase import Phase
from stillhook.spec.scenario import Sensors


@cache
def crane() -> Crane:
    return load_crane("nov-250t")


def lift(mass: str = "100 t", V: float = 10.0, **more: object) -> Lowering:
    levels = tuple({"h": f"{h} m", "V": f"{V * h / 5!r} m^3", "A33": mass, "A_p": "20 m^2"} for h in (0.0, 5.0))
    fields = {
        "h_tip": "20 m",
        "depth": "2000 m",
        "start_depth": "50 m",
        "programme": (Phase(mode="ahc", time="20 s"),),
        "duration": "40 s",
    }
    return Lowering(payload=Payload(name="box", mass=mass, height="5 m", C_D=2.0, levels=levels), **(fields | more))


def water(n: int = 402, dt: float = 0.1, levels: int = 4) -> WaveField:
    return WaveField(
        dt=dt, eta=np.zeros(n), eta_dot=np.zeros(n), w=np.zeros((n, levels)), a=np.zeros((n, levels)), z_0=2.0, ds=0.2
    )


@pytest.mark.parametrize(
    ("case", "said"),
    [
        (lift("400 t"), 'Payload 400 t exceeds the SWL 250 t of "nov-250t"'),
        (lift("5 t"), "it floats"),
        (lift(start_depth="2000 m"), "the payload would lie on the seabed"),
        (lift(start_depth="-20 m"), "the hook would be above the crane tip"),
        (lift(start_depth="2900 m", depth="3000 m"), 'and "nov-250t" can pay out'),
        (lift(waves=water(100)), "longer than the waves, 9.9 s"),
        (lift(waves=water(dt=2.0)), "samples every 2 s"),
        (lift(waves=water(levels=1)), "fewer than 2 levels"),
        (lift(controller="manual"), "does not compensate"),
        (lift(programme=()), "no phases"),
    ],
)
def test_a_lift_that_cannot_be_is_refused_in_one_line(case: Lowering, said: str) -> None:
    with pytest.raises(LiftError) as e:
        simulate(crane(), case)
    assert said in str(e.value)
    assert "\n" not in str(e.value)


def test_steps_that_do_not_fit_are_refused() -> None:
    hard = crane().model_copy(update={"friction": crane().friction.model_copy(update={"sigma_0": 1e7})})
    with pytest.raises(SpecError, match=r"too long for this lift: .* Use a step of "):
        simulate(hard, lift())
    case = lift()
    rock = case.payload.seabed.model_copy(update={"settlement": 1e-5})
    on_rock = case.model_copy(update={"payload": case.payload.model_copy(update={"seabed": rock})})
    with pytest.raises(SpecError, match="seabed"):
        run_cases(crane(), on_rock, step=2)


def test_a_stiff_winch_is_run_with_a_shorter_step_unasked() -> None:
    stiff = crane().model_copy(update={"friction": crane().friction.model_copy(update={"sigma_0": 4e5})})
    longest = longest_step(stiff, lift())
    assert 1e-3 < longest < 5e-3
    for given in (lift(), [lift()]):
        assert simulate(stiff, given).attrs["step"] == 2.5e-3
    assert simulate(crane(), lift()).attrs["step"] == 5e-3


@pytest.mark.slow
def test_a_lift_without_numbers_spoils_no_other() -> None:
    bad = water()
    bad.w[200:] = np.nan
    cases = [lift(), lift(waves=water()), lift(waves=bad)]
    with pytest.raises(SimulationError, match="1 of 3"):
        simulate(crane(), cases)
    run = simulate(crane(), cases, on_failure="mark")
    assert list(run.status.values) == ["ok", "ok", "diverged"]
    assert np.isnan(run.F_w_max.values[2])
    assert run.F_w_max.values[0] == run.F_w_max.values[1]  # water that stands is still water


@pytest.mark.slow
@pytest.mark.parametrize("mass", ["100 kg", "1 t", "250 t"])
@pytest.mark.parametrize("start_depth", ["0 m", "1900 m"])
def test_light_and_heavy_loads_on_short_and_long_wire_keep_their_energy(mass: str, start_depth: str) -> None:
    run = simulate(
        crane(),
        lift(mass, V=0.0001, start_depth=start_depth, tip=Sine(amplitude="1 m", period="8 s")),
        on_failure="mark",
    )
    assert str(run.status.values) in ("ok", "overload", "peak load")
    assert abs(float(run.energy_unaccounted)) < 1e-3
    assert float(run.eta_c) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("nodes", [1, 100])
def test_any_number_of_nodes_runs(nodes: int) -> None:
    run = simulate(crane(), lift(wire=DeepWire(nodes=nodes), start_depth="1900 m"))
    assert str(run.status.values) == "ok"


def test_noise_reaches_the_plc_and_not_the_load() -> None:
    quiet, noisy = (
        simulate(crane(), lift(sensors=s))
        for s in (Sensors(), Sensors(noise_v_tip="20 mm/s", noise_F="5 kN", delay="0.1 s"))
    )
    assert float(noisy.u_p.std()) > 10.0 * float(quiet.u_p.std())
    assert float(np.ptp(noisy.z_load.values)) < 0.05


def test_slings_never_push_and_a_slack_lift_is_told() -> None:
    tip = Profile.from_si([0.0, 2.0, 6.0, 8.0], [0.0, -4.0, -4.0, 0.0])
    run = simulate(
        crane(),
        lift("15 t", start_depth="20 m", tip=tip, ramp="0 s", programme=(Phase(mode="manual", time="20 s"),)),
        every="10 ms",
    )
    assert "sling" in str(run.status.values)
    assert float(run.F_sling.min()) == 0.0
    assert float(run.sling_slack_time) > 1.0
    assert float(run.snap) > 0.0


def test_a_phase_that_never_ends_is_reported() -> None:
    run = simulate(crane(), lift(programme=(Phase(mode="manual", speed="6 m/min", depth="1900 m", timeout="10 s"),)))
    assert "stuck" in str(run.status.values)
    assert "did not end within its timeout of 10 s" in str(run.notes.values)


@pytest.mark.parametrize(
    ("phases", "said"),
    [
        (
            [{"mode": "splash", "speed": "-12 m/min", "depth": "80 m"}],
            'phase "1 splash": speed = -12 m/min hoists, and it ends at 80 m',
        ),
        (
            [{"mode": "ahc", "speed": "12 m/min", "depth": "50 m"}],
            "is 54.87 m of wire out, with 54.87 m out at its beginning",
        ),
        (
            [{"mode": "ahc", "speed": "12 m/min", "wire": "30 m"}],
            "speed = 12 m/min pays wire out, and wire = 30 m",
        ),
        (
            [{"mode": "landing", "speed": "6 m/min", "tension": "950 kN", "time": "9 s"}],
            "would lift the load again: payload and hook weigh 909.6 kN",
        ),
    ],
)
def test_phases_that_end_before_they_begin_or_lift_what_they_landed_are_refused(
    phases: list[dict[str, str]], said: str
) -> None:
    with pytest.raises(LiftError, match=said):
        simulate(crane(), lift(programme=tuple(Phase(**s) for s in phases)))


def test_wire_counts_as_load_at_the_crane_tip() -> None:
    deep = (Phase(mode="ahc", speed="60 m/min", depth="1900 m"),)
    with pytest.raises(LiftError, match=r"payload, hook and wire pull 2\d+ kN at the crane tip"):
        simulate(crane(), lift("230 t", programme=deep))
    LoweringType().ready([crane()], [lift("180 t", programme=deep)], 2)
