"""A Dask cluster on this machine, for the tests of one module."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest


@contextmanager
def local_client(workers: int) -> Iterator[Any]:
    """The client of a cluster of so many workers with one thread each; the tests are skipped where Dask is missing."""
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client
