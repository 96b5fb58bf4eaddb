"""What of a winch's error does not follow the tip: its density over frequency."""

from __future__ import annotations

import numpy as np
import pytest

from stillhook.response.winch.identify import BATCHES, Steps, _Spectra

EDGES = np.geomspace(0.2, 3.2, 9)


def spectra_of(omega: np.ndarray, wire: np.ndarray, tip: np.ndarray) -> _Spectra:
    """Powers by frequency; the wire's answer to the tip is C = 0.5."""
    made = object.__new__(_Spectra)
    made.omega, made.wire, made.tip, made.C = omega, wire, tip, np.full(len(omega), 0.5 + 0.0j)
    return made


def test_without_a_tip_all_power_of_the_wire_is_in_the_density() -> None:
    omega = np.linspace(0.2001, 3.1999, 500)
    wire = np.random.default_rng(1).uniform(0.5, 1.5, len(omega))
    density = spectra_of(omega, wire, np.zeros(len(omega))).remnant(1.0, EDGES)
    assert np.sum(density * np.diff(EDGES)) == pytest.approx(wire.sum())


@pytest.mark.parametrize("gain", [1.0, 0.8, 0.5j])
def test_what_follows_the_tip_is_taken_out(gain: complex) -> None:
    omega = np.linspace(0.2001, 3.1999, 500)
    tip = np.full(len(omega), 2.0)
    density = spectra_of(omega, 0.25 * abs(gain) ** 2 * tip + 0.1, tip).remnant(gain, EDGES)
    assert np.sum(density * np.diff(EDGES)) == pytest.approx(0.1 * len(omega))


def test_a_band_without_a_frequency_takes_the_density_of_the_next() -> None:
    """A short run resolves no low frequency: nothing is made up there, and nothing is 0."""
    omega = np.linspace(0.9, 3.1999, 40)
    density = spectra_of(omega, np.ones(len(omega)), np.zeros(len(omega))).remnant(1.0, EDGES)
    first = int(np.searchsorted(EDGES, 0.9)) - 1
    assert len(density) == len(EDGES) - 1
    assert density[:first] == pytest.approx(np.full(first, density[first]))
    assert (density > 0.0).all()


def test_progress_of_all_batches_rises_from_batch_to_batch_and_ends_at_one() -> None:
    """Each batch tells its own share, from 0 to 1."""
    seen: list[float] = []
    steps = Steps(seen.append)
    for _ in range(BATCHES):
        for share in (0.0, 0.5, 1.0):
            steps(share)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
    assert seen[1::3] == pytest.approx([(k + 0.5) / BATCHES for k in range(BATCHES)])
