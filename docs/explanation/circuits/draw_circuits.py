"""Draw the circuits of the winch types and of the passive compensator as SVG.

python docs/explanation/circuits/draw_circuits.py           into the package, for `stillhook thesis`; with a folder,
                                                            into that
"""

import sys
from collections.abc import Callable
from pathlib import Path

import closed_circuits
import further_circuits
from sheet import Sheet

PACKAGE = Path(__file__).resolve().parents[3] / "src" / "stillhook" / "thesis" / "data"
DRAWINGS: dict[str, Callable[[], Sheet]] = {
    "pure-active": closed_circuits.pure_active,
    "active-passive": closed_circuits.active_passive,
    "open-circuit": further_circuits.open_circuit,
    "secondary": further_circuits.secondary,
    "digital": further_circuits.digital,
    "cylinder": further_circuits.cylinder,
    "electric": further_circuits.electric,
    "phc": further_circuits.phc,
}


def main(folder: Path = PACKAGE) -> None:
    """Write every drawing into a folder."""
    for name, draw in DRAWINGS.items():
        draw().save(folder / f"{name}.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else PACKAGE)
