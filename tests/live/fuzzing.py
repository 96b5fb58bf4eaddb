"""Packets that no honest client sends, seeded, over plain sockets of this machine."""

from __future__ import annotations

import dataclasses
import json
import random
import socket
import struct
from collections import Counter
from collections.abc import Iterator

LOOPBACK = "127.0.0.1"
EXTREMES = (-(2**31), -5, -4, -2, -1, 0, 1, 255, 65_535, 65_536, 2**20, 2**31 - 1)
DEEP = 3000
VARIANT_NULLS = b"\x80" + struct.pack("<i", 2**31 - 1)  # a list of values that take no byte
STEPS_BACK = struct.pack("<3i", -1, 2**31 - 1, -4)  # no address, 2^31 texts, each of which steps back over its length


def requests() -> dict[str, bytes]:
    """A body of every service's request, as an honest client begins one."""
    from asyncua import ua
    from asyncua.ua.ua_binary import struct_to_binary

    kinds = [c for n, c in sorted(vars(ua).items()) if n.endswith("Request") and dataclasses.is_dataclass(c)]
    made = {}
    for kind in kinds:
        request = kind()
        if hasattr(request, "TypeId") and hasattr(request, "RequestHeader"):
            made[kind.__name__] = struct_to_binary(request)
    return made


def bombs() -> dict[str, bytes]:
    """Small bodies that cost a reader without bounds an hour, gigabytes, or its stack."""
    from asyncua import ua
    from asyncua.ua.ua_binary import nodeid_to_binary, struct_to_binary

    whole = requests()
    endpoints = ua.GetEndpointsRequest()
    head = struct_to_binary(endpoints)[: -len(struct_to_binary(endpoints.Parameters))]
    bare = head[: -len(b"\x00\x00\x00")]  # without the null object at the end of the header

    def header_with(body: bytes) -> bytes:
        kind = next(k for k, c in ua.extension_objects_by_typeid.items() if c is ua.AdditionalParametersType)
        return bare + nodeid_to_binary(kind) + b"\x01" + struct.pack("<i", len(body)) + body

    value = struct.pack("<iHi", 1, 0, -1)  # one parameter without a name
    return {
        "null-list": header_with(value + VARIANT_NULLS),
        "deep-variant": header_with(value + b"\x18" * DEEP),
        "deep-diagnostics": header_with(value + b"\x19" + b"\x40" * DEEP),
        "steps-back": head + STEPS_BACK,
        "long-list": head + struct.pack("<2i", -1, 2**31 - 1),
        "dimensions": header_with(value + b"\xc6" + struct.pack("<2i4i", 1, 1, 3, 2**31 - 1, 2**31 - 1, 9)),
        "deep-dimensions": header_with(
            value + b"\xc6" + struct.pack("<3i", 1, 1, 900) + struct.pack("<900i", *[1] * 899, 10**6)
        ),
        "register": whole["RegisterServerRequest"],
        "write": whole["WriteRequest"],
        "read": whole["ReadRequest"],
        "add-nodes": whole["AddNodesRequest"],
    }


def message(r: random.Random, body: bytes, kind: bytes = b"MSG", chunk: bytes = b"F", number: int = 1) -> bytes:
    """A chunk of a channel without security."""
    inner = struct.pack("<4I", 0, 0, number, r.randrange(1, 1000)) + body
    return kind + chunk + struct.pack("<I", len(inner) + 8) + inner


def hello(r: random.Random, honest: bool = True) -> bytes:
    sizes = (65_535, 65_535, 0, 0) if honest else [r.choice(EXTREMES) & 0xFFFFFFFF for _ in range(4)]
    inner = struct.pack("<5I", 0, *sizes) + struct.pack("<i", r.choice((-1, 0, 0, 2**31 - 1)) if not honest else -1)
    return b"HELF" + struct.pack("<I", len(inner) + 8) + inner


def mutated(r: random.Random, data: bytes) -> bytes:
    """A body with one to four things wrong."""
    made = bytearray(data)
    for _ in range(r.randrange(1, 5)):
        at = r.randrange(len(made)) if made else 0
        wrong = r.randrange(6)
        if wrong == 0:
            made[at : at + 4] = struct.pack("<i", r.choice(EXTREMES))
        elif wrong == 1:
            del made[at:]
        elif wrong == 2:
            made[at : at + 1] = r.randbytes(1)
        elif wrong == 3:
            made[at:at] = r.randbytes(r.randrange(1, 40))
        elif wrong == 4:
            made += r.randbytes(r.randrange(1, 200))
        else:
            made[at:at] = r.choice((VARIANT_NULLS, STEPS_BACK, b"\x18" * 50))
    return bytes(made)


def opcua_connections(r: random.Random) -> Iterator[tuple[str, list[bytes]]]:
    """What each connection sends, with a word for it; without end."""
    whole, evil = requests(), bombs()
    names = sorted(whole)
    while True:
        for word, body in evil.items():
            yield word, [hello(r), message(r, body)]
        for _ in range(20):
            word = r.choice(
                ("mutated", "mutated", "lying-size", "chunks", "random", "hello", "numbers", "many-sessions")
            )
            opened = [hello(r)]
            if r.random() < 0.5:
                opened.append(message(r, whole["OpenSecureChannelRequest"], b"OPN"))
            if word == "mutated":
                kinds = (b"MSG", b"MSG", b"MSG", b"OPN", b"CLO")
                opened += [
                    message(r, mutated(r, whole[r.choice(names)]), r.choice(kinds), number=1 + i) for i in range(8)
                ]
            elif word == "lying-size":
                body = message(r, whole[r.choice(names)])
                size = r.choice((0, 7, 8, 11, 12, 13, len(body) - 1, len(body) + 1, 65_536, 2**31, 2**32 - 1))
                opened += [body[:4] + struct.pack("<I", size) + body[8:], r.randbytes(r.randrange(1, 5000))]
            elif word == "chunks":
                opened += [message(r, r.randbytes(2000), chunk=b"C", number=1 + i) for i in range(r.randrange(1, 30))]
                opened += [message(r, b"", chunk=r.choice((b"A", b"F", b"X")), number=r.randrange(40))]
            elif word == "random":
                opened = [r.randbytes(r.randrange(1, 3000)) for _ in range(r.randrange(1, 4))]
            elif word == "hello":
                opened = [hello(r, honest=False), message(r, whole["GetEndpointsRequest"])]
            elif word == "numbers":
                sequence = [r.choice((0, 1, 2, 2**32 - 1, 2**31)) for _ in range(6)]
                opened += [message(r, whole[r.choice(names)], number=n) for n in sequence]
            else:
                opened += [message(r, whole["CreateSessionRequest"], number=1 + i) for i in range(20)]
            yield word, opened


def modbus_connections(
    r: random.Random, functions: tuple[int, ...] = tuple(range(256))
) -> Iterator[tuple[str, list[bytes]]]:
    """The same for Modbus; functions: those that are tried."""

    def frame(body: bytes, size: int | None = None, protocol: int = 0) -> bytes:
        length = len(body) + 1 if size is None else size
        return struct.pack(">HHHB", r.randrange(65_536), protocol, length, r.randrange(256)) + body

    while True:
        word = r.choice(("functions", "lying-size", "protocol", "random", "pipelined", "fragments", "counts"))
        bodies = [bytes([r.choice(functions)]) + r.randbytes(r.randrange(0, 252)) for _ in range(6)]
        sent = [frame(body) for body in bodies]
        if word == "lying-size":
            sent = [frame(b, r.choice((0, 1, 2, 3, len(b), len(b) + 2, 260, 65_535))) for b in bodies]
        elif word == "protocol":
            sent = [frame(b, protocol=r.choice((0, 1, 65_535))) for b in bodies]
        elif word == "random":
            sent = [r.randbytes(r.randrange(1, 400)) for _ in range(4)]
        elif word == "pipelined":
            sent = [b"".join(sent)]
        elif word == "fragments":
            whole = b"".join(sent[:2])
            sent = [whole[i : i + 7] for i in range(0, len(whole), 7)]
        elif word == "counts":
            pick = [f for f in functions if f in (1, 2, 3, 4, 5, 6, 15, 16, 22, 23)] or list(functions)
            sent = [
                frame(
                    struct.pack(">BHH", r.choice(pick), r.randrange(65_536), r.choice((0, 1, 125, 126, 2000, 65_535)))
                )
                for _ in range(6)
            ]
        yield word, sent


def datagrams(r: random.Random) -> Iterator[tuple[str, bytes]]:
    """The same for UDP. Nothing of it is a message with inputs."""
    texts = {
        "not-finite": ['{"s_tip": NaN}', '{"s_tip": Infinity, "v_tip": 0}', '{"s_tip": 1e999}', '{"s_tip": -1e400}'],
        "deep": ["[" * DEEP, '{"a":' * 400, '{"s_tip":' + "[" * 1900],
        "twice": ['{"s_tip": 1, "s_tip": 2}', '{"s_tip": NaN, "s_tip": 1, "v_tip": 0}'],
        "big": ['{"s_tip": 1' + "0" * 1900 + "}", '{"s_tip": -' + "9" * 1900 + "}"],
        "names": ['{"\\ud800": 1}', '{"\\u001b[2J": 1}', '{"' + "n" * 1900 + '": 1}', '{"": 1}', '{"p_a": 1}'],
        "forms": ["", "{}", "[]", "null", "1", '"s_tip"', '{"s_tip": "1"}', '{"s_tip": true}', '{"s_tip": null}'],
    }
    while True:
        for word, several in texts.items():
            for text in several:
                yield word, text.encode()
        for _ in range(10):
            yield "random", r.randbytes(r.randrange(0, 2100))
            yield "sizes", b" " * r.choice((0, 1, 2047, 2048, 2049, 8000, 65_507))
            count = r.choice((0, 1, 100, 2**31, 2**32 - 1))
            yield "packed", b"SHR1" + struct.pack("<I", count) + r.randbytes(8 * min(count, 100))
            yield "encodings", json.dumps({"s_tip": "x"}).encode(r.choice(("utf-16", "utf-32", "utf-16-be", "utf-7")))


def send(port: int, sent: list[bytes], r: random.Random) -> None:
    """One connection: what is sent, perhaps some of the answer read, and an end of one sort or another."""
    try:
        with socket.create_connection((LOOPBACK, port), timeout=2.0) as of:
            for data in sent:
                of.sendall(data)
                if r.random() < 0.1:
                    of.settimeout(0.005)
                    of.recv(65_536)
            if r.random() < 0.5:
                of.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # reset at once
    except OSError:  # closed by the server, or no answer
        pass


def attack_tcp(port: int, connections: Iterator[tuple[str, list[bytes]]], count: int, r: random.Random) -> Counter[str]:
    """That many connections, one after another, among some that stay open and send a byte now and then."""
    done: Counter[str] = Counter()
    slow: list[socket.socket] = []
    for _ in range(count):
        word, sent = next(connections)
        send(port, sent, r)
        done[word] += 1
        if r.random() < 0.1:
            try:
                slow.append(socket.create_connection((LOOPBACK, port), timeout=2.0))
                slow[-1].settimeout(0.05)
            except OSError:
                continue
            done["slow"] += 1
        for each in slow[:]:
            try:
                each.send(sent[0][:1] or b"\0")
            except OSError:
                slow.remove(each)
        while len(slow) > 50:
            slow.pop(0).close()
    for each in slow:
        each.close()
    return done
