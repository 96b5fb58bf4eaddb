"""A year of measured spectra and a measured-format vessel down the frequency road: every hour's tip speed and residual load motion."""

from time import process_time

import numpy as np
import pytest
from benchmarks.frequency_response import HEADING, X, Y, year

from stillhook.formats.vessel.open import read_vessel
from stillhook.formats.waves.buoys import read_spectra
from stillhook.response.forcing import forcing_of_series
from stillhook.sea.spectra.spectrum import Sea, Train
from stillhook.sea.vessel.tip import tip_response

SLOWEST = 60.0  # s of processor time, so that others may share the machine; see benchmarks/frequency_response.py
WITHIN_BAND = 0.01  # a band taken at its middle alone, against eight parts of it


@pytest.fixture(scope="module")
def files(shared_data):
    return str(shared_data / "sea_ndbc_46042" / "46042w1996.txt.gz"), str(
        shared_data / "vessel_mss_supply" / "input.re1"
    )


@pytest.fixture(scope="module")
def run(files):
    start = process_time()
    found, _ = year(*files)
    assert process_time() - start < SLOWEST
    return found


@pytest.mark.thorough
def test_every_valid_hour_has_its_numbers_and_every_missing_one_none(run):
    assert run.sizes["case"] == 8712
    for name in ("sigma_v", "sigma_load", "DAF", "slack_chance", "sigma_load_braked"):
        assert np.count_nonzero(np.isfinite(run[name])) == 8600, name


@pytest.mark.thorough
def test_tip_speed_is_that_of_single_records_by_the_tip_statistics(run, files):
    series, rao = read_spectra(files[0]), read_vessel(files[1])
    for i in np.flatnonzero(series.valid)[:: 8600 // 12]:
        alone = tip_response(rao, Sea((Train(series.spectrum(i), HEADING),)), X, Y)
        assert run["sigma_z"].values[i] == pytest.approx(alone.sigma_z, rel=WITHIN_BAND)
        assert run["sigma_v"].values[i] == pytest.approx(alone.sigma_v, rel=WITHIN_BAND)


@pytest.mark.thorough
def test_tip_of_all_hours_is_that_of_plain_sums_over_the_bands(run, files):
    series, rao = read_spectra(files[0]), read_vessel(files[1])
    R = rao.vertical(series.omega, HEADING, X, Y)
    plain = np.sqrt(series.S @ (np.abs(series.omega * R) ** 2 * series.width))
    ok = series.valid
    assert run["sigma_v"].values[ok] == pytest.approx(plain[ok], rel=3.0 * WITHIN_BAND)
    assert np.mean(run["sigma_v"].values[ok] / plain[ok]) == pytest.approx(1.0, abs=WITHIN_BAND)


@pytest.mark.thorough
def test_compensation_helps_in_every_hour_and_less_at_the_load_than_at_the_wire(run):
    ok = np.isfinite(run["sigma_v"].values)
    assert (run["sigma_load"].values[ok] < run["sigma_load_braked"].values[ok]).all()
    assert np.mean(run["eta_sigma_wire"].values[ok] > run["eta_sigma_load"].values[ok]) > 0.9


@pytest.mark.slow
def test_the_lee_side_moves_less_than_the_weather_side_in_beam_seas(files):
    series, rao = read_spectra(files[0]), read_vessel(files[1])
    weather, lee = (np.nanmean(forcing_of_series(series, rao, X, y, np.pi / 2.0).deviation(1)) for y in (-18.0, 18.0))
    assert weather > 1.5 * lee
