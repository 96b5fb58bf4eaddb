"""A folder of compiled libraries that only one test uses."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from stillhook.kernels.cache import kernel_folder, make_private


@contextmanager
def new_store() -> Iterator[Path]:
    """A new folder of libraries beside the usual one: the parts of Zig's own are compiled once for both."""
    beside = kernel_folder("native").parent
    make_private(beside)
    with tempfile.TemporaryDirectory(dir=beside) as folder:
        yield Path(folder)
