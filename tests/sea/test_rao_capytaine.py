"""Capytaine data sets: a body whose equation of motion is known, about any point, split into parts or ready; refusals."""

from pathlib import Path

import numpy as np
import pytest
import xarray
from tests.sea.other_programs import refused
from tests.sea.plank import plank_motions

from stillhook.formats.vessel.open import read_vessel
from stillhook.sea.vessel.rao import DOFS, Rao, wavenumber

pytestmark = pytest.mark.slow

OMEGA, SIDE = np.linspace(0.1, 1.5, 8), np.radians(np.arange(0.0, 181.0, 30.0))
SOLVED = 1e-9  # rounding of a 6 by 6 system with entries from 1e5 to 1e10
RNG = np.random.default_rng(4)
MASS = np.diag([6e6, 6e6, 6e6, 2e8, 3e9, 3e9]) + 1e5 * RNG.normal(size=(6, 6))
ADDED = 0.5 * MASS + 1e6 * RNG.normal(size=(len(OMEGA), 6, 6))
DAMPING = 0.2 * MASS + 1e5 * RNG.normal(size=(len(OMEGA), 6, 6))
STIFFNESS = np.diag([0.0, 0.0, 1e7, 1e8, 5e9, 0.0])
SQUARE = ("influenced_dof", "radiating_dof")
NAMES = [dof.capitalize() for dof in DOFS]


def data_set(
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0), dissipation: np.ndarray | None = None
) -> xarray.Dataset:
    """Forces under which the plank's motions solve the equation of motion, all of it about a rotation centre [m]; exp(-i omega t)."""
    x, y, z = centre
    to_middle = np.eye(6)  # motions of the middle from those of the centre: u - r x theta with r from centre to middle
    to_middle[:3, 3:] = -np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    moved = [to_middle.T @ matrix @ to_middle for matrix in (MASS, ADDED, DAMPING, STIFFNESS)]
    M, A, B, C = moved
    more = np.zeros((6, 6)) if dissipation is None else to_middle.T @ dissipation @ to_middle
    X = np.linalg.solve(to_middle, np.conj(plank_motions(OMEGA, SIDE)).transpose(2, 0, 1))
    w = OMEGA[:, None, None]
    force = (-(w**2) * (M + A) - 1j * w * (B + more) + C) @ X
    parts = {"Froude_Krylov_force": 0.7 * force, "diffraction_force": 0.3 * force}
    data = xarray.Dataset(
        {
            "added_mass": (("omega", *SQUARE), A),
            "radiation_damping": (("omega", *SQUARE), B),
            "inertia_matrix": (SQUARE, M),
            "hydrostatic_stiffness": (SQUARE, C),
        },
        coords={
            "omega": OMEGA,
            "wave_direction": SIDE,
            "influenced_dof": NAMES,
            "radiating_dof": NAMES,
            "water_depth": np.inf,
            "body": "plank",
            "forward_speed": 0.0,
            "rotation_center": ("space", list(centre)),
            "complex": ["re", "im"],
        },
    )
    for name, value in parts.items():
        data[name] = (("complex", "omega", "influenced_dof", "wave_direction"), np.stack([value.real, value.imag]))
    return data if dissipation is None else data.assign(dissipation=(SQUARE, more))


def written(folder: Path, data: xarray.Dataset) -> Path:
    path = folder / "plank.nc"
    data.to_netcdf(path, engine="h5netcdf")
    return path


def assert_plank(ship: Rao) -> None:
    assert len(ship.beta) == 12
    assert np.abs(ship.H - plank_motions(ship.omega, ship.beta)).max() < SOLVED


def test_motions_follow_from_forces_mass_damping_and_stiffness(tmp_path: Path) -> None:
    ship = read_vessel(written(tmp_path, data_set()))
    assert_plank(ship)
    assert ship.name == "plank"
    assert any("radiation only, so that roll near its natural period is far too large" in note for note in ship.notes)


def test_damping_that_the_file_adds_counts(tmp_path: Path) -> None:
    assert_plank(read_vessel(written(tmp_path, data_set(dissipation=np.diag([0.0, 0.0, 0.0, 1e8, 0.0, 0.0])))))


@pytest.mark.parametrize("centre", [(0.0, 0.0, 3.0), (-5.0, 0.0, 0.0), (7.0, 2.0, -1.0)])
def test_a_point_of_the_ship_moves_alike_whatever_the_rotation_centre(
    tmp_path: Path, centre: tuple[float, float, float]
) -> None:
    x, y, _ = centre
    data = data_set(centre)
    if y:  # no symmetric half then: all round
        data = all_round(centre)
    ship = read_vessel(written(tmp_path, data))
    for beta in (0.0, np.radians(30.0), np.pi / 2.0, np.pi):
        H = plank_motions(OMEGA, np.array([beta]))[:, 0]
        wanted = H[2] + 8.0 * H[3] + 20.0 * H[4]  # the point 20 m aft, 8 m to port of the middle
        crest = np.exp(1j * wavenumber(OMEGA) * (x * np.cos(beta) + y * np.sin(beta)))  # phases are those at the centre
        assert np.abs(ship.vertical(OMEGA, beta, -20.0 - x, 8.0 - y) - wanted * crest).max() < SOLVED
    assert f"x = {x:g} m, y = {y:g} m" in ship.origin


def all_round(centre: tuple[float, float, float]) -> xarray.Dataset:
    """Both sides of the ship, about a centre off its centreline."""
    half, mirrored = data_set(centre), data_set((centre[0], -centre[1], centre[2]))
    signs = xarray.DataArray([1.0, -1.0, 1.0, -1.0, 1.0, -1.0], dims="influenced_dof", coords={"influenced_dof": NAMES})
    other = mirrored[["Froude_Krylov_force", "diffraction_force"]].isel(wave_direction=slice(1, -1)) * signs
    other = other.assign_coords(wave_direction=-other["wave_direction"])
    forces = xarray.concat([half[["Froude_Krylov_force", "diffraction_force"]], other], "wave_direction")
    return half.drop_vars(["Froude_Krylov_force", "diffraction_force", "wave_direction"]).merge(forces)


RIGID = {"mass": 6e6, "radii": np.array([6.0, 22.0, 22.5])}  # kg, m
GRAVITY = np.array([-1.5, 0.0, 2.0])  # m: in the mesh


def rigid(centre: tuple[float, float, float]) -> xarray.Dataset:
    """The data set of a rigid body with known mass, radii of gyration and centre of gravity: products of inertia by
    summing up masses at six points that have them."""
    data = data_set(centre)
    m, k = RIGID["mass"], RIGID["radii"]
    sizes = np.sqrt(3.0 * (np.sum(k**2) / 2.0 - k**2))  # of pairs of masses m/6 along x, y and z
    M = np.zeros((6, 6))
    for axis in range(3):
        for side in (-1.0, 1.0):
            x, y, z = GRAVITY + side * sizes[axis] * np.eye(3)[axis] - np.array(centre)
            J = np.hstack([np.eye(3), np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])])
            M += m / 6.0 * J.T @ J
    change = M - data["inertia_matrix"].values
    w = OMEGA[:, None, None]
    x, y, z = centre
    to_middle = np.eye(6)
    to_middle[:3, 3:] = -np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    X = np.linalg.solve(to_middle, np.conj(plank_motions(OMEGA, SIDE)).transpose(2, 0, 1))
    more = -(w**2) * change @ X
    dims = ("complex", "omega", "influenced_dof", "wave_direction")
    data["diffraction_force"] = data["diffraction_force"] + xarray.DataArray(
        np.stack([more.real, more.imag]), dims=dims
    )
    data["inertia_matrix"] = (SQUARE, M)
    return data


def described(folder: Path, data: xarray.Dataset, **changes: str) -> Path:
    written(folder, data)
    lines = {
        "mass": '"6000 t"',
        "radii": '["6 m", "22 m", "22.5 m"]',
        "centre_of_gravity": '["-1.5 m", "0 m", "2 m"]',
    } | changes
    path = folder / "plank.toml"
    path.write_text('motions = "plank.nc"\n' + "".join(f"{k} = {v}\n" for k, v in lines.items() if v))
    return path


@pytest.mark.long
@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (-1.5, 0.0, 2.0), (7.0, 0.0, -1.0)])
def test_mass_and_radii_that_are_stated_are_the_inertia_matrix(
    tmp_path: Path, centre: tuple[float, float, float]
) -> None:
    """Masses at points with the same moments of inertia, moved to the rotation centre one by one."""
    data = rigid(centre)
    wanted = read_vessel(written(tmp_path, data))
    ship = read_vessel(described(tmp_path, data.drop_vars("inertia_matrix")))
    assert np.abs(ship.H - wanted.H).max() < SOLVED
    assert "centre of gravity" in ship.origin
    assert any(
        "inertia from the stated mass 6000 t, radii of gyration 6 m, 22 m, 22.5 m" in note for note in ship.notes
    )
    order = [4, 0, 2, 5, 1, 3]
    turned = data.drop_vars("inertia_matrix").isel(influenced_dof=order, radiating_dof=order[::-1])
    assert np.abs(read_vessel(described(tmp_path, turned)).H - wanted.H).max() < SOLVED


def test_the_centre_of_gravity_of_the_file_counts(tmp_path: Path) -> None:
    data = rigid((0.0, 0.0, 0.0))
    wanted = read_vessel(written(tmp_path, data))
    bare = data.drop_vars("inertia_matrix").assign(center_of_mass=("space", GRAVITY))
    assert np.abs(read_vessel(described(tmp_path, bare, centre_of_gravity="")).H - wanted.H).max() < SOLVED
    assert "centre_of_gravity states another. Correct it" in refused(
        described(tmp_path, bare, centre_of_gravity='["0 m", "0 m", "2 m"]')
    )


def test_what_is_missing_or_stated_twice_is_told(tmp_path: Path) -> None:
    bare = data_set().drop_vars("inertia_matrix")
    assert refused(written(tmp_path, bare)) == (
        'plank.nc: has no inertia_matrix, which motions need. Write a vessel description (TOML) with motions = "plank.nc",'
        ' mass = "9000 t", radii = ["8 m", "30 m", "30 m"] (of gyration: roll, pitch, yaw), centre_of_gravity = ["0 m",'
        ' "0 m", "2.5 m"], and give it instead.'
    )
    assert "radii is missing. Inertia is stated by mass, radii, centre_of_gravity" in refused(
        described(tmp_path, bare, radii="")
    )
    assert "holds no center_of_mass. State centre_of_gravity as well" in refused(
        described(tmp_path, bare, centre_of_gravity="")
    )
    assert "holds inertia_matrix, and mass, radii, centre_of_gravity would be a second answer" in refused(
        described(tmp_path, data_set())
    )
    assert "vessel_type is stated, and Capytaine data sets have no use for it" in refused(
        described(tmp_path, bare, vessel_type='"Barge"')
    )
    ship = read_vessel(
        described(tmp_path, rigid((0.0, 0.0, 0.0)).drop_vars("inertia_matrix"), radii='["6 m", "22 m", "23 m"]')
    )
    assert any("no rigid body has these radii" in note for note in ship.notes)
    assert "radii of gyration are above 0 m" in refused(described(tmp_path, bare, radii='["0 m", "22 m", "23 m"]'))
    assert "has no hydrostatic_stiffness" in refused(described(tmp_path, bare.drop_vars("hydrostatic_stiffness")))


def test_ready_motions_are_taken_as_they_are(tmp_path: Path) -> None:
    X = np.conj(plank_motions(OMEGA, SIDE)).transpose(2, 1, 0)
    ready = (
        data_set()
        .drop_vars("inertia_matrix")
        .assign(rao=(("complex", "omega", "wave_direction", "radiating_dof"), np.stack([X.real, X.imag])))
    )
    assert_plank(read_vessel(written(tmp_path, ready)))


def with_ready(factors: np.ndarray) -> xarray.Dataset:
    """Ready motions beside the matrices, each times a factor."""
    X = np.conj(plank_motions(OMEGA, SIDE)).transpose(2, 1, 0) * factors
    return data_set().assign(rao=(("complex", "omega", "wave_direction", "radiating_dof"), np.stack([X.real, X.imag])))


def test_ready_motions_that_the_matrices_contradict_are_solved_again(tmp_path: Path) -> None:
    """A program with the wrong sign of the damping left motions a quarter too small in its file."""
    ship = read_vessel(written(tmp_path, with_ready(np.array([1.0, 1.0, 0.75, 1.0, 1.0, 1.0]))))
    assert_plank(ship)
    (note,) = [note for note in ship.notes if "contradicts its own matrices" in note]
    assert "25% of the largest heave" in note


def test_ready_roll_may_have_damping_that_the_matrices_lack(tmp_path: Path) -> None:
    ship = read_vessel(written(tmp_path, with_ready(np.array([1.0, 1.0, 1.0, 0.6, 1.0, 1.0]))))
    assert not any("contradicts" in note for note in ship.notes)
    assert np.allclose(ship.H[3], 0.6 * plank_motions(ship.omega, ship.beta)[3])


def test_degrees_of_freedom_may_come_in_any_order(tmp_path: Path) -> None:
    order = [4, 0, 2, 5, 1, 3]
    assert_plank(read_vessel(written(tmp_path, data_set().isel(influenced_dof=order, radiating_dof=order[::-1]))))


def test_frequencies_at_the_ends_of_the_scale_are_left_out(tmp_path: Path) -> None:
    data = data_set()
    far = data.isel(omega=[0, 0]).assign_coords(omega=[0.0, np.inf])
    assert_plank(read_vessel(written(tmp_path, xarray.concat([data, far], "omega", data_vars="minimal"))))


def test_missing_degrees_of_freedom_failed_solutions_and_speed_are_refused(tmp_path: Path) -> None:
    five = data_set().isel(influenced_dof=slice(5), radiating_dof=slice(5))
    assert "degrees of freedom Surge, Sway, Heave, Roll, Pitch. One rigid body is read" in refused(
        written(tmp_path, five)
    )
    lost = data_set()
    lost["added_mass"][3] = np.nan
    assert "motions at omega 0.7 rad/s are not finite" in refused(written(tmp_path, lost))
    assert "is for 5 m/s forward" in refused(written(tmp_path, data_set().assign_coords(forward_speed=5.0)))


def test_several_bodies_or_depths_are_refused(tmp_path: Path) -> None:
    two = xarray.concat([data_set().assign_coords(water_depth=d) for d in (50.0, 100.0)], "water_depth")
    assert "2 values of water_depth. Select one" in refused(written(tmp_path, two))


def test_the_other_sign_of_time_is_found(tmp_path: Path) -> None:
    data = data_set()
    for name in ("Froude_Krylov_force", "diffraction_force"):
        data[name] = data[name] * xarray.DataArray([1.0, -1.0], dims="complex", coords={"complex": ["re", "im"]})
    data["radiation_damping"] = -data["radiation_damping"]
    assert "It would fit with time the other way" in refused(written(tmp_path, data))


def test_a_file_that_is_cut_off_is_told(tmp_path: Path) -> None:
    path = written(tmp_path, data_set())
    path.write_bytes(path.read_bytes()[:3000])
    assert "plank.nc: not a complete NetCDF file" in refused(path)
