"""OPC UA: signed and encrypted, for clients whose certificate is trusted.

Basic256Sha256 with signing and encryption is the only policy. Trust belongs to the certificate of the channel, whose
key the client has shown to have; what a client says of itself in a message counts for nothing. Without trust there is
no session, so no reading and no writing. A session is bound to its channel: the server library (asyncua 2.1) would
hand a live session to any channel that names its number, which is switched off.

Who may see the numbers without security, on this machine alone, has to say so (`insecure`).
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from stillhook._version import __version__
from stillhook.base.extras import need
from stillhook.errors import LiveError
from stillhook.live.runtime.board import IMAGE
from stillhook.live.runtime.sink import event
from stillhook.live.servers.bounds import bound_decoding, bounded_server, close_idle
from stillhook.live.servers.counted import Counted
from stillhook.live.servers.library_log import LibraryLog
from stillhook.live.servers.model import Model, build, image
from stillhook.live.servers.served import LOOPBACK, MEASURED, Served, check_address, check_free, is_loopback
from stillhook.live.servers.trust import TrustFolder, fingerprint

if TYPE_CHECKING:
    from asyncua import Client, Server, ua

PORT = 4840
EVERY = 0.1
"""Time between two values of a node [s]."""
SESSION, WATCHDOG = 60.0, 30.0
"""Time-out of a session and of a client's request, and time between two looks of a client whether the server lives [s]:
a busy machine drops sessions at the library's 4 s and 1 s."""
OLD = 1.0
"""Age of the newest row from which values are no longer good [s]."""
CLIENTS = 32
"""Connections at most."""
SUBSCRIPTIONS, QUEUE, UNACKNOWLEDGED = 128, 1000, 100
"""Subscriptions, values that wait for a client by node, and messages that it has not acknowledged, at most: the
library's own limits let one client that acknowledges nothing take some 250 MB."""
WRITE = "request of type 673 without an existing session"
"""How the library warns of a write without a session."""
BURST = 20
"""Events on what was refused that are reported one by one in a second; the others are counted."""
SOURCE = "opcua"


class OpcUaSettings(NamedTuple):
    """Where to listen, and how safely.

    folder: of certificates; host, port: address to listen on; insecure: also without security, on loopback alone.
    """

    folder: Path
    host: str = LOOPBACK
    port: int = PORT
    insecure: bool = False


class OpcUaServer:
    """The server, as an asynchronous context; `publish` sends the newest row.

    Parameters: served: the twin; crane: its name; streamed: how many of its inputs are; settings.

    Errors: LiveError, one line, for an address, a folder or rights that do not do.
    """

    def __init__(self, served: Served, crane: str, streamed: int, settings: OpcUaSettings) -> None:
        need("asyncua", "OPC UA", LiveError)
        check_address(settings.host, settings.port, "opcua")
        if settings.insecure and not is_loopback(settings.host):
            raise LiveError(
                f"opcua: without security on {settings.host}: allowed on {LOOPBACK} alone. Leave --insecure out, and"
                " copy the client's certificate into trusted/."
            )
        self._served, self._crane, self._streamed, self._settings = served, crane, streamed, settings
        self.trust = TrustFolder(settings.folder)
        self._last, self._seen = -1, -math.inf
        self._admitted: dict[str, bytes] = {}
        self._refused: dict[str, Counted] = {}

    async def __aenter__(self) -> OpcUaServer:
        check_free(self._settings.host, self._settings.port, SOURCE)
        but = ("BadUserAccessDenied", "BadSessionIdInvalid")  # told as refused already
        tell = lambda text: self.refuse("refused-write" if WRITE in text else "malformed", text)
        async with contextlib.AsyncExitStack() as stack:
            stack.callback(self._flush)
            stack.enter_context(LibraryLog(("asyncua", "asyncuagds"), "asyncua.server", but, tell))
            await self._start()
            stack.push_async_callback(self._server.stop)
            self._stack = stack.pop_all()
        return self

    async def __aexit__(self, *of: object) -> None:
        await self._stack.aclose()

    @property
    def url(self) -> str:
        """Address for clients."""
        return f"opc.tcp://{self._settings.host}:{self._server.bserver.port}/stillhook"

    async def publish(self) -> None:
        """The newest row to all nodes, once; with a bad status where the kernel is gone or its row is old."""
        from asyncua import ua

        row = self._served.latest()
        if row is None:
            return
        now = time.monotonic()  # a wall clock that jumps makes no row old
        if new := row.number != self._last:
            self._last, self._seen = row.number, now
        good = self._served.alive and now - self._seen < OLD
        if good and not new:
            return
        status = ua.StatusCode(ua.StatusCodes.Good if good else ua.StatusCodes.UncertainLastUsableValue)
        stamp = datetime.fromtimestamp(row.values.get("time_utc", time.time()), UTC)
        for name, nodeid in self._values:
            value = ua.Variant(row.values[name], ua.VariantType.Double)
            data = ua.DataValue(value, status, SourceTimestamp=stamp, ServerTimestamp=datetime.now(UTC))
            await self._server.write_attribute_value(nodeid, data)

    async def serve(self, stopped: Callable[[], bool]) -> None:
        """Publish until it is stopped, at whole steps of time."""
        due = time.monotonic()
        while not stopped():
            await self.publish()
            if closed := close_idle(self._server.bserver.clients, self.trust.trusts):
                self.refuse("refused-session", f"{closed} connections closed that asked for no session.")
            due = max(due + EVERY, time.monotonic())
            await asyncio.sleep(max(0.0, due - time.monotonic()))

    # What is behind it

    async def _start(self) -> None:
        from asyncua import ua

        settings = self._settings
        bound_decoding()
        self._server: Server = bounded_server(iserver=_internal_server(self))
        self._server.set_server_name("Stillhook live")
        await self._server.init()
        await self._server.set_application_uri(self.trust.uri)
        self._server.set_endpoint(f"opc.tcp://{settings.host}:{settings.port}/stillhook")
        policies = [ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt]
        if settings.insecure:
            policies.append(ua.SecurityPolicyType.NoSecurity)
        self._server.set_security_policy(policies)
        self._server.set_identity_tokens([ua.AnonymousIdentityToken])
        await self._server.load_certificate(self.trust.certificate)
        await self._server.load_private_key(self.trust.key)
        internal = self._server.iserver
        internal.min_session_timeout_ms = internal.max_session_timeout_ms = 1e3 * SESSION
        internal.max_connections = CLIENTS
        internal.max_unacked_messages_per_subscription = UNACKNOWLEDGED
        internal.max_subscriptions, internal.max_monitored_item_queue_size = SUBSCRIPTIONS, QUEUE
        served = self._served
        model = await build(self._server, self._crane, __version__, served.names, served.inputs, self._streamed)
        self._keep(model)
        if set(IMAGE) <= set(served.names):
            await image(self._server, served)
        await self._server.start()

    def _keep(self, model: Model) -> None:
        self._values = [(name, node.nodeid) for name, node in model.values]
        self.inputs = {node.nodeid: name for name, node in model.inputs.items()}

    def admits(self, certificate: bytes | None, peer: object) -> str | None:
        """Name of the user behind a channel's certificate; None, and an event, where it is not trusted."""
        if self.trust.trusts(certificate):
            return fingerprint(certificate or b"")
        if self._settings.insecure and not certificate:
            return "without security"
        self.refuse("refused-session", f"Session refused to {_shown(peer)} {self.trust.reject(certificate)}.")
        return None

    def still_admits(self, user: str | None) -> bool:
        """Whether a user of a session is trusted now: trust may have been withdrawn since."""
        if user == "without security":
            return self._settings.insecure
        return user is not None and self.trust.trusts(self._admitted.get(user))

    def remember(self, certificate: bytes | None, user: str) -> None:
        """Keep the certificate behind a user."""
        if certificate:
            self._admitted[user] = certificate

    def refuse(self, name: str, text: str) -> None:
        """An event on what was refused; of a flood a second's is one, with their number."""
        if name not in self._refused:

            def tell(count: int, text: str) -> None:
                self._served.tell(
                    event(SOURCE, name, text if count == 1 else f"{count} times, the last: {text}", count)
                )

            self._refused[name] = Counted(tell, BURST)
        self._refused[name].add(text)

    def _flush(self) -> None:
        for each in self._refused.values():
            each.flush()

    def received(self, values: dict[str, float], stamp: float, user: str | None) -> str:
        """Hand inputs over; why they were refused, or nothing."""
        try:
            self._served.write(values, SOURCE, stamp)
        except LiveError as problem:
            self.refuse("refused-write", f"{problem} Of client {user}.")
            return str(problem)
        return ""


async def client(url: str, trust: TrustFolder, server_certificate: Path) -> Client:
    """A client with security, not connected yet: an asynchronous context. It has the certificate of a folder of its own
    and trusts this server's alone; its time-outs are `SESSION` and `WATCHDOG`."""
    from asyncua import Client, ua
    from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256

    made = Client(url, timeout=SESSION, watchdog_intervall=WATCHDOG)
    made.application_uri = trust.uri
    made.session_timeout = round(1e3 * SESSION)
    await made.set_security(
        SecurityPolicyBasic256Sha256,
        certificate=trust.certificate,
        private_key=trust.key,
        server_certificate=server_certificate,
        mode=ua.MessageSecurityMode.SignAndEncrypt,
    )
    return made


def _shown(peer: object) -> str:
    """An address and port as text."""
    return f"{peer[0]}:{peer[1]}" if isinstance(peer, tuple) and len(peer) >= 2 else "a client"


def _internal_server(owner: OpcUaServer) -> Any:
    """The library's server with sessions that check trust."""
    from asyncua import ua
    from asyncua.common.utils import ServiceError
    from asyncua.crypto.permission_rules import User, UserRole
    from asyncua.server.internal_server import InternalServer
    from asyncua.server.internal_session import InternalSession

    class Session(InternalSession):  # type: ignore[misc]  # untyped library
        """A session of a trusted certificate, bound to its channel."""

        async def create_session(self, params: Any, sockname: Any = None) -> Any:
            """A time-out that is not a number would be without effect."""
            if not math.isfinite(params.RequestedSessionTimeout or 0.0):
                params.RequestedSessionTimeout = 0.0
            return await super().create_session(params, sockname)

        def activate_session(self, params: Any, peer_certificate: bytes | None) -> Any:
            """Errors: BadUserAccessDenied where the channel's certificate is not trusted."""
            user = owner.admits(peer_certificate, self.name)
            if user is None:
                raise ServiceError(ua.StatusCodes.BadUserAccessDenied)
            result = super().activate_session(params, peer_certificate)
            self.user = User(role=UserRole.User, name=user)
            owner.remember(peer_certificate, user)
            return result

        async def write(self, params: Any) -> list[Any]:
            """Inputs alone, by trusted users alone, all of a message together."""
            user = self.user.name if self.user else None
            if not (self.is_activated() and owner.still_admits(user)):
                owner.refuse("refused-write", f"Write refused to {_shown(self.name)}: not trusted.")
                return [ua.StatusCode(ua.StatusCodes.BadUserAccessDenied) for _ in params.NodesToWrite]
            return await _write(self, owner, params, user, super().write)

    class Internal(InternalServer):  # type: ignore[misc]
        """Makes such sessions, and hands none over to another channel."""

        def create_session(self, name: str, user: Any = User(), external: bool = False) -> Any:  # noqa: B008
            """The library forgets a session that a connection requests before another one, and keeps it for ever."""
            if not external:
                return super().create_session(name, user, external)
            for former in [s for s in self._external_sessions.values() if s.name == name and not s.is_activated()]:
                self.unregister_external_session(former)
            return Session(self, self.aspace, self.subscription_service, name, user=user, external=True)

        def register_server(self, server: Any, conf: Any = None) -> None:
            """The twin is not a discovery server: anyone could name another server as the twin to its clients."""
            owner.refuse("refused-session", "Registration of another server refused.")
            raise ServiceError(ua.StatusCodes.BadServiceUnsupported)

        def lookup_external_session(self, auth_token: Any) -> None:
            owner.refuse("refused-session", "Session refused to a channel that named another channel's session.")

    return Internal()


async def _write(session: Any, owner: OpcUaServer, params: Any, user: str | None, store: Any) -> list[Any]:
    """Status of each value of a message: what is an input and a number goes to the twin, then into its node."""
    from asyncua import ua

    codes = ua.StatusCodes
    results: list[Any] = [None] * len(params.NodesToWrite)
    values: dict[str, float] = {}
    accepted: list[int] = []
    stamps: list[float] = []
    refused: list[str] = []
    for i, item in enumerate(params.NodesToWrite):
        name = owner.inputs.get(item.NodeId)
        value = _number(item.Value)
        if value is None and name is not None and name.startswith(f"{MEASURED}.") and _is_nan(item.Value):
            value = math.nan  # a sensor that is not known, which is left out by whoever measures
        if name is None or item.AttributeId != ua.AttributeIds.Value:
            results[i] = ua.StatusCode(codes.BadUserAccessDenied)
            refused.append(f"{item.NodeId.Identifier!s:.60} is not an input")
        elif value is None:
            results[i] = ua.StatusCode(codes.BadTypeMismatch)
            refused.append(f"{name} is one finite number")
        else:
            values[name] = value
            accepted.append(i)
            if item.Value.SourceTimestamp is not None:
                stamps.append(_seconds(item.Value.SourceTimestamp))
    if refused:
        more = f", and {len(refused) - 1} more" if len(refused) > 1 else ""
        owner.refuse("refused-write", f"Write refused to client {user}: {refused[0]}{more}.")
    if values and owner.received(values, max(stamps, default=math.nan), user):
        for i in accepted:
            results[i] = ua.StatusCode(codes.BadOutOfRange)
        accepted = []
    if accepted:
        for i in accepted:
            item = params.NodesToWrite[i]
            item.Value = ua.DataValue(
                ua.Variant(values[owner.inputs[item.NodeId]], ua.VariantType.Double),
                SourceTimestamp=item.Value.SourceTimestamp or datetime.now(UTC),
            )
        stored = await store(ua.WriteParameters([params.NodesToWrite[i] for i in accepted]))
        for i, status in zip(accepted, stored, strict=True):
            results[i] = status
    return results


def _number(data: ua.DataValue) -> float | None:
    """A value that is one finite number; None for anything else."""
    value = None if data is None or data.Value is None else data.Value.Value
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _is_nan(data: ua.DataValue) -> bool:
    """Whether a value is one number, and not finite."""
    value = None if data is None or data.Value is None else data.Value.Value
    return isinstance(value, float) and math.isnan(value)


def _seconds(stamp: datetime) -> float:
    """UTC [s]; NaN where a stamp is beyond what a clock shows."""
    try:
        return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
    except (OverflowError, ValueError, OSError):
        return math.nan
