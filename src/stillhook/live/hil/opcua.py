"""A soft PLC as an OPC UA client of the twin: signed and encrypted, each side trusting the other's certificate."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.gateway.access import read_bytes
from stillhook.base.gateway.budget import PROGRAM
from stillhook.errors import LiveError
from stillhook.live.hil.bus import BusError, Image, quiet
from stillhook.live.runtime.board import IMAGE
from stillhook.live.servers.model import IMAGE_NODE, NAMESPACE
from stillhook.live.servers.opcua import client
from stillhook.live.servers.trust import TrustFolder, fingerprint

BAD = 0xC000_0000
"""Bits of a status code that is uncertain or bad."""
CONNECT = 10.0
"""Time for a connection [s]: keys are exchanged and the session is made."""


class OpcUaBusSettings(NamedTuple):
    """url of the server; folder of the PLC's own certificate; server: the server's certificate, which is trusted."""

    url: str
    folder: Path
    server: Path


class OpcUaBus:
    """The bus. Errors: LiveError, one line, where a certificate is missing or the server refuses."""

    def __init__(self, settings: OpcUaBusSettings) -> None:
        self._settings = settings
        self.trust = TrustFolder(settings.folder, "plc")
        self.label = f"OPC UA {settings.url}, signed and encrypted"
        self._client: Any = None
        self._quiet = contextlib.ExitStack()
        if not settings.server.is_file():
            raise LiveError(
                f"opcua: server = {settings.server}: no such file. Start the twin once (stillhook live run), and give"
                " its opcua/own/certificate.der."
            )

    async def connect(self) -> None:
        """As of `Bus`."""
        await self.close()
        self._quiet.enter_context(quiet("asyncua"))
        made = await client(self._settings.url, self.trust, self._settings.server)
        try:
            await asyncio.wait_for(made.connect(), CONNECT)
            self._client = made
            space = await made.get_namespace_index(NAMESPACE)
        except Exception as problem:
            await _let_go(made)
            self._client = None
            raise self._refusal(problem) from None
        from asyncua import ua

        self._node = ua.NodeId(IMAGE_NODE, space)
        self._space = space

    def _refusal(self, problem: Exception) -> LiveError:
        """Why there is no connection."""
        text = f"{type(problem).__name__} {problem}"
        if any(code in text for code in ("BadUserAccessDenied", "BadCertificateUntrusted", "BadSecurityChecksFailed")):
            own = self.trust.certificate
            name = fingerprint(read_bytes(own, "certificate", LiveError, PROGRAM))
            return LiveError(
                f"{self._settings.url}: the twin does not trust this PLC. Copy {own} into the twin's opcua/trusted/ as"
                f" {name}.der, after comparing the fingerprint {name}, and start again."
            )
        return BusError(f"{self._settings.url}: no connection ({text.strip()}). Start the twin: stillhook live run.")

    async def read(self) -> Image:
        """As of `Bus`."""
        from asyncua import ua

        data = (await self._call(lambda c: c.uaclient.read_attributes([self._node], ua.AttributeIds.Value)))[0]
        values = None if data.Value is None else data.Value.Value
        if not isinstance(values, list) or len(values) != len(IMAGE):
            raise LiveError(
                f"{self._settings.url}: serves no process image of a PLC. Write sensed = true into the twin's live"
                " file."
            )
        return Image(np.array(values, dtype=np.float64), not data.StatusCode.value & BAD)

    async def write(self, values: Mapping[str, float]) -> None:
        """As of `Bus`."""
        from asyncua import ua

        nodes = [ua.NodeId(f"Inputs.{name}", self._space) for name in values]
        data = [ua.DataValue(ua.Variant(float(value), ua.VariantType.Double)) for value in values.values()]
        statuses = await self._call(lambda c: c.uaclient.write_attributes(nodes, data, ua.AttributeIds.Value))
        for name, status in zip(values, statuses, strict=True):
            if int(status.value) & BAD:
                raise LiveError(f"{self._settings.url}: refused {name} = {values[name]:g} ({status.name}).")

    async def _call(self, request: Any) -> Any:
        if self._client is None:
            raise BusError(f"{self._settings.url}: not connected.")
        try:
            return await request(self._client)
        except Exception as problem:
            raise BusError(f"{self._settings.url}: no answer ({type(problem).__name__} {problem}).") from None

    async def close(self) -> None:
        """As of `Bus`."""
        made, self._client = self._client, None
        if made is not None:
            await _let_go(made)
        self._quiet.close()

    def resolution(self, name: str) -> float:
        """As of `Bus`: doubles."""
        return 0.0


async def _let_go(made: Any) -> None:
    """Disconnect, in any state of the connection."""
    with contextlib.suppress(Exception):
        await asyncio.wait_for(made.disconnect(), 1.0)
    with contextlib.suppress(Exception):
        made.disconnect_socket()
