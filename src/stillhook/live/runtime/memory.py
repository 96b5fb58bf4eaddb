"""Memory of the kernel's process that stays where it is: a page that comes back from the disk takes milliseconds."""

from __future__ import annotations

import ctypes
import gc
import sys

CURRENT, FUTURE, ON_FAULT = 1, 2, 4
"""Of mlockall: what is there, what comes, and each page only when it is used first."""
TRIM, MAP = -1, -3
"""Of mallopt: free memory that is given back, and the size from which each piece is mapped by itself."""
LARGE = 1 << 25
"""[bytes]"""


def hold() -> str:
    """Keep every page that is used in memory, give none back, and let the collector of garbage run on demand alone.
    Returns one sentence."""
    gc.collect()
    gc.freeze()
    gc.disable()
    if not sys.platform.startswith("linux"):
        return "Its memory is not held."
    library = ctypes.CDLL(None)
    if hasattr(library, "mallopt"):  # not in every C library
        for option in (TRIM, MAP):
            library.mallopt(option, LARGE)
    if library.mlockall(CURRENT | FUTURE | ON_FAULT) != 0:
        return "Its memory is not held: give it CAP_IPC_LOCK, or its user a memlock of unlimited in limits.conf."
    return "Its memory is held."


def page_faults() -> int:
    """Pages of this process that came from the disk; 0 where the system does not say."""
    if sys.platform == "win32":
        return 0
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_majflt
