"""Tasks on a Dask cluster: who may be spoken to, and what happens to tasks of workers that are lost.

Whoever may speak to a Dask scheduler runs what they like on its workers: that is what Dask is for. So a scheduler
beyond this machine is spoken to by TLS, whose certificates say who takes part, unless the user names it as one of a
closed network.
"""

from __future__ import annotations

import ipaddress
import os
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any
from urllib.parse import urlsplit

from stillhook.base.progress import Meter
from stillhook.engine.tasks import Answers, Task
from stillhook.engine.tasks.carried import answer_to, error_of, pack_task, unpack_answer
from stillhook.errors import SimulationError, StillhookError
from stillhook.kernels.build import results_hash
from stillhook.units import quote

IN_FLIGHT = 3
"""Tasks given to a cluster at once, for each of its threads: more would only fill the scheduler's memory."""
RETURN = 30.0
"""Time for which a scheduler that is lost may be away [s]; Dask's client tries for as long to reach it again."""
VARIABLE = "STILLHOOK_CLOSED_NETWORK"
"""Environment variable with the hosts of schedulers that are spoken to without TLS, separated by commas."""
ENCRYPTED = ("tls", "wss", "inproc")
"""Protocols whose messages nobody else reads or sends; the last is this process."""


def check_address(address: str) -> None:
    """Errors: SimulationError for a scheduler beyond this machine without TLS, unless its network is closed, and for
    what is no address."""
    try:
        parts = urlsplit(address if "://" in address else f"tcp://{address}")
        host = parts.hostname or ""
    except ValueError as problem:
        raise SimulationError(f"scheduler {quote(address)}: no address ({problem}). Write tls://HOST:PORT.") from None
    if parts.scheme in ENCRYPTED:
        return
    closed = [each.strip().lower() for each in os.environ.get(VARIABLE, "").split(",")]
    if is_loopback(host) or (host and host in closed):
        return
    raise SimulationError(
        f"scheduler {quote(address)}: without TLS anyone who reaches it runs code on its workers and here. Use tls://"
        f" with certificates (docs/how-to/run-on-many-machines.md), or set {VARIABLE}={host} on a network of your"
        " own."
    )


def check_certificates(address: str) -> None:
    """Errors: SimulationError for tls:// where Dask's settings name no certificates, or files that are none, and for
    another address where they require encryption."""
    from distributed import Security

    if not address.startswith("tls://"):
        if Security().require_encryption and urlsplit(address).scheme not in ENCRYPTED:
            raise SimulationError(
                f"scheduler {quote(address)}: Dask's settings require encryption. Write tls:// in place of what is"
                " before the host, or unset DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION."
            )
        return
    try:
        reason = "" if Security().get_connection_args("client").get("ssl_context") is not None else "none is named"
    except (OSError, ValueError, TypeError) as problem:
        reason = " ".join(str(problem).split())[:120]
    if reason:
        raise SimulationError(
            f"scheduler {quote(address)}: no certificates ({reason}). Set DASK_DISTRIBUTED__COMM__TLS__CA_FILE, and"
            " ..__CLIENT__CERT and ..__CLIENT__KEY, to their files (docs/how-to/run-on-many-machines.md)."
        )


def is_loopback(host: str) -> bool:
    """Whether this is the machine itself, by its number or the name localhost."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def on_cluster(tasks: Sequence[Task], client: Any, meter: Meter) -> Answers:
    """Tasks with what is kept of their runs; a few are under way for each thread of the cluster, and those of a lost
    worker are given again.

    Errors: those of a case; SimulationError where the cluster fails, runs other code, or is not to be spoken to.
    """
    import distributed

    check_address(str(client.scheduler.address))
    rest = deque(tasks)
    submitted: dict[str, tuple[Any, Task]] = {}

    def submit_next(put: Callable[[Any], None]) -> None:
        if rest:
            task = rest.popleft()
            future = client.submit(answer_to, pack_task(task), pure=False)
            submitted[future.key] = future, task
            put(future)

    try:
        while rest:
            under_way = distributed.as_completed(loop=client.loop)
            for _ in range(IN_FLIGHT * max(sum(client.nthreads().values()), 1)):
                submit_next(under_way.add)
            for future in under_way:
                if future.cancelled():  # its scheduler is gone, and all that was under way with it
                    rest.extendleft(task for _, task in submitted.values())
                    submitted.clear()
                    _wait_for_return(client)
                    break
                kept, (_, task) = _answer_of(future), submitted.pop(future.key)
                meter.part(task.seconds)(1.0)
                yield task, kept
                submit_next(under_way.add)
    finally:
        if submitted:
            with suppress(Exception):  # the cluster may be what failed
                client.cancel([future for future, _ in submitted.values()])


def _wait_for_return(client: Any) -> None:
    """Wait until a scheduler that was lost is there again, with a worker. Errors: SimulationError after `RETURN`."""
    end = time.monotonic() + RETURN
    while time.monotonic() < end:
        with suppress(Exception):  # whatever a connection that comes and goes makes of a question
            if client.status == "running" and client.nthreads():
                return
        time.sleep(0.2)
    raise SimulationError(
        f"cluster: the scheduler was lost, and did not return with a worker within {RETURN:g} s. Start it and run"
        " again; a store keeps what is done."
    )


def _answer_of(future: Any) -> list[Any]:
    """What a worker gave back. Errors: those of the case; SimulationError where the worker failed, or runs other code
    than this machine."""
    try:
        answer = unpack_answer(future.result())
    except StillhookError:
        raise
    except Exception as e:
        error = f"{type(e).__name__}: {' '.join(str(e).split())}"
        raise SimulationError(
            f"cluster: a task failed ({error[:200]}). Look at its workers, and run again; a store keeps what is done."
        ) from None
    if answer.error is not None:
        raise error_of(*answer.error)
    if answer.kept is None:
        raise SimulationError(
            f"cluster: a worker runs Stillhook {answer.made_by}, this machine {results_hash()}. Install the same"
            " version everywhere."
        )
    return answer.kept
