"""The C core where the vessel moves the tip, against a run that is moved alike."""

import numpy as np
import pytest
from tests.export.twin.host import OK, Host

import stillhook
from stillhook.engine.inputs import CycleInputs
from stillhook.export.fmu import write_fmu
from stillhook.export.twin import ExportError, export
from stillhook.sea.vessel.vessel_tip import VESSEL

BOOM = "x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg"
CLOSE = 1e-11  # m: of other flags of a compiler, and of the boom's height, 40 m, whose rounding is in the tip's
MOVES = {"slew": [("2 s", "9 s", "240 deg")], "luff": [("3 s", "9 s", "55 deg")]}
SWELL = {"heave": "sine 1 m 9 s", "roll": "sine 2 deg 12 s", "pitch": "sine 1 deg 8 s"}


def case_of(unit: stillhook.MotionUnit | None = None) -> stillhook.Scenario:
    tip = stillhook.VesselTip(BOOM, **SWELL, **MOVES, unit=unit)
    return stillhook.Scenario(
        load="100 t", s_w="100 m", tip=tip, mode="ssc", duration="10 s", ramp="0 s", warm_up="0 s"
    )


def rows(tip: stillhook.VesselTip, t: np.ndarray, given: stillhook.VesselTip) -> list[dict[str, float]]:
    """What a host gives: the vessel's motion, the boom's angles, and the heave of another unit."""
    jets = [*tip._attitude(t), *tip._pose(t), given.signals(0.01).at(t).heave]
    columns = np.column_stack([np.broadcast_to(x, t.shape) for jet in jets for x in jet])
    return [dict(zip(VESSEL, row, strict=True)) for row in columns.tolist()]


@pytest.mark.long
@pytest.mark.parametrize("ahead", [True, False])
def test_a_host_with_a_vessel_gets_the_run_of_a_vessel(ahead, compiled):
    """The host makes the filter, the core the tip's kinematics; the run has both."""
    crane, filtered = stillhook.load_crane("nov-250t"), case_of(stillhook.MotionUnit(heave_period="25 s"))
    made = export(crane, case_of(), coupling="vessel")
    run = stillhook.simulate(crane, filtered, every="10 ms")
    t = np.arange(CycleInputs(crane, filtered).n_ticks + 1) * 0.01
    inputs = rows(filtered.tip, t, filtered.tip)
    host = Host(made, compiled)
    host.set(input_time=0 if ahead else 1, **inputs[0])
    assert host.start() == OK
    found = {name: [host.get(name)] for name in ("e_c", "s_w", "F_w")}
    for k in range(len(t) - 1):
        host.set(**inputs[k + 1 if ahead else k])
        assert host.step(k * 0.01, 0.01) == OK
        if not ahead:
            host.set(**inputs[k + 1])
        for name, values in found.items():
            values.append(host.get(name))
    close = CLOSE if ahead else 1e-4  # the acceleration of slewing steps, and is held over a cycle
    n = min(len(run.time), len(t))
    for name in ("e_c", "s_w"):
        assert np.abs(np.array(found[name])[:n] - run[name].values[:n]).max() < close
    assert np.ptp(found["s_w"]) > 0.5


def test_a_state_of_a_host_with_a_vessel_is_restored(compiled):
    case = case_of()
    made = export(stillhook.load_crane("nov-250t"), case, coupling="vessel")
    inputs = rows(case.tip, np.arange(41) * 0.01, case.tip)
    host = Host(made, compiled)
    host.set(input_time=0, **inputs[0])
    assert host.start() == OK
    saved = b""
    for k in range(40):
        if k == 20:
            saved = host.save()
        host.set(**inputs[k + 1])
        assert host.step(k * 0.01, 0.01) == OK
    expected = host.get("s_w")
    host.restore(saved)
    for k in range(20, 40):
        host.set(**inputs[k + 1])
        assert host.step(k * 0.01, 0.01) == OK
    assert host.get("s_w") == expected


def test_an_fmu_names_what_the_vessel_gives(tmp_path):
    made = export(stillhook.load_crane("nov-250t"), case_of(), coupling="vessel")
    write_fmu(made, tmp_path / "vessel.fmu", fmi="2", platforms=["source"])
    port = made.port("a_roll")
    assert (port.unit, port.description) == ("rad/s^2", "acceleration of roll, port side up positive")
    assert made.port("slew").start == pytest.approx(np.radians(270.0))
    assert not {"s_tip", "v_tip", "a_tip"} & {each.name for each in made.ports if each.causality == "input"}


def test_a_coupling_without_a_boom_and_a_filter_of_the_unit_are_refused():
    crane = stillhook.load_crane("nov-250t")
    plain = case_of().model_copy(update={"tip": stillhook.Sine(amplitude="1 m", period="9 s")})
    with pytest.raises(ExportError, match=r"coupling vessel: the case's tip has no boom."):
        export(crane, plain, coupling="vessel")
    with pytest.raises(ExportError, match=r"unit: filter, delay and noise of the motion unit are not exported"):
        export(crane, case_of(stillhook.MotionUnit(heave_period="25 s")), coupling="vessel")
    with pytest.raises(ExportError, match=r"coupling vessel: a controller alone has no wire and no tip."):
        export(crane, case_of(), "controller", "vessel")
