"""Cranes, motors, pump leak tables and system frictions, every number with its source and its kind.

``cranes()`` lists the library's cranes; ``load_crane`` reads one of them, or a file of your own;
``load_set`` reads a system friction or a motor with its uncertainty, ``set_toml`` writes one;
``changed`` gives a crane with other values, ``crane_toml`` writes one as a file.
"""

from stillhook.library.catalogue import LeakTable, frictions, leak_table, leak_tables, motor, motors, system_friction
from stillhook.library.crane_file import changed, crane_from_toml, cranes, load_crane
from stillhook.library.parameter_sets import (
    Evidence,
    FrictionSet,
    LossSet,
    load_friction,
    load_losses,
    load_set,
    set_toml,
)
from stillhook.library.write import certified_crane_toml, crane_toml, sheet, sheet_json

__all__ = [
    "Evidence",
    "FrictionSet",
    "LeakTable",
    "LossSet",
    "certified_crane_toml",
    "changed",
    "crane_from_toml",
    "crane_toml",
    "cranes",
    "frictions",
    "leak_table",
    "leak_tables",
    "load_crane",
    "load_friction",
    "load_losses",
    "load_set",
    "motor",
    "motors",
    "set_toml",
    "sheet",
    "sheet_json",
    "system_friction",
]
