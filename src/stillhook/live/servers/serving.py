"""Servers in the process of the twin, until a person stops them."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

from stillhook.base.signals import noted
from stillhook.live.live_file import LivePlan
from stillhook.live.runtime import LiveTwin, event
from stillhook.live.servers.modbus import ModbusServer
from stillhook.live.servers.opcua import OpcUaServer
from stillhook.live.servers.served import Served
from stillhook.live.servers.udp import UdpServer

LOOK = 0.05
"""Time between two looks at rows, events and whether to stop [s]."""


def serve(
    twin: LiveTwin, served: Served, plan: LivePlan | None, done: Callable[[], bool], ready: Callable[[str], None]
) -> None:
    """Run the servers of a plan until `done` says so, or a signal asks for the end, or the kernel refuses to continue.

    served: what the servers show, the twin itself or more; ready: takes each server's address.

    Errors: LiveError where a server cannot start.
    """
    with noted() as stopped:
        asyncio.run(_serve(twin, served, plan, lambda: stopped() or done(), ready))


async def _serve(
    twin: LiveTwin, served: Served, plan: LivePlan | None, done: Callable[[], bool], ready: Callable[[str], None]
) -> None:
    over = False
    tasks: list[asyncio.Task[None]] = []
    async with contextlib.AsyncExitStack() as stack:
        if plan is not None and plan.opcua is not None:
            opcua = OpcUaServer(served, plan.case.crane.name, twin.face.streamed, plan.opcua)
            await stack.enter_async_context(opcua)
            ready(f"OPC UA {opcua.url}, trusted clients in {opcua.trust.trusted}")
            tasks.append(asyncio.create_task(opcua.serve(lambda: over)))
        if plan is not None and plan.modbus is not None:
            modbus = await stack.enter_async_context(ModbusServer(served, plan.modbus))
            ready(f"Modbus TCP {plan.modbus.host}:{modbus.port}, writes {'taken' if plan.modbus.writes else 'refused'}")
        if plan is not None and plan.udp is not None:
            udp = await stack.enter_async_context(UdpServer(served, plan.udp))
            ready(f"UDP {plan.udp.host}:{udp.port} to {plan.udp.to_host}:{plan.udp.to_port}")
            tasks.append(asyncio.create_task(udp.serve(lambda: over)))
        served.pump()
        twin.tell(event("twin", "serving", "Servers are ready."))
        try:
            while not done():
                ended = twin.ended
                served.pump()
                if ended:
                    break
                for task in tasks:
                    if task.done():
                        task.result()
                await asyncio.sleep(LOOK)
        finally:
            over = True
            await asyncio.gather(*tasks)
