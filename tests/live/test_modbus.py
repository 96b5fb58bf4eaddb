"""Modbus: registers after a map; writes only where the map and the program allow them; garbage does no harm."""

from __future__ import annotations

import asyncio
import math
import random
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.live.served import Counting

from stillhook.errors import StillhookError
from stillhook.library.examples import LIVE
from stillhook.live.servers.modbus import ModbusServer, ModbusSettings
from stillhook.live.servers.registers import Access, Form, Register, Words, read_registers

pytest.importorskip("pymodbus", reason="the extra live is not installed")

SEED, GARBAGE = 39, 400
NAMES, INPUTS = Counting.names, Counting.inputs
MAP = """\
[[register]]
name = "p_a"
address = 0
type = "uint16"
scale = 0.1
unit = "bar"

[[register]]
name = "s_w"
address = 1
type = "float32"

[[register]]
name = "s_tip"
address = 10
type = "float32"
access = "write"

[[register]]
name = "v_tip"
address = 12
type = "int16"
scale = 0.001
access = "write"
"""
ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3


def registers(text: str, folder: Path) -> tuple[Register, ...]:
    path = folder / "map.toml"
    path.write_text(text)
    return read_registers(path, NAMES, INPUTS)


@given(
    value=st.floats(allow_nan=True, allow_infinity=True, width=64),
    form=st.sampled_from(Form),
    words=st.sampled_from(Words),
    factor=st.sampled_from((1.0, 0.1, 1.0e5)),
)
def test_a_value_comes_back_to_the_resolution_of_its_form_or_not_at_all(
    value: float, form: Form, words: Words, factor: float
):
    of = Register("s_w", 0, form, factor, Access.READ, words)
    back = of.decode(of.encode(value))
    if back is None:
        largest = 3.4e38 if form is Form.FLOAT32 else form.ends[1] if form.integer else 1.0e308
        assert not math.isfinite(value / factor) or abs(value / factor) >= largest - 0.5 or value < 0.0
    else:
        resolution = 0.5 * factor if form.integer else (1e-6 if form is Form.FLOAT32 else 1e-14) * abs(value)
        assert abs(back - value) <= resolution * (1.0 + 1e-9) + 1e-38


@pytest.mark.parametrize("form", Form)
def test_the_low_word_comes_first_where_the_map_says_so(form: Form):
    big, little = (Register("s_w", 0, form, 1.0, Access.READ, words) for words in Words)
    assert little.encode(1234.0) == big.encode(1234.0)[::-1]


def test_a_pressure_in_tenths_of_a_bar(tmp_path: Path):
    (p_a, *_) = registers(MAP, tmp_path)
    assert p_a.encode(123.4e5) == [1234]
    assert p_a.encode(-1.0e5) == p_a.encode(math.nan) == [65_535]  # no value


def test_the_example_is_a_map_of_a_twin():
    names = (*NAMES, "cycle_flags", "late_cycles", "s_w", "v_w", "e_c", "F_w", "p_a", "p_b", "u_p")
    rows = read_registers(LIVE / "registers.toml", names, INPUTS)
    assert {row.name for row in rows if row.access is Access.WRITE} <= set(INPUTS)
    assert [row.address for row in rows] == sorted(row.address for row in rows)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({'"p_a"': '"p_q"'}, 'register "p_q"'),
        ({'unit = "bar"': 'unit = "m"'}, 'unit "m" is not one of'),
        ({"address = 1\n": "address = 0\n"}, "takes registers 0 to 0. Move one."),
        ({"address = 12": "address = 11"}, "takes registers 10 to 11. Move one."),
        ({"address = 12": "address = 65536"}, "address"),
        ({"address = 1\n": "address = 65535\n"}, "65535 is the last one"),
        ({"address = 1\n": 'address = "1"\n'}, "address"),
        ({'"float32"': '"real"'}, "type"),
        ({"scale = 0.1": "scale = 0"}, "scale"),
        ({'name = "s_w"': 'name = "s_w"\naccess = "write"'}, "no input"),
        ({'"v_tip"\naddress = 12\ntype = "int16"': '"s_tip"\naddress = 12\ntype = "int16"'}, "in two places"),
        ({"[[register]]": "[[registers]]"}, "register"),
    ],
)
def test_a_wrong_map_is_refused_in_one_line_that_names_the_file(change: dict[str, str], text: str, tmp_path: Path):
    changed = MAP
    for old, new in change.items():
        assert old in changed
        changed = changed.replace(old, new)
    with pytest.raises(StillhookError) as problem:
        registers(changed, tmp_path)
    assert text in str(problem.value)
    assert str(problem.value).startswith("map.toml")
    assert "\n" not in str(problem.value)


@contextmanager
def server(folder: Path, *, writes: bool) -> Iterator[tuple[asyncio.AbstractEventLoop, Counting, ModbusServer]]:
    (folder / "map.toml").write_text(MAP)
    loop, served = asyncio.new_event_loop(), Counting()

    async def start() -> ModbusServer:
        return await ModbusServer(served, ModbusSettings(folder / "map.toml", port=0, writes=writes)).__aenter__()

    made = loop.run_until_complete(start())
    try:
        yield loop, served, made
    finally:
        loop.run_until_complete(made.__aexit__(None, None, None))
        loop.close()


def ask(loop: asyncio.AbstractEventLoop, of: ModbusServer, *frames: bytes) -> list[bytes]:
    """Answers to frames (function and data) over one connection, without their head."""

    async def run() -> list[bytes]:
        reader, writer = await asyncio.open_connection("127.0.0.1", of.port)
        answers = []
        for i, frame in enumerate(frames):
            writer.write(struct.pack(">HHHB", i, 0, len(frame) + 1, 1) + frame)
            head = await asyncio.wait_for(reader.readexactly(7), 5.0)
            answers.append(await reader.readexactly(struct.unpack(">HHHB", head)[2] - 1))
        writer.close()
        return answers

    return loop.run_until_complete(run())


def read_request(function: int, address: int, count: int) -> bytes:
    return struct.pack(">BHH", function, address, count)


def write_request(address: int, words: list[int]) -> bytes:
    return struct.pack(f">BHHB{len(words)}H", 16, address, len(words), 2 * len(words), *words)


S_TIP = list(struct.unpack(">2H", struct.pack(">f", 0.5)))


def test_all_registers_of_an_answer_are_of_one_cycle(tmp_path: Path):
    with server(tmp_path, writes=False) as (loop, served, of):
        for function in (3, 4):
            (answer,) = ask(loop, of, read_request(function, 0, 3))
            p_a, s_w = struct.unpack(">Hf", answer[2:])
            assert s_w == served.count
            assert p_a == round(served.count / 1.0e4)


def test_a_write_reaches_the_twin_whole_or_not_at_all(tmp_path: Path):
    with server(tmp_path, writes=True) as (loop, served, of):
        refused = {
            "half a number": write_request(10, S_TIP[:1]),
            "read only": write_request(0, [1]),
            "a gap": write_request(10, [*S_TIP, 0, 0]),
            "no number": write_request(10, list(struct.unpack(">2H", struct.pack(">f", math.nan)))),
            "one register of two": struct.pack(">BHH", 6, 10, 1),
            "mask": struct.pack(">BHHH", 22, 12, 0, 1),
            "read and write": struct.pack(">BHHHHBH", 23, 0, 1, 12, 1, 2, 5),
            "coils": struct.pack(">BHH", 5, 10, 0xFF00),
        }
        for reason, frame in refused.items():
            (answer,) = ask(loop, of, frame)
            assert answer[0] == frame[0] | 0x80, reason
            assert served.written == [], reason
        (answer,) = ask(loop, of, write_request(10, [*S_TIP, 250]))
        assert answer[0] == 16
        assert served.written == [{"s_tip": 0.5, "v_tip": 0.25}]
        assert served.told("refused-write")


def test_without_the_option_nothing_is_written_and_the_attempt_is_logged(tmp_path: Path):
    with server(tmp_path, writes=False) as (loop, served, of):
        (answer,) = ask(loop, of, write_request(10, [*S_TIP, 250]))
        assert list(answer) == [0x90, ILLEGAL_FUNCTION]
        assert served.written == []
        assert "started without --allow-writes" in served.told("refused-write")[0]


def test_addresses_outside_of_the_map_are_refused(tmp_path: Path):
    with server(tmp_path, writes=False) as (loop, _, of):
        answers = ask(loop, of, read_request(3, 3, 1), read_request(3, 65_535, 1), read_request(3, 0, 5))
        assert [list(answer) for answer in answers] == [[0x83, ILLEGAL_ADDRESS]] * 3


def test_a_dead_kernel_gives_no_values(tmp_path: Path):
    with server(tmp_path, writes=False) as (loop, served, of):
        served.alive = False
        (answer,) = ask(loop, of, read_request(3, 0, 3))
        p_a, s_w = struct.unpack(">Hf", answer[2:])
        assert p_a == 65_535
        assert math.isnan(s_w)


def test_garbage_ends_no_server_and_writes_nothing(tmp_path: Path):
    """Random bytes, and true heads with random functions and data. Frames that happen to be a true write are left out:
    every function but 6 and 16 is tried."""
    random_bytes = random.Random(SEED)

    async def attack(port: int) -> None:
        for i in range(GARBAGE):
            if i % 40 == 0:
                _, writer = await asyncio.open_connection("127.0.0.1", port)
            body = random_bytes.randbytes(random_bytes.randrange(1, 60))
            if i % 3:
                function = random_bytes.choice([f for f in range(256) if f not in (6, 16)])
                body = bytes([function]) + body
                writer.write(struct.pack(">HHHB", i, 0, len(body) + 1, 1) + body)
            else:
                writer.write(body)
            await writer.drain()
            if i % 40 == 39:
                writer.close()
        await asyncio.sleep(0.05)

    with server(tmp_path, writes=True) as (loop, served, of):
        loop.run_until_complete(attack(of.port))
        assert served.written == []
        (answer,) = ask(loop, of, read_request(3, 1, 2))
        assert struct.unpack(">f", answer[2:])[0] == served.count


def test_random_writes_reach_the_twin_as_finite_inputs_or_not_at_all(tmp_path: Path):
    random_bytes = random.Random(SEED)
    frames = []
    for _ in range(GARBAGE):
        count = random_bytes.randrange(1, 8)
        words = [random_bytes.randrange(65_536) for _ in range(count)]
        frames.append(write_request(random_bytes.randrange(0, 16), words))
    with server(tmp_path, writes=True) as (loop, served, of):
        answers = ask(loop, of, *frames)
        taken = sum(answer[0] == 16 for answer in answers)
        assert taken == len(served.written) > 0
        for written in served.written:
            assert written.keys() <= {"s_tip", "v_tip"}
            assert all(math.isfinite(value) for value in written.values())
