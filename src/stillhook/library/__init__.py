"""Cranes, motors, pump leak tables and system frictions, every number with its source and its kind.

``cranes()`` lists the library's cranes; ``load_crane`` reads one of them, or a file of your own.
"""

from stillhook.library.load import cranes, load_crane
from stillhook.library.sheet import sheet, sheet_json
from stillhook.library.tables import LeakTable, frictions, leak_table, leak_tables, motor, motors, system_friction

__all__ = [
    "LeakTable",
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
