"""`--scheduler ADDRESS`: the workers of a dask.distributed cluster instead of this machine's threads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

Scheduler = Annotated[
    str | None, typer.Option("--scheduler", help='Address of a Dask scheduler, such as "tcp://10.0.0.1:8786".')
]
PATIENCE = 15.0
"""Time for a scheduler to answer, and then for its first worker [s]."""


@contextmanager
def client_of(address: str | None) -> Iterator[Any]:
    """A client of the scheduler at this address, closed at the end; None without an address.

    Errors: SimulationError, one line, where dask.distributed is not installed, no scheduler answers, or it has no
    workers.
    """
    if address is None:
        yield None
        return
    from stillhook.errors import SimulationError
    from stillhook.units import quote

    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError:
        raise SimulationError(
            '--scheduler: dask.distributed is not installed. Install it with pip install "stillhook[dask]", here and on'
            " every worker."
        ) from None
    try:
        get_address_host_port(address)  # a client with no address complains once more when it is collected
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as e:
        reason = " ".join(str(e).split())[:120] or type(e).__name__
        raise SimulationError(
            f"--scheduler {quote(address)}: no Dask scheduler answers ({reason})."
            " Start one with dask scheduler, and give its address."
        ) from None
    try:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise SimulationError(
                f"--scheduler {quote(address)}: no workers. Start some with dask worker {address}."
            ) from None
        yield client
    finally:
        client.close()
