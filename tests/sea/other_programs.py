"""Files of motions as other programs write them, made of a vessel by the conventions of their manuals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from stillhook.errors import StillhookError
from stillhook.formats.vessel.open import read_vessel

AQWA_HEAD = """ *********1*********2*********3*********4
 * Hydrodynamic Solver Unit System : Metric: kg, m [N]
 JOB AQWA  LINE
                                WATER  DEPTH  . . . . . . . . . . . . . . . . =  {depth}
                                ACCELERATION  DUE  TO GRAVITY . . . . . . . . =       {g}
                                STRUCTURE C.O.G.            GX=    1.0000  GY=    0.0000  GZ=   -2.0000
"""
AQWA_PAGE = """1
              * * * * H Y D R O D Y N A M I C   P A R A M E T E R S   F O R   S T R U C T U R E   {structure} * * * *
                                          (WITH RESPECT TO STRUCTURE COG)

                                      {title}
                                      --------------------------------------------
 PERIOD   FREQ   DIRECTION          X                 Y                 Z                RX                RY                RZ
 ------   -----  --------- -----------------------------------------------------------------------------------------------------------
 (SECS)  (RAD/S) (DEGREES)    AMP      PHASE    AMP      PHASE    AMP      PHASE    AMP      PHASE    AMP      PHASE    AMP      PHASE
 -------------------------------------------------------------------------------------------------------------------------------------

"""


def wamit_text(omega: np.ndarray, degrees: np.ndarray, H: np.ndarray, *, L: float = 1.0, body: int = 1) -> str:
    """A `.4` file: rotations times L, phases that lead, six digits."""
    size = np.array([1.0] * 3 + [L] * 3)[:, None, None]
    lines = []
    for k in np.argsort(-omega):
        for j, beta in enumerate(degrees):
            for d in range(6):
                z = complex((size * H)[d, j, k])
                numbers = (abs(z), np.degrees(np.angle(z)), z.real, z.imag)
                columns = "".join(f"{v:14.6E}" for v in numbers)
                lines.append(f"{2.0 * np.pi / omega[k]:14.6E}{beta:14.6E}{6 * (body - 1) + d + 1:6d}{columns}")
    return "\n".join(lines) + "\n"


def aqwa_text(
    omega: np.ndarray, degrees: np.ndarray, H: np.ndarray, *, structure: int = 1, g: float = 9.807, page: int = 0
) -> str:
    """The pages of a `.lis` file: lags in deg, rotations in deg/m, four decimals; page 0 by frequency, 1 by direction."""
    size = np.abs(H) * np.array([1.0] * 3 + [180.0 / np.pi] * 3)[:, None, None]
    lag = -np.degrees(np.angle(H))
    title = ("R.A.O.S-VARIATION WITH WAVE PERIOD/FREQUENCY", "R.A.O.S-VARIATION WITH WAVE DIRECTION")[page]
    text = AQWA_HEAD.format(depth=1000.0, g=g) + AQWA_PAGE.format(structure=structure, title=title)
    order = [(j, k) for j in range(len(degrees)) for k in range(len(omega))]
    for j, k in order if page == 0 else sorted(order, key=lambda jk: (jk[1], jk[0])):
        columns = "".join(f"{size[d, j, k]:10.4f}{lag[d, j, k]:8.2f}" for d in range(6))
        wave, direction = f"{2.0 * np.pi / omega[k]:8.2f}{omega[k]:8.3f}", f"{degrees[j]:11.2f}"
        first = (k if page == 0 else j) == 0
        lead = wave + direction if first else wave + " " * 11 if page == 0 else " " * 16 + direction
        text += ("\n" if first else "") + lead + columns + "\n"
    return text + AQWA_PAGE.format(structure=structure, title=f"VEL {title}") + "1\n"


def hydrostar_texts(
    omega: np.ndarray,
    degrees: np.ndarray,
    H: np.ndarray,
    *,
    point: Sequence[float] = (0.0, 0.0, 0.0),
    wave: Sequence[float] = (0.0, 0.0),
    speed: float = 0.0,
) -> list[str]:
    """Six `.rao` files: phases that lead, rotations in deg/m."""
    texts = []
    for d in range(6):
        rotation = d >= 3
        z = H[d] * (180.0 / np.pi if rotation else 1.0)
        rows = [
            f"{w:8.4f}"
            + "".join(f"{abs(v):14.6E}" for v in z[:, k])
            + "".join(f"{np.degrees(np.angle(v)) % 360.0:12.4f}" for v in z[:, k])
            for k, w in enumerate(omega)
        ]
        texts.append(
            "# Project :\n# User    :\n# File : motion.rao\n#\n# Constants used in computations :\n"
            "#     Reference length     :     1.0000\n#     Water density (rho)  :  1025.0000\n"
            "#     Gravity acceleration :     9.8066\n#     Waterdepth           :  Inf.\n"
            f"#     Ref.pt incident wave : (   {wave[0]:.4f}   {wave[1]:.4f})\n"
            f"#            Forward speed :   {speed:.4f}  m/s\n#\n"
            f"# Reference point of body 1: (   {point[0]:.4f}   {point[1]:.4f}   {point[2]:.4f})\n"
            "# MEANVALUE :   0.0000E+0\n#   AMP/PHASE\n#-----------------------------------\n"
            f"#RAOTYPE    :  Motion\n#COMPONENT  :  {d + 1}\n#UNIT       :  {'deg/m' if rotation else 'm/m'}\n"
            f"#NBHEADING {len(degrees):5d}\n#HEADING  " + "".join(f"{v:15.2f}" for v in degrees) + "\n"
            "#---w(r/s)----------------------------------\n" + "\n".join(rows) + "\n#----------\n#ENDFILE\n"
        )
    return texts


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def refused(path: Path) -> str:
    """The one line in which a vessel file is refused."""
    with pytest.raises(StillhookError) as caught:
        read_vessel(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)
