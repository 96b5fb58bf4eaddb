"""Another clock in a log is brought to where the PLC saw the same, to a fraction of a sample; how late wire and tip are is told."""

import numpy as np
import pytest
from tests.validate.crane_logs import COLUMNS, ahc, changed, manual, read, signals, with_clock

from stillhook.errors import ValidateError
from stillhook.statistics.time_lag import lag

pytestmark = pytest.mark.slow

PROMPT = 1e-3  # s: what AHC asks of a clock: 1 mm at 1 m/s
ROUGH = 20e-3  # s: what the feedforward tells without knowing filters
TIP = ("s_tip", "v_tip", "a_tip")


def by_another_clock(frame, offset, drift, names=TIP):
    """Every row holds what each logger had at that row; the second one started `offset` later and its stamps run fast by `drift`."""
    t = frame["Time"].to_numpy()
    for name in names:
        heading = COLUMNS[name][0]
        frame = changed(frame, heading, np.interp(t + offset, t, frame[heading].to_numpy()))
    return (
        changed(frame, "T2", np.round(t * (1.0 + drift), 5))
        if "T2" in frame.columns
        else frame.assign(T2=np.round(t * (1.0 + drift), 5))
    )


def left(record, frame, name):
    """Lag of a signal of a record behind the log before it was spoiled [s], at its ends."""
    heading, _, factor = COLUMNS[name]
    true = np.interp(record.t + record.zero, frame["Time"].to_numpy(), frame[heading].to_numpy() / factor)
    found = lag(record.t, true, record.signals[name], 1.0)
    assert found is not None
    return found.at(np.array([0.0, record.t[-1]]))


@pytest.mark.thorough
@pytest.mark.parametrize(("offset", "drift"), [(0.0, 0.0), (2.7, 2e-5), (-1.3, 1e-3), (0.4, 5e-3), (2.0, -5e-3)])
def test_a_tip_of_another_clock_is_brought_to_where_the_plc_saw_it(tmp_path, offset, drift):
    frame = ahc(170.0)
    record = read(tmp_path, by_another_clock(frame, offset, drift), rows=signals(**with_clock(*TIP)))
    assert np.abs(left(record, frame, "s_tip")).max() < PROMPT
    (clock,) = record.clocks
    assert clock.signals == TIP
    assert clock.drift == pytest.approx(1.0 / (1.0 + drift) - 1.0, abs=2e-5)
    assert clock.offset == pytest.approx(
        offset, abs=0.03
    )  # of its first stamp: drift times the time until it is seen comes in
    assert clock.u < PROMPT
    assert record.statements[0].startswith('Test "1": the clock of s_tip, v_tip, a_tip is ')
    assert "by the error of the PLC and wire out, to +- 0." in record.statements[0]
    assert len(record.segments) == 1


@pytest.mark.parametrize(
    ("names", "against"),
    [(("s_w", "v_w"), "tip height and the error of the PLC"), (("e_c_measured",), "tip height and wire out")],
)
def test_wire_or_error_of_another_clock_are_found_by_the_other_two(tmp_path, names, against):
    frame = ahc(170.0)
    record = read(tmp_path, by_another_clock(frame, 1.5, 1e-4, names), rows=signals(**with_clock(*names)))
    assert np.abs(left(record, frame, names[0])).max() < PROMPT
    assert record.clocks[0].against == against


def test_without_the_error_of_the_plc_its_feedforward_tells_to_some_hundredths(tmp_path):
    frame = ahc(170.0)
    record = read(tmp_path, by_another_clock(frame, 1.5, 1e-4), rows=signals(**with_clock(*TIP), e_c_measured=None))
    assert np.abs(left(record, frame, "s_tip")).max() < ROUGH
    assert record.clocks[0].against == "the feedforward in the pump command"
    assert record.clocks[0].u == pytest.approx(0.01, rel=0.1)


def test_without_either_it_is_said_that_the_clock_is_only_near(tmp_path):
    frame = ahc(170.0)
    record = read(
        tmp_path, by_another_clock(frame, 1.5, 1e-4), rows=signals(**with_clock(*TIP), e_c_measured=None, u_p=None)
    )
    assert "could only be brought near that of the log" in record.statements[0]
    assert record.clocks[0].against == ""
    assert np.abs(left(record, frame, "s_tip")).max() < 0.2


def test_a_clock_that_no_sound_clock_is_is_named(tmp_path):
    record = read(tmp_path, by_another_clock(ahc(170.0), 0.5, 5e-3), rows=signals(**with_clock(*TIP)))
    assert any("which no sound clock does" in text for text in record.statements)


def test_a_tip_at_rest_with_a_clock_of_its_own_is_left_out_of_a_test_that_needs_none(tmp_path):
    frame = by_another_clock(manual(), 1.0, 1e-4)
    record = read(tmp_path, frame, kind="dynamics", test='load = "0 t"', rows=signals(**with_clock(*TIP)))
    assert len(record.segments) == 1
    assert any("left out, for the clock" in text for text in record.statements)


def test_of_one_clock_nothing_is_moved(tmp_path):
    frame = ahc()
    record = read(tmp_path, frame)
    assert record.statements == ()
    assert np.abs(left(record, frame, "s_tip")).max() < 0.2 * PROMPT


def test_an_error_of_the_plc_in_another_unit_is_refused(tmp_path):
    rows = signals(e_c_measured='{ column = "AHC error", unit = "cm" }')
    with pytest.raises(ValidateError) as caught:
        read(tmp_path, ahc(), rows=rows)
    assert str(caught.value).startswith('test "1": e_c_measured is 1')
    assert "times tip height less wire out. Check the units of e_c_measured, s_tip and s_w" in str(caught.value)


@pytest.mark.parametrize("late", [-0.0837, 0.0, 0.0123])
@pytest.mark.parametrize("drift", [0.0, 3e-4])
def test_a_lag_is_found_to_a_tenth_of_a_sample_and_its_uncertainty_is_true(late, drift):
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 200.0, 0.01)
    wave = lambda s: sum(a * np.sin(w * s + p) for a, w, p in ((0.5, 0.6, 0.0), (0.3, 0.85, 1.0), (0.2, 1.1, 2.0)))
    x = wave(t) + 2e-3 * rng.standard_normal(len(t))
    y = 0.97 * wave(t - late - drift * (t - 100.0)) + 5.0 + 2e-3 * rng.standard_normal(len(t))
    found = lag(t, x, y, 0.5)
    assert found is not None
    assert found.seconds == pytest.approx(late, abs=1e-3)
    assert abs(found.seconds - late) < 4.0 * found.u + 1e-5
    assert found.drift == pytest.approx(drift, abs=max(3e-6, 4.0 * found.u_drift))
    assert found.gain == pytest.approx(0.97, abs=2e-3)


def test_two_signals_that_share_no_motion_have_no_lag():
    rng = np.random.default_rng(6)
    t = np.arange(0.0, 100.0, 0.01)
    assert lag(t, np.cumsum(rng.standard_normal(len(t))), np.cumsum(rng.standard_normal(len(t))), 0.5) is None
    assert lag(t[:50], t[:50], t[:50], 0.5) is None
