"""The public bench log: blanks between columns, a header that begins with # and is split by commas, units that are not ours."""

import numpy as np
import pytest

from stillhook.logs.log import describe, mapping_from, read_log

PSI, INCH = 6894.757, 0.0254
SAME = 1e-5  # relative: psi is written with six digits in the mapping
MAPPING = {
    "time": {"column": "time", "unit": "s"},
    "speed": {"column": "Spd", "unit": "mm/s", "scale": 25.4, "quantity": "speed"},
    "rotation": {"column": "RPM", "unit": "rpm", "quantity": "rotation"},
    "lower": {"column": "LowerHydPress", "unit": "bar", "scale": 0.0689476, "quantity": "pressure"},
    "force": {"column": "TestMachineForce", "unit": "N", "scale": 4.448222, "quantity": "force"},
}


@pytest.fixture(scope="module")
def path(shared_data):
    return shared_data / "bench_mbari" / "FrictionIDMovesWithBiasCurr.exp"


@pytest.mark.slow
def test_the_bench_log_reads_as_its_numbers_say(path):
    log = read_log(path, mapping_from(MAPPING, "bench"))
    raw = np.loadtxt(path)  # the header begins with #
    assert log.samples == len(raw)
    assert log.rate == pytest.approx(50.0)
    bins = np.floor(raw[:, 0] / 0.1 + 0.5 + 1e-4).astype(int)
    for name, column, factor in (("speed", 2, INCH), ("lower", 4, PSI), ("force", 16, 4.448222)):
        means = np.bincount(bins, raw[:, column]) / np.bincount(bins)
        np.testing.assert_allclose(log.signals[name], factor * means, rtol=SAME, atol=1e-9)
    assert log.findings == ()
    assert describe(log)[0].startswith("FrictionIDMovesWithBiasCurr.exp: 20001 samples in 400 s (50 per second)")
