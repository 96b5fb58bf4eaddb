"""The library's own vessels: a floating body's limits and symmetries, and the wave loads that their motions come from."""

import importlib
import json
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from stillhook.errors import SeaError
from stillhook.formats.vessel.open import read_vessel
from stillhook.library.catalogue import vessel_file, vessels
from stillhook.sea.vessel.rao import long_wave_limits, wavenumber

ROOT = Path(__file__).resolve().parents[2]
KEPT = json.loads((ROOT / "trials" / "hulls" / "outcomes.json").read_text(encoding="utf-8"))
RHO, G = KEPT["rho"], KEPT["g"]
SURGE, SWAY, HEAVE, ROLL, PITCH, YAW = range(6)
HASKIND = 0.012
"""Excitation and damping come from different problems on flat panels; finer ones bring them together."""
RECIPROCITY = 0.02
"""The same, relative to the geometric mean of the two motions' own terms."""
PANELS = 0.002
"""Flat panels are inside a round hull: the volume and waterplane that they miss at most."""
DIGITS = 2e-5
"""Vessel files have six digits, the kept loads as well."""


@pytest.fixture(params=sorted(KEPT["ships"]))
def ship(request):
    return KEPT["ships"][request.param] | {"name": request.param}


@pytest.fixture
def vessel(ship):
    return read_vessel(vessel_file(ship["name"]))


@pytest.fixture
def loads(ship):
    kept = {key: np.array(value) for key, value in ship["loads"].items()}
    return kept | {"F": kept["F_re"] + 1j * kept["F_im"]}


@pytest.fixture
def lines(ship, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "hulls"))
    yield importlib.import_module("lines")
    sys.modules.pop("lines", None)


def test_the_library_has_the_vessels_whose_numbers_are_kept():
    assert vessels() == tuple(sorted(KEPT["ships"]))


def test_an_unknown_vessel_is_told_in_one_line():
    with pytest.raises(
        SeaError, match=r'^No vessel "supply-vessel": the library has .*; did you mean "supply-vessel-82m"\?$'
    ):
        vessel_file("supply-vessel")


def test_long_waves_carry_the_ship_as_they_carry_water(vessel):
    k = wavenumber(vessel.omega[0])
    scaled = vessel.H[:, :, 0] / np.array([1.0, 1.0, 1.0, k, k, k])[:, None]
    off = np.abs(scaled - long_wave_limits(vessel.beta)).max(axis=1)
    assert off[HEAVE] < 0.002
    assert off[PITCH] < 0.02
    assert (
        off[[SURGE, SWAY]].max() < 0.03
    )  # the middle of the wetted hull is deeper than the surface, where water moves less
    # roll is nearer to its resonance: 1/(1 - (T_n/60 s)^2)
    T_n = 2.0 * np.pi / KEPT["ships"][Path(vessel.source.split(" ")[0]).stem]["floating"]["omega_n"]["roll"]
    assert off[ROLL] < 0.03 + 1.0 / (1.0 - (T_n / 60.0) ** 2) - 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("x", "y"), [(40.0, 0.0), (-30.0, -20.0), (10.0, 20.0)])
def test_in_long_waves_every_point_rides_on_the_wave_beneath_it(vessel, x, y):
    k = wavenumber(vessel.omega[0])
    beta = np.radians(np.arange(0.0, 360.0, 15.0))
    beneath = np.exp(-1j * k * (x * np.cos(beta) + y * np.sin(beta)))
    assert np.abs(vessel.vertical(vessel.omega[:1], beta, x, y)[:, 0] - beneath).max() < 0.01


def test_short_waves_do_not_move_the_ship(vessel):
    assert np.abs(vessel.H[[SURGE, HEAVE], :, -1]).max() < 0.02
    assert (
        20.0 * np.abs(vessel.H[[ROLL, PITCH, YAW], :, -1]).max() < 0.1
    )  # 20 m from midship; sway and yaw die out last


def test_a_mirrored_point_in_a_mirrored_sea_moves_alike(vessel):
    omega = np.linspace(0.2, 1.5, 27)
    for degrees in (20.0, 90.0, 135.0):
        beta = np.radians(degrees)
        one, other = vessel.vertical(omega, beta, -20.0, -18.0), vessel.vertical(omega, 2.0 * np.pi - beta, -20.0, 18.0)
        assert np.abs(one - other).max() < 1e-9
    assert np.abs(vessel.at(omega, np.pi)[[SWAY, ROLL, YAW]]).max() < 1e-9


def test_weight_and_waterplane_follow_from_the_lines_in_closed_form(ship):
    form, weights, floating = ship["form"], ship["weights"], ship["floating"]
    M, C = np.array(floating["M"]), np.array(floating["C"])
    assert pytest.approx(RHO * form["V"], rel=PANELS) == floating["mass"] == M[HEAVE, HEAVE]
    assert C[HEAVE, HEAVE] == pytest.approx(RHO * G * form["A_w"], rel=PANELS)
    assert C[HEAVE, PITCH] == pytest.approx(-RHO * G * form["A_w"] * form["x_F"], rel=2.0 * PANELS)
    assert C[ROLL, ROLL] == pytest.approx(floating["mass"] * G * weights["GM"], rel=1e-6)
    KM = ship["lines"]["T"] + form["z_B"] + form["I_x"] / form["V"]
    KG = ship["lines"]["T"] + floating["centre"][2]
    assert KM - KG == pytest.approx(weights["GM"], abs=0.05)  # metres: KB and BM of flat panels


def test_roll_peaks_at_the_period_of_hydrostatics_and_is_as_wide_as_its_damping(ship, vessel):
    beam = int(np.argmin(np.abs(vessel.beta - np.pi / 2.0)))
    omega_n, zeta = ship["floating"]["omega_n"]["roll"], ship["weights"]["zeta"] + ship["floating"]["waves"]
    omega = np.linspace(0.8 * omega_n, 1.2 * omega_n, 4001)
    roll = np.abs(vessel.at(omega, vessel.beta[beam])[ROLL]) / omega**2  # over the wave's slope
    peak = omega[np.argmax(roll)]
    assert peak == pytest.approx(omega_n, rel=0.01)
    wide = omega[roll > roll.max() / np.sqrt(2.0)]
    assert (wide[-1] - wide[0]) / (2.0 * peak) == pytest.approx(zeta, rel=0.1)  # half-power width of one resonance


def test_damping_follows_from_excitation_by_haskinds_relation(loads):
    power = (np.abs(loads["F"]) ** 2).mean(axis=1)  # over all headings
    for i, omega in enumerate(loads["omega"]):
        if not 0.3 <= omega <= 1.0:
            continue  # outside, damping is too small to be reported from the panels' errors
        follows = omega**3 / (2.0 * RHO * G**3) * power[i]
        for mode in (SWAY, HEAVE, ROLL, PITCH):
            assert follows[mode] == pytest.approx(loads["B"][i, mode, mode], rel=HASKIND), (omega, mode)


def test_one_motion_loads_another_as_the_other_loads_it(loads):
    some = (loads["omega"] > 0.3) & (
        loads["omega"] < 1.0
    )  # below, damping is too small to be reported from the panels' errors
    for table in (loads["A"][some], loads["B"][some]):
        scale = np.sqrt(np.einsum("nii->ni", np.abs(table)))
        off = np.abs(table - np.swapaxes(table, 1, 2)) / (scale[:, :, None] * scale[:, None, :])
        assert off.max() < RECIPROCITY


def test_damping_takes_energy_out_of_every_motion(loads):
    symmetric = (loads["B"] + np.swapaxes(loads["B"], 1, 2)) / 2.0
    lever = np.array([1.0, 1.0, 1.0, 30.0, 30.0, 30.0])  # m: makes moments comparable with forces
    eigenvalues = np.linalg.eigvalsh(symmetric / np.outer(lever, lever))
    assert (eigenvalues > -0.002 * eigenvalues.max()).all()


@pytest.mark.slow
def test_the_motions_of_the_file_balance_the_loads(ship, vessel, loads):
    M, C, B_44 = (np.array(ship["floating"][key]) for key in ("M", "C", "B_44"))
    found = 0
    for i, omega in enumerate(loads["omega"]):
        k = int(np.argmin(np.abs(vessel.omega - omega)))
        if abs(vessel.omega[k] - omega) > 1e-5:
            continue  # next to the peak of roll the file has frequencies of its own
        A, B = ((loads[key][i] + loads[key][i].T) / 2.0 for key in ("A", "B"))
        B[ROLL, ROLL] += B_44
        for j, degrees in enumerate(loads["beta"]):
            H = vessel.at(vessel.omega[k : k + 1], np.radians(degrees))[:, 0]
            terms = np.stack([-(omega**2) * (M + A) @ H, 1j * omega * B @ H, C @ H, -loads["F"][i, j]])
            assert np.abs(terms.sum(axis=0)).max() < 20.0 * DIGITS * np.abs(terms).max()
        found += 1
    assert found >= 4


def test_the_table_has_no_irregular_frequency(ship):
    one = {key: np.array(value) for key, value in ship["irregular"].items()}
    bend = lambda A: np.abs(A[1:-1] - (A[:-2] + A[2:]) / 2.0).max() / np.abs(one["A_lid"]).max()
    assert bend(one["A_lid"]) < 0.01
    assert bend(one["A_open"]) > 0.1  # so that the test would see one


def test_smaller_panels_come_closer(ship):
    sizes = sorted(ship["panels"], key=float)
    off = [max(ship["panels"][h]["H_off"][i] for i in (HEAVE, ROLL, PITCH)) for h in sizes]
    assert off[0] == 0.0
    assert all(a < b for a, b in pairwise(off))


def test_a_box_and_an_elliptic_hull_hold_what_geometry_says(lines):
    box = lines.Lines(100.0, 20.0, 5.0, 1e-6, 1e-6, 1e-6, 2.0, 1.0, 1.0, 1e6, 1e6, 1e6).form()
    assert box["V"] == pytest.approx(1e4, rel=1e-4)
    assert box["z_B"] == pytest.approx(-2.5, rel=1e-4)
    assert box["I_x"] == pytest.approx(100.0 * 20.0**3 / 12.0, rel=1e-4)
    ellipse = lines.Lines(100.0, 20.0, 5.0, 1e-6, 1e-6, 1e-6, 2.0, 1.0, 1.0, 2.0, 2.0, 2.0).form()
    assert ellipse["V"] == pytest.approx(np.pi / 4.0 * 1e4, rel=1e-4)
    assert ellipse["z_B"] == pytest.approx(-4.0 * 5.0 / (3.0 * np.pi), rel=1e-4)


def test_panels_close_the_hull_and_come_to_its_volume(ship, lines):
    hull = lines.Lines(**ship["lines"])
    volumes = []
    for h in (4.0, 2.0):
        vertices, faces = lines.hull_panels(hull, h)
        a, b, c, d = (vertices[faces[:, i]] for i in range(4))
        area = (np.cross(b - a, c - a) + np.cross(c - a, d - a)) / 2.0
        middle = (a + b + c + d) / 4.0
        volumes.append([2.0 * float((area[:, i] * middle[:, i]).sum()) for i in (0, 1, 2)])
        # by Gauss's theorem along z, where the open water plane at z = 0 adds nothing
    V = ship["form"]["V"]
    assert volumes[1][2] == pytest.approx(V, rel=0.006)
    assert abs(volumes[1][2] / V - 1.0) < 0.5 * abs(volumes[0][2] / V - 1.0)


@pytest.mark.thorough
def test_loads_computed_anew_come_out_as_kept(ship, loads, lines, monkeypatch):
    pytest.importorskip("capytaine")
    radiation = importlib.import_module("radiation")
    i = int(np.argmin(np.abs(loads["omega"] - 0.7)))
    h = max(ship["panels"], key=float)
    hull = lines.Lines(**ship["lines"])
    now = radiation.loads(hull, float(h), loads["omega"][i : i + 1], np.radians([0.0, 90.0, 180.0, 270.0]))
    for mode in (SWAY, HEAVE, ROLL, PITCH):
        assert now.A[0, mode, mode] == pytest.approx(
            loads["A"][i, mode, mode], rel=1.5 * ship["panels"][h]["A_off"][mode] + DIGITS
        )
    beam = list(loads["beta"]).index(90.0)
    assert now.F[0, 1, HEAVE] == pytest.approx(loads["F"][i, beam, HEAVE], rel=0.05)
    sys.modules.pop("radiation", None)
