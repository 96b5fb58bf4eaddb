"""Encrypted clients of a twin, each with a certificate of its own, that keep account of every notification:
`python -m trials.endurance.clients URL FOLDER SERVER_CERTIFICATE CLIENTS SECONDS`."""

from __future__ import annotations

import asyncio
import json
import struct
import sys
import zlib
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from stillhook.live.servers.model import NAMESPACE
from stillhook.live.servers.opcua import client
from stillhook.live.servers.trust import TrustFolder

PERIOD, QUEUE = 100, 200
"""Of a subscription [ms]; values of a node that wait for the client."""


class Account:
    """Of each node: its time stamps, the first and the last [us since 1970], how many values came, and their CRC."""

    def __init__(self) -> None:
        self.nodes: dict[str, list[int]] = {}
        self.backwards = 0

    def datachange_notification(self, node: Any, value: float, data: Any) -> None:
        stamp = round(1e6 * data.monitored_item.Value.SourceTimestamp.replace(tzinfo=UTC).timestamp())
        of = self.nodes.setdefault(node.nodeid.Identifier, [stamp, stamp, 0, 0])
        self.backwards += stamp < of[1]
        of[1:] = stamp, of[2] + 1, zlib.crc32(struct.pack("<d", value), of[3])


def trust_folders(folder: Path, count: int) -> list[TrustFolder]:
    return [TrustFolder(folder / f"client-{i}", f"client-{i}") for i in range(count)]


async def watch(url: str, own: TrustFolder, server: Path, names: list[str], seconds: float) -> Account:
    account = Account()
    async with await client(url, own, server) as of:
        space = await of.get_namespace_index(NAMESPACE)
        subscription = await of.create_subscription(PERIOD, account)
        nodes = [of.get_node(f"ns={space};s={name}") for name in names]
        await subscription.subscribe_data_change(nodes, queuesize=QUEUE)
        await asyncio.sleep(seconds)
        await subscription.delete()
    return account


async def main(url: str, folder: Path, server: Path, count: int, seconds: float) -> None:
    names = (folder / "names.txt").read_text(encoding="utf-8").splitlines()
    began = datetime.now(UTC).isoformat()
    own = trust_folders(folder, count)
    accounts = await asyncio.gather(*(watch(url, each, server, names, seconds) for each in own))
    found = [{"backwards": each.backwards, "nodes": each.nodes} for each in accounts]
    (folder / "clients.json").write_text(json.dumps({"began": began, "clients": found}), encoding="utf-8")


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]), int(sys.argv[4]), float(sys.argv[5])))
