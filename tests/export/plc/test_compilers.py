"""The exported files, read by a free compiler and by a schema, where this machine has them.

STILLHOOK_IEC2C: the compiler iec2c of MATIEC; STILLHOOK_IEC2C_LIB: its folder lib, default beside it.
STILLHOOK_TC6_XSD: the schema of PLCopen XML 2.01 (needs the Python package lxml).
"""

from __future__ import annotations

import functools
import math
import os
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from tests.export.plc.cases import (
    CLOSED,
    N_SIGNALS,
    GuardedPlc,
    all_good,
    bits,
    block_of,
    cycles_of,
    faulty,
    pairs,
    random_inputs,
)

import stillhook
from stillhook.control.guard import HEALTHY, STOPPED, SUBSTITUTED
from stillhook.control.interface import Sensed
from stillhook.errors import LiveError
from stillhook.export.plc import structured_text
from stillhook.export.plc.sequence import Reference
from stillhook.export.plc.text import SPACE, XHTML, plcopen_xml
from stillhook.kernels.plc_alone import GuardedCommands
from stillhook.library import load_crane
from stillhook.live.hil.controller import LibraryController
from stillhook.live.hil.structured_text import COMPILERS, CompiledText, Matiec

CYCLES = 100_000
FAULTY, FAULTY_LONG = 5_000, 1_000_000
CLOSED_LOOP = 3_000
STATE = GuardedCommands._fields.index("state")
compiled = pytest.mark.skipif(all(each.find() is None for each in COMPILERS), reason=f"looked for: {Matiec.looked_for}")


@functools.cache
def compiled_text(crane, controller):
    return CompiledText(load_crane(crane), controller)


def program(crane, controller):
    """What a compiler makes of the text of a crane's controller, before its first cycle."""
    made = compiled_text(crane, controller)
    made.start()
    return made


@compiled
@pytest.mark.slow
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_a_free_compiler_takes_the_text_and_its_program_passes_the_test_sequence(crane, controller):
    rows, expected = cycles_of(crane, controller)
    np.testing.assert_array_equal(bits(program(crane, controller).cycles(rows)), bits(expected))


def rows_with_faults(block, n, seed):
    """Any value on any signals for any time, bad qualities and resets."""
    rows = faulty(block, n, seed)
    rows[:, N_SIGNALS:] = np.abs(rows[:, N_SIGNALS:] - 1.0) < 0.5  # BOOL
    return rows


@compiled
@pytest.mark.slow
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_random_faults_give_the_program_the_bits_of_the_simulated_controller(crane, controller):
    block = block_of(crane, controller)
    rows, reference = rows_with_faults(block, FAULTY, 5), Reference(block)
    wanted = [reference.step(Sensed(*r[:N_SIGNALS]), Sensed(*r[N_SIGNALS:-1]), r[-1]) for r in rows.tolist()]
    ours = program(crane, controller).cycles(rows)
    np.testing.assert_array_equal(bits(ours), bits(np.array(wanted)))
    assert set(ours[:, STATE]) == {HEALTHY, SUBSTITUTED, STOPPED}


@compiled
@pytest.mark.thorough
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_a_million_cycles_with_faults_give_the_program_the_numbers_of_the_compiled_controller(crane, controller):
    """The compiled one may give the other sign of a zero."""
    block = block_of(crane, controller)
    rows = rows_with_faults(block, FAULTY_LONG, 6)
    ours = program(crane, controller).cycles(rows)
    np.testing.assert_array_equal(ours, GuardedPlc(block).run(rows))
    assert np.isfinite(ours).all()
    assert set(ours[:, STATE]) == {HEALTHY, SUBSTITUTED, STOPPED}


@compiled
@pytest.mark.thorough
def test_a_hundred_thousand_cycles_of_the_compiled_text_give_the_bits_of_the_simulated_controller():
    block = block_of(CLOSED, "ssc")
    rows, reference = random_inputs(block, CYCLES), Reference(block)
    wanted = np.array([reference.step(Sensed(*row)) for row in rows.tolist()])
    np.testing.assert_array_equal(bits(program(CLOSED, "ssc").cycles(all_good(rows))), bits(wanted))


@compiled
@pytest.mark.slow
@pytest.mark.parametrize(
    ("crane", "controller", "seed"),
    [(CLOSED, "ssc", 1), (CLOSED, "hs", 2), ("nov-100t-pure-active", "ns", 3), ("nov-100t-electric", "position", 4)],
)
def test_a_winch_under_the_compiled_text_has_cycle_by_cycle_the_commands_of_the_library(crane, controller, seed):
    """A closed loop with sensor noise, a bad motion unit, an operator who lowers, and a stop that is acknowledged."""
    machine, rng = load_crane(crane), np.random.default_rng(seed)
    text, library = program(crane, controller), LibraryController(machine, controller)
    case = stillhook.Scenario(load="60 t", s_w="100 m", tip="still", mode=controller)
    winch, block = stillhook.Session(machine, case), block_of(crane, controller)
    winch.set("override", 1)
    commanded = [n for n in ("u_p", "u_m", "brake") if n in winch.inputs]
    read = [name for name in Sensed._fields if name in (*winch.signals, *winch.inputs)]
    omega, rows, commands = 2.0 * math.pi / 9.0, [], []
    for k in range(CLOSED_LOOP):
        t = k * winch.cycle
        tip = {"s_tip": 0.5 * math.sin(omega * t), "v_tip": 0.5 * omega * math.cos(omega * t)}
        tip["a_tip"] = -(omega**2) * tip["s_tip"]
        compensating = not 1500 < k < 1700
        seen = dict.fromkeys(Sensed._fields, 0.0) | {name: winch.get(name) for name in read} | tip
        seen |= {"F": winch.get("F_w"), "K_wire": 1.0, "f_pump": 1.0, "mode": block.code if compensating else 0.0}
        seen |= {"v_op": -0.1 if 600 < k < 900 else 0.0, "s_op": -0.001 * min(max(k - 600, 0), 299)}
        seen["dp"] = seen["p_a"] - seen["p_b"]
        seen["dp_load"] = seen["dp"]
        quality = dict.fromkeys(Sensed._fields, 1.0) | {"s_tip": float(not 1200 < k < 1400)}
        for name in ("s_w", "F", "p_a", "p_b", "v_tip", "a_tip"):
            seen[name] *= 1.0 + 1e-4 * rng.standard_normal()
        rows.append([*seen.values(), *quality.values(), float(1680 < k < 1690)])
        commands.append(text.cycle(np.array(rows[-1])))
        outputs = dict(zip(GuardedCommands._fields, commands[-1].tolist(), strict=True))
        winch.step(tip | {"override": 1} | {name: outputs[name] for name in commanded})
    states = np.array(commands)[:, STATE]
    assert set(states) == {HEALTHY, SUBSTITUTED, STOPPED}
    assert states[-1] == HEALTHY
    assert np.ptp(np.array(commands)[-900:, 0]) > 0.1  # it compensates again
    np.testing.assert_array_equal(np.array(commands), library.cycles(np.array(rows)))


@compiled
def test_two_programs_remember_for_themselves():
    rows, expected = cycles_of(CLOSED, "ssc")
    one, other = program(CLOSED, "ssc"), CompiledText(load_crane(CLOSED), "ssc")
    other.cycles(rows[1000:])
    np.testing.assert_array_equal(one.cycles(rows[:2000]), expected[:2000])


@compiled
def test_a_setting_that_was_changed_in_the_text_is_the_one_that_runs():
    rows, expected = cycles_of(CLOSED, "ssc")
    text = structured_text(block_of(CLOSED, "ssc"))
    changed = text.replace("K_p : LREAL := 0.16", "K_p : LREAL := 0.0")
    assert changed != text
    ours = CompiledText(load_crane(CLOSED), "ssc", changed.replace("\n", "\r\n")).cycles(rows)
    np.testing.assert_array_equal(ours[0], expected[0])
    assert np.abs(ours - expected).max() > 0.01


@compiled
@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "has no function block SH_ssc"),
        ("FUNCTION_BLOCK SH_ssc\nEND_FUNCTION_BLOCK\n", "iec2c refused it"),
        ("FUNCTION_BLOCK SH_ssc\n\x00\xff", "iec2c refused it"),
        ("FUNCTION_BLOCK SH_ssc\nVAR x : LREAL; END_VAR\nx := 1.0;\nEND_FUNCTION_BLOCK\n", "failed"),
    ],
)
def test_a_text_that_is_none_is_refused_in_one_line(text, reason):
    with pytest.raises(LiveError, match=reason) as problem:
        CompiledText(load_crane(CLOSED), "ssc", text)
    assert "\n" not in str(problem.value)


def test_without_a_compiler_one_line_says_what_was_looked_for(monkeypatch, tmp_path):
    monkeypatch.delenv("STILLHOOK_IEC2C", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(LiveError, match=r"Looked for: iec2c of MATIEC on the PATH.* Get one, or") as problem:
        CompiledText(load_crane(CLOSED), "ssc")
    assert "\n" not in str(problem.value)


@pytest.mark.skipif(sys.platform == "win32", reason="a script stands for the compiler")
@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("#!/bin/sh\necho 'block.st:1: error: no' >&2\nexit 1\n", "iec2c refused it: block.st:1: error: no"),
        ("#!/bin/sh\nexit 0\n", "iec2c refused it: no reason"),
        ("no program", "error"),
        ("#!/bin/sh\nsleep 9\n", "did not end within"),
    ],
)
def test_a_compiler_that_does_not_do_is_refused_in_one_line(script, reason, monkeypatch, tmp_path):
    (tmp_path / "lib" / "C").mkdir(parents=True)
    (tmp_path / "lib" / "C" / "iec_std_lib.h").touch()
    iec2c = tmp_path / "iec2c"
    iec2c.write_text(script)
    iec2c.chmod(0o755)
    monkeypatch.setenv("STILLHOOK_IEC2C", str(iec2c))
    monkeypatch.delenv("STILLHOOK_IEC2C_LIB", raising=False)
    monkeypatch.setattr("stillhook.live.hil.structured_text.LONGEST", 0.5)
    with pytest.raises(LiveError, match=reason) as problem:
        CompiledText(load_crane(CLOSED), "ssc")
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_the_xml_has_the_types_functions_and_block_of_the_text(crane, controller):
    block = block_of(crane, controller)
    root = ET.fromstring(plcopen_xml(block))
    names = [pou.get("name") for pou in root.iter(f"{{{SPACE}}}pou")]
    assert names == [*(f.name for f in block.functions), block.block.name, "SH_main"]
    assert [t.get("name") for t in root.iter(f"{{{SPACE}}}dataType")] == [s.name for s in block.structures]
    bodies = [p.find(f"{{{SPACE}}}body/{{{SPACE}}}ST/{{{XHTML}}}p") for p in root.iter(f"{{{SPACE}}}pou")]
    text = structured_text(block)
    lines = [line.strip() for b in bodies[:-1] for line in b.text.splitlines() if line.strip()]
    assert all(line in text for line in lines)
    assert len(list(root.iter(f"{{{SPACE}}}configuration"))) == 1


def test_the_xml_follows_the_schema_of_plcopen():
    schema = os.environ.get("STILLHOOK_TC6_XSD")
    if not schema:
        pytest.skip("STILLHOOK_TC6_XSD names no schema of PLCopen XML 2.01")
    etree = pytest.importorskip("lxml.etree")
    etree.XMLSchema(etree.parse(schema)).assertValid(etree.fromstring(plcopen_xml(block_of(CLOSED, "ssc")).encode()))
