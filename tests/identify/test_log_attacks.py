"""Whatever is given as a log, the answer is a log or one line; memory does not grow with the file."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from stillhook.errors import StillhookError
from stillhook.logs import log as log_module
from stillhook.logs.log import mapping_from, read_log

MAPPING = mapping_from({"time": {"column": 1, "unit": "s"}, "p_a": {"column": 2, "unit": "bar"}}, "m")
CELL = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True).map(str),
    st.integers(-(10**6), 10**6).map(str),
    st.sampled_from(
        ["", "---", "Bad", "1,5", "1.5", '"', '"x"', "#", "2020-01-01 00:00:00", "1e400", "\x00", "æ", "[bar]", " "]
    ),
)


def one_line_or_log(path, mapping):
    said = ""
    try:
        log = read_log(path, mapping)
    except StillhookError as problem:
        said = str(problem) or "\n"
    assert "\n" not in said
    if said:
        return
    assert np.all(np.diff(log.t) > 0.0)
    for name, values in log.signals.items():
        assert len(values) == len(log.t) == len(log.doubtful[name])
        assert log.doubtful[name][np.isnan(values)].all()


@pytest.mark.thorough
@settings(max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=400))
def test_any_bytes_are_a_log_or_one_line(tmp_path, content):
    (tmp_path / "x.csv").write_bytes(content)
    one_line_or_log(tmp_path / "x.csv", MAPPING)
    one_line_or_log(tmp_path / "x.csv", None)


@pytest.mark.thorough
@settings(max_examples=120, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    separator=st.sampled_from([",", ";", "\t", " ", "|"]),
    odd=st.lists(st.lists(CELL, min_size=1, max_size=4), max_size=8),
    size=st.integers(50, 4000),
    seed=st.integers(0, 1000),
)
def test_odd_lines_among_good_ones_are_a_log_or_one_line(tmp_path, separator, odd, size, seed):
    rng = np.random.default_rng(seed)
    lines = [separator.join((f"{0.1 * i:.1f}", f"{150 + rng.standard_normal():.3f}")) for i in range(60)]
    for row in odd:
        lines.insert(int(rng.integers(len(lines))), separator.join(row))
    (tmp_path / "x.csv").write_text("\n".join(["t" + separator + "p", *lines]), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(log_module, "CHUNK", size)
        one_line_or_log(tmp_path / "x.csv", MAPPING)


@pytest.mark.thorough
def test_memory_does_not_grow_with_the_file(tmp_path, make_staircase, monkeypatch):
    """Twenty times the samples take hardly more memory than their bins: 100 samples of one bin are one number. Lines that
    are read to find out the dialect take 1.6 MB of any file."""
    monkeypatch.setattr(log_module, "CHUNK", 1 << 17)
    peaks = []
    for seconds in (60.0, 1200.0):
        path = make_staircase(seconds).write(tmp_path / "log.csv")
        tracemalloc.start()
        read_log(path, every="1 s")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    bins = 1140 * 5 * 100  # bytes: more bins, five signals, what is kept of each
    assert peaks[1] < peaks[0] + 2 * bins
    assert peaks[1] < path.stat().st_size / 2
