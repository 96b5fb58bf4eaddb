"""Draw the circuits of the winch types: python docs/explanation/circuits/make.py [folder]."""

import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import closed_circuits
import cylinder_circuits
import rail_circuits
from symbols import Sheet

HERE = Path(__file__).parent
DRAWINGS: dict[str, Callable[[], Sheet]] = {
    "pure-active": closed_circuits.pure_active,
    "active-passive": closed_circuits.active_passive,
    "open-circuit": rail_circuits.open_circuit,
    "secondary": rail_circuits.secondary,
    "electric": rail_circuits.electric,
    "cylinder": cylinder_circuits.cylinder,
}


def main(folder: Path = HERE) -> None:
    """Write every drawing into a folder."""
    for name, draw in DRAWINGS.items():
        draw().save(folder / f"{name}.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
