"""Cranes, motors, pump leak tables and system frictions, every number with its source and its kind.

``cranes()`` lists the library's cranes; ``load_crane`` reads one of them, or a file of your own;
``changed`` gives a crane with other values, ``crane_toml`` writes one as a file.
"""

from stillhook.library.load import changed, crane_from_toml, cranes, load_crane
from stillhook.library.sheet import sheet, sheet_json
from stillhook.library.tables import LeakTable, frictions, leak_table, leak_tables, motor, motors, system_friction
from stillhook.library.write import crane_toml

__all__ = [
    "LeakTable",
    "changed",
    "crane_from_toml",
    "crane_toml",
    "cranes",
    "frictions",
    "leak_table",
    "leak_tables",
    "load_crane",
    "motor",
    "motors",
    "sheet",
    "sheet_json",
    "system_friction",
]
