"""Motion transfer functions from a Capytaine data set (NetCDF), ready or from its forces.

Where the file holds a variable `rao` (omega, wave_direction, radiating_dof), that is taken, unless it holds the
matrices as well and they contradict it in more than roll (which damping beyond radiation may change). Otherwise motions
X are found from

    (-omega^2 (M + A) - i omega (B + B_more) + C + C_more) X = F_diffraction + F_Froude-Krylov

with inertia_matrix M (or mass, radii of gyration and centre of gravity that the user states), added_mass A,
radiation_damping B, hydrostatic_stiffness C, and, where the file holds them, `dissipation` B_more and `stiffness`
C_more (influenced_dof, radiating_dof), such as viscous roll damping and mooring. M and C are taken as they are: about
the rotation centre, which is the caller's to see to. Capytaine's own convention: exp(-i omega t); x, y, z of the
mesh, which must be forward, port, up here; wave_direction [rad] is where waves go, counter-clockwise from +x; phases
are of a crest at x = y = 0, and are moved to the rotation centre of the degrees of freedom, the reference point.
Capytaine need not be installed.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import ComplexArray, FloatArray
from stillhook.errors import SeaError, UnreadableError
from stillhook.formats.binary import read_dataset
from stillhook.formats.vessel.supplement import NOTHING, Supplement, description, wrong
from stillhook.sea.vessel.rao import DOFS, Rao
from stillhook.sea.vessel.rao_convention import CAPYTAINE, SAME_HEADING, to_rao

if TYPE_CHECKING:
    import xarray

READY = ("rao", "RAO")
MATRICES = ("added_mass", "radiation_damping", "inertia_matrix", "hydrostatic_stiffness")
FORCES = ("diffraction_force", "Froude_Krylov_force")
DIMS = ("omega", "wave_direction", "influenced_dof", "radiating_dof")
AXES = ("omega", "wave_direction")
SQUARE = ("influenced_dof", "radiating_dof")
OF_MASS = ("mass", "radii", "centre_of_gravity")
"""What may be stated of a file without inertia_matrix."""
SAME_POINT = 1e-3  # m: centres of gravity nearer than this are one
APART = 0.05
"""Difference of a ready motion from that of the matrices beyond which they contradict each other, over the largest
amplitude of that motion."""


def read_capytaine(path: Path, stated: Supplement = NOTHING) -> Rao:
    """The vessel in a Capytaine data set; stated: mass, radii and centre of gravity of a file without inertia_matrix.

    Errors: SeaError of one line for a file of another kind, that lacks a variable or a degree of freedom, holds several
    bodies, speeds or depths, or numbers that are not finite.
    """
    stated.allow(path.name, "Capytaine data sets", *OF_MASS)
    data, inertia = _with_inertia(path.name, _opened(path), stated)
    variable = next((name for name in READY if name in data), None)
    if variable:
        dof = "radiating_dof" if "radiating_dof" in data[variable].dims else "influenced_dof"
        ready = _of(path.name, data, variable, (dof, "wave_direction", "omega"))
        H = np.asarray(ready, dtype=np.complex128)
    else:
        H = _solved(path.name, data)
    contradiction = ""
    if variable and all(name in data for name in (*MATRICES, *FORCES)):
        H, contradiction = _reconciled(data, variable, H, _solved(path.name, data))
        variable = "" if contradiction else variable
    bad = ~np.isfinite(H).all(axis=(0, 1))
    omega, heading = _axis(path.name, data, "omega"), _axis(path.name, data, "wave_direction")
    usable = np.isfinite(omega) & (omega > 0.0)
    if (bad & usable).any():
        problem = f"motions at omega {omega[bad & usable][0]:g} rad/s are not finite"
        raise wrong(path.name, problem, "Solve that frequency again or leave it out.")
    centre = _point(data, "rotation_center")
    origin, crest = _origin(data, centre)
    convention = replace(CAPYTAINE, mirror=bool(np.abs(np.sort(heading)[[0, -1]] - (0.0, np.pi)).max() < SAME_HEADING))
    notes = (inertia, contradiction, _damping(data, variable), f"read as Capytaine: {convention.describe()}")
    source = f"{path.name} (Capytaine {data.attrs.get('capytaine_version', 'data set')})"
    name = str(data["body"].values) if "body" in data.coords and data["body"].ndim == 0 else path.stem
    return to_rao(
        convention,
        name=name,
        omega=omega[usable],
        heading=heading,
        H=H[:, :, usable],
        source=source,
        origin=origin,
        notes=tuple(n for n in notes if n),
        depth=_scalar(data, "water_depth", np.inf),
        crest=crest,
    )


def _opened(path: Path) -> xarray.Dataset:
    try:
        data = read_dataset(path)
    except UnreadableError as problem:
        raise wrong(path.name, f"not a complete NetCDF file ({problem})") from None
    if "complex" in data.coords:
        if {"re", "im"} != {str(part) for part in data["complex"].values.ravel()}:
            raise wrong(path.name, "its dimension complex does not name re and im")
        split = {str(n): v for n, v in data.items() if "complex" in v.dims}
        joined = {n: v.sel(complex="re", drop=True) + 1j * v.sel(complex="im", drop=True) for n, v in split.items()}
        data = data.drop_dims("complex").assign(joined)
    single = [d for d in data.dims if data.sizes[d] == 1 and d not in DIMS]
    data = data.squeeze([str(d) for d in single])
    speed = _scalar(data, "forward_speed", 0.0)
    if speed != 0.0:
        raise wrong(path.name, f"is for {speed:g} m/s forward", "Solve at zero speed: vessels at work are stationary.")
    return data


def _with_inertia(file: str, data: xarray.Dataset, stated: Supplement) -> tuple[xarray.Dataset, str]:
    """The data set with the inertia of what is stated, and a note; as it is where nothing is."""
    if not stated.stated:
        return data, ""
    if "inertia_matrix" in data:
        problem = f"holds inertia_matrix, and {', '.join(stated.stated)} would be a second answer"
        raise wrong(file, problem, "Leave one of them out.")
    if missing := [name for name in OF_MASS[:2] if name not in stated.stated]:
        raise wrong(file, f"{missing[0]} is missing", f"Inertia is stated by {', '.join(OF_MASS)}. Add it.")
    inside, G = _point(data, "center_of_mass"), stated.centre_of_gravity
    if G is not None and inside is not None and np.abs(inside - G).max() > SAME_POINT:
        x, y, z = inside
        problem = f"holds the centre of gravity x {x:g} m, y {y:g} m, z {z:g} m, and centre_of_gravity states another"
        raise wrong(file, problem, "Correct it, or leave it out.")
    centre = _point(data, "rotation_center")
    gravity = inside if G is None else np.array(G)
    if gravity is None:
        do = 'State centre_of_gravity as well, x, y, z of the mesh, such as ["0 m", "0 m", "2.5 m"].'
        raise wrong(file, "holds no center_of_mass", do)
    assert stated.mass is not None
    assert stated.radii is not None
    M = inertia_matrix(stated.mass, np.array(stated.radii), gravity - (0.0 if centre is None else centre))
    matrix = np.empty((6, 6))
    matrix[np.ix_(*(_order(file, data[dof].values) for dof in SQUARE))] = M
    kxx, kyy, kzz = stated.radii
    note = (
        f"inertia from the stated mass {stated.mass / 1e3:.6g} t, radii of gyration {kxx:g} m, {kyy:g} m, {kzz:g} m and"
        f" centre of gravity {', '.join(f'{v:g} m' for v in gravity)} of the mesh"
    )
    if 2.0 * max(kxx, kyy, kzz) ** 2 > kxx**2 + kyy**2 + kzz**2:
        note += "; no rigid body has these radii: the square of the largest is more than those of the others together"
    return data.assign(inertia_matrix=(SQUARE, matrix), center_of_mass=("space", gravity)), note


def _of(file: str, data: xarray.Dataset, name: str, dims: tuple[str, ...]) -> Any:
    """A variable as an array with these dimensions, degrees of freedom in order."""
    if name == "inertia_matrix" and name not in data:
        radii = 'radii = ["8 m", "30 m", "30 m"]'
        lines = ('mass = "9000 t"', f"{radii} (of gyration: roll, pitch, yaw)")
        point = () if _point(data, "center_of_mass") is not None else ('centre_of_gravity = ["0 m", "0 m", "2.5 m"]',)
        raise SeaError(f"{file}: has no inertia_matrix, which motions need. {description(file, *lines, *point)}")
    if name not in data:
        others = ", ".join(n for n in (*MATRICES, *FORCES) if n != name)
        raise wrong(file, f"has no {name}, which motions need in addition to {others}", "Add it.")
    variable = data[name]
    over = [str(d) for d in variable.dims if d not in dims]
    if over:
        raise wrong(file, f"{name} has {', '.join(f'{data.sizes[d]} values of {d}' for d in over)}", "Select one.")
    for dim in SQUARE:
        if dim in variable.dims:
            variable = variable.isel({dim: _order(file, variable[dim].values)})
    missing = [d for d in dims if d not in variable.dims]
    return variable.expand_dims({d: data.sizes[d] for d in missing if d in data.sizes}).transpose(*dims).values


def _order(file: str, names: Any) -> list[int]:
    """Places of surge to yaw among the names of degrees of freedom."""
    plain = [str(n).rpartition("__")[2].lower() for n in names]
    missing = [dof for dof in DOFS if plain.count(dof) != 1]
    if missing or len(plain) != len(DOFS):
        have = ", ".join(str(n) for n in names)
        raise wrong(file, f"degrees of freedom {have}", f"One rigid body is read: {', '.join(DOFS)}, each once.")
    return [plain.index(dof) for dof in DOFS]


def _solved(file: str, data: xarray.Dataset) -> ComplexArray:
    """Transfer functions (6, headings, frequencies) from the equation of motion."""
    A, B = (_of(file, data, n, ("omega", *SQUARE)) for n in MATRICES[:2])
    M, C = (_of(file, data, n, SQUARE) for n in MATRICES[2:])
    more = [_of(file, data, n, SQUARE) if n in data else np.zeros((6, 6)) for n in ("dissipation", "stiffness")]
    force = sum(_of(file, data, n, ("omega", "influenced_dof", "wave_direction")) for n in FORCES)
    omega = _axis(file, data, "omega")[:, None, None]
    H = np.full(force.shape, np.nan, dtype=np.complex128)
    good = (np.isfinite(omega) & (omega > 0.0))[:, 0, 0]
    for values in (A, B, force):
        good &= np.isfinite(values).all((1, 2))
    w = omega[good]
    try:
        H[good] = np.linalg.solve(-(w**2) * (M + A[good]) - 1j * w * (B[good] + more[0]) + C + more[1], force[good])
    except np.linalg.LinAlgError:
        do = "Check inertia_matrix and hydrostatic_stiffness."
        raise wrong(file, "the equation of motion has no solution", do) from None
    return np.asarray(np.moveaxis(H, (1, 2, 0), (0, 1, 2)))


def inertia_matrix(mass: float, radii: FloatArray, lever: FloatArray) -> FloatArray:
    r"""Mass matrix (6, 6) [kg, kg m, kg m^2] about a point P, with r from P to the centre of gravity and S(r) the
    matrix of r x:

    .. math:: M = \begin{pmatrix} m I & -m S(r) \\ m S(r) & m K^2 - m S(r) S(r) \end{pmatrix}

    with K = diag(k_xx, k_yy, k_zz), the radii of gyration about axes through the centre of gravity: products of inertia
    about them are 0 (Fossen, Handbook of Marine Craft Hydrodynamics and Motion Control, 2011, chapter 3).

    mass [kg]; radii (3,) of gyration about the centre of gravity, roll, pitch, yaw [m]; lever (3,) from the point to
    the centre of gravity [m].
    """
    x, y, z = lever
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    M = np.zeros((6, 6))
    M[:3, :3] = mass * np.eye(3)
    M[:3, 3:], M[3:, :3] = -mass * S, mass * S
    M[3:, 3:] = mass * (np.diag(radii**2) - S @ S)
    return M


def _reconciled(data: xarray.Dataset, name: str, ready: ComplexArray, solved: ComplexArray) -> tuple[ComplexArray, str]:
    """The ready motions; those of the matrices, and a note, where they contradict the ready ones in more than roll."""
    apart = np.nan_to_num(np.abs(ready - solved))
    share = apart / np.nanmax(np.abs(solved), axis=(1, 2), keepdims=True)
    share[DOFS.index("roll")] = 0.0
    worst = int(np.argmax(share))
    if share.ravel()[worst] <= APART:
        return ready, ""
    d, j, n = np.unravel_index(worst, share.shape)
    T, beta = 2.0 * np.pi / float(data["omega"].values[n]), np.degrees(float(data["wave_direction"].values[j]))
    return solved, (
        f"its {name} contradicts its own matrices, by {share[d, j, n]:.0%} of the largest {DOFS[d]} at {T:.3g} s and"
        f" {beta:.4g} deg: the motions are solved from the matrices. Check how {name} was made"
    )


def _axis(file: str, data: xarray.Dataset, name: str) -> FloatArray:
    if name not in data.coords or data[name].ndim != 1:
        raise wrong(file, f"has no list of {name}", f"Give a data set over {' and '.join(AXES)}.")
    return np.asarray(data[name].values, dtype=np.float64)


def _scalar(data: xarray.Dataset, name: str, otherwise: float) -> float:
    return float(data[name].values) if name in data.variables and data[name].ndim == 0 else otherwise


def _point(data: xarray.Dataset, name: str) -> FloatArray | None:
    if name not in data.variables or data[name].size != 3:
        return None
    return np.asarray(data[name].values, dtype=np.float64).ravel()


def _origin(data: xarray.Dataset, centre: FloatArray | None) -> tuple[str, tuple[float, float]]:
    """Where the reference point is, and where from there (x, y) [m] the crest of phase 0 passes."""
    if centre is None:
        text = "rotation centre of the degrees of freedom (not in the file), taken to be at x = y = 0 of the mesh"
        return text, (0.0, 0.0)
    x, y, z = centre
    text = f"x = {x:g} m, y = {y:g} m, z = {z:g} m of the mesh (rotation centre; z = 0 is the still waterline)"
    mass = _point(data, "center_of_mass")
    if mass is not None and np.isfinite(mass).all():
        away = f"{mass[0] - x:+.4g} m forward, {mass[1] - y:+.4g} m to port, {mass[2] - z:+.4g} m up"
        text += f"; centre of gravity {away} of it"
    return text, (-float(x), -float(y))


def _damping(data: xarray.Dataset, ready: str | None) -> str:
    if ready:
        return f"motions as the file holds them ({ready}); damping beyond radiation is not stated"
    if "dissipation" in data:
        return "damping: radiation and the file's dissipation"
    return "damping: radiation only, so that roll near its natural period is far too large; add dissipation to the file"
