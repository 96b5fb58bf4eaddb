"""Wave loads on a hull by Capytaine's panel method: added mass, damping, excitation, hydrostatics; in exp(+i omega t).

Capytaine is needed here and nowhere else: pip install "stillhook[hulls]".
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from lines import Lines, hull_panels, lid_panels
from numpy.typing import NDArray

from stillhook.physics.scalar import G
from stillhook.spec.scenario import RHO_SEA

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
RHO = RHO_SEA
METHOD = "direct"
"""Unknown potentials. With unknown sources Haskind's relation misses by 4 to 6 % where this misses by 1 %, and one mesh
came out wrong."""
DOFS = ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")


@dataclass(frozen=True)
class Loads:
    """About midship, centreline, still waterline; x forward, y to port, z up; exp(+i omega t), crest at the origin at
    phase 0.

    omega (n,) [rad/s]; beta (m,) [rad]; A (n, 6, 6) added mass and B damping [kg, kg m, kg m^2 and each per s], first
    index the motion, second the force; F (n, m, 6) excitation [N/m, N]; C (6, 6) hydrostatic stiffness of a ship whose
    weight sits at the origin's height above the centre of buoyancy; V [m^3], centre of buoyancy (3,) [m], panels on
    hull and lid; asymmetry as `even` finds it.
    """

    omega: FloatArray
    beta: FloatArray
    A: FloatArray
    B: FloatArray
    F: ComplexArray
    C: FloatArray
    V: float
    centre: FloatArray
    panels: int
    lid: int
    asymmetry: float

    def save(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(path, **vars(self))

    @classmethod
    def load(cls, path: Path) -> Loads:
        with np.load(path) as kept:
            one = {key: kept[key] for key in kept.files}
        return cls(**{k: v.item() if v.ndim == 0 else v for k, v in one.items()})


def capytaine() -> Any:
    try:
        import capytaine
    except ImportError:
        sys.exit('Hulls are computed with Capytaine, which is not installed: pip install "stillhook[hulls]"')
    capytaine.set_logging("ERROR")
    return capytaine


def body(lines: Lines, h: float, *, lid: bool) -> Any:
    """The floating body, its port half mirrored."""
    cpt = capytaine()
    mirrored = lambda panels: cpt.ReflectionSymmetricMesh(cpt.Mesh(*panels), plane="xOz")
    ship = cpt.FloatingBody(
        mirrored(hull_panels(lines, h)), lid_mesh=mirrored(lid_panels(lines, h)) if lid else None, name="ship"
    )
    ship.add_all_rigid_body_dofs(rotation_center=(0.0, 0.0, 0.0))
    return ship


def loads(
    lines: Lines, h: float, omega: FloatArray, beta: FloatArray, *, lid: bool = True, dofs: Sequence[str] = DOFS
) -> Loads:
    """Loads with panels of about h [m]; without headings radiation alone, of some motions where `dofs` names them (the
    others are 0)."""
    cpt = capytaine()
    ship = body(lines, h, lid=lid)
    solver = cpt.BEMSolver(method=METHOD)
    common = {"body": ship, "rho": RHO, "g": G}
    A, B, F = (
        np.zeros((len(omega), 6, 6)),
        np.zeros((len(omega), 6, 6)),
        np.zeros((len(omega), len(beta), 6), dtype=complex),
    )
    for i, w in enumerate(omega):
        radiation = [cpt.RadiationProblem(omega=w, radiating_dof=dof, **common) for dof in dofs]
        diffraction = [cpt.DiffractionProblem(omega=w, wave_direction=b, **common) for b in beta]
        results = solver.solve_all([*radiation, *diffraction], progress_bar=False)
        for dof, one in zip(dofs, results, strict=False):
            A[i, DOFS.index(dof)] = [one.added_mass[d] for d in DOFS]
            B[i, DOFS.index(dof)] = [one.radiation_damping[d] for d in DOFS]
        for j, one in enumerate(results[len(radiation) :]):
            loads_now = {d: one.forces[d] + cpt.bem.airy_waves.froude_krylov_force(one.problem)[d] for d in DOFS}
            F[i, j] = np.conj([loads_now[d] for d in DOFS])
        print(f"  {i + 1}/{len(omega)} omega {w:.3f} rad/s", end="\r", file=sys.stderr, flush=True)
    ship.center_of_mass = np.array([ship.center_of_buoyancy[0], 0.0, 0.0])
    C = np.asarray(ship.compute_hydrostatic_stiffness(rho=RHO, g=G).values, dtype=float)
    count = (int(ship.mesh.nb_faces), 0 if ship.lid_mesh is None else int(ship.lid_mesh.nb_faces))
    return even(
        Loads(
            omega, beta, A, B, F, C, float(ship.volume), np.asarray(ship.center_of_buoyancy, dtype=float), *count, 0.0
        )
    )


def even(uneven: Loads) -> Loads:
    """Loads made the same to port and starboard: a mirrored panel that is not plane has another middle than its mirror
    image.

    `asymmetry` is the part of the largest excitation of its kind (translations, rotations) that was removed."""
    mirror = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    keep = np.outer(mirror, mirror) > 0.0
    result = replace(
        uneven, A=uneven.A * keep, B=uneven.B * keep, C=uneven.C * keep, centre=uneven.centre * (1.0, 0.0, 1.0)
    )
    if not len(uneven.beta):
        return result
    other = np.argmin(np.abs(np.exp(1j * uneven.beta)[:, None] - np.exp(-1j * uneven.beta)), axis=0)
    F = (uneven.F + mirror * uneven.F[:, other]) / 2.0
    largest = np.abs(F).max(axis=1).reshape(len(F), 2, 3).max(axis=2).repeat(3, axis=1)[:, None]
    return replace(result, F=F, asymmetry=float((np.abs(uneven.F - F) / largest).max()))
