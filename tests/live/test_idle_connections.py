"""Connections without a session are closed when they are old, and the oldest strangers where too many wait."""

import time
from types import SimpleNamespace

import pytest

pytest.importorskip("asyncua")

from stillhook.live.servers.bounds import PATIENCE, PENDING, close_idle


def connection(age: float, *, trusted: bool = False, session: bool = False) -> SimpleNamespace:
    policy = SimpleNamespace(peer_certificate=b"known" if trusted else None)
    processor = SimpleNamespace(
        session=SimpleNamespace(is_activated=lambda: session), _connection=SimpleNamespace(security_policy=policy)
    )
    return SimpleNamespace(
        since=time.monotonic() - age, processor=processor, transport=SimpleNamespace(abort=lambda: None)
    )


def closed(connections: list[SimpleNamespace]) -> int:
    return close_idle(connections, lambda certificate: certificate == b"known")


def test_as_many_as_may_wait_are_left_alone_and_one_more_costs_one_stranger():
    for number in (0, 1, PENDING - 1, PENDING):
        assert closed([connection(0.01 * k) for k in range(number)]) == 0
    assert closed([connection(0.01 * k) for k in range(PENDING + 1)]) == 1
    assert closed([connection(0.01 * k) for k in range(PENDING + 5)]) == 5


def test_who_has_a_session_or_a_trusted_certificate_is_not_closed_for_the_others():
    assert closed([connection(0.0, trusted=True) for _ in range(PENDING + 3)]) == 0
    assert closed([connection(0.0, session=True) for _ in range(PENDING + 3)]) == 0
    assert closed([*(connection(0.0, trusted=True) for _ in range(PENDING)), connection(0.0)]) == 1


def test_who_waits_too_long_is_closed_whoever_it_is():
    old = PATIENCE + 5.0
    assert closed([connection(old), connection(old, trusted=True), connection(old, session=True)]) == 2
