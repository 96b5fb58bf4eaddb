"""The exported files, read by a free compiler and by a schema, where this machine has them.

STILLHOOK_IEC2C: the compiler iec2c of MATIEC; STILLHOOK_IEC2C_LIB: its folder lib, default beside it.
STILLHOOK_TC6_XSD: the schema of PLCopen XML 2.01 (needs the Python package lxml).
"""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from tests.export.plc.cases import (
    CLOSED,
    N_SIGNALS,
    GuardedPlc,
    all_good,
    bits,
    block_of,
    faulty,
    pairs,
    random_inputs,
)

from stillhook.control.guard import HEALTHY, STOPPED, SUBSTITUTED
from stillhook.control.interface import Sensed
from stillhook.export.plc import structured_text
from stillhook.export.plc.sequence import Reference, inputs, numbers
from stillhook.export.plc.text import SPACE, XHTML, plcopen_xml
from stillhook.kernels.plc_alone import GuardedCommands

CYCLES = 100_000
FAULTY, FAULTY_LONG = 5_000, 1_000_000
STATE = GuardedCommands._fields.index("state")
MAIN = """
#include <stdio.h>
#include "iec_std_lib.h"
#include "accessor.h"
#include "POUS.h"
TIME __CURRENT_TIME;
BOOL __DEBUG;
#include "POUS.c"
int main(void)
{{
    static {block} b;
    double in[{n_in}], out[{n_out}];
    {block}_init__(&b, 0);
    while (fread(in, sizeof in, 1, stdin) == 1) {{
{put}
        {block}_body__(&b);
{get}
        fwrite(out, sizeof out, 1, stdout);
    }}
    return 0;
}}
"""


@pytest.fixture(scope="module")
def compiler():
    found = os.environ.get("STILLHOOK_IEC2C")
    if not found or not Path(found).is_file():
        pytest.skip("STILLHOOK_IEC2C names no compiler iec2c of MATIEC")
    if shutil.which("gcc") is None:
        pytest.skip("gcc, which compiles what iec2c writes, is not on the path")
    return Path(found), Path(os.environ.get("STILLHOOK_IEC2C_LIB") or Path(found).parent / "lib")


@pytest.fixture(scope="module")
def program(compiler, tmp_path_factory):
    """What MATIEC and gcc make of the text of a crane's controller."""

    @functools.cache
    def of(crane, controller):
        return compile_text(block_of(crane, controller), compiler, tmp_path_factory.mktemp("matiec"))

    return of


def compile_text(block, compiler, folder):
    iec2c, library = compiler
    (folder / "block.st").write_text(structured_text(block))
    ran = subprocess.run(
        [iec2c, "-f", "-I", library, "-T", folder, folder / "block.st"], capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr
    assert "error" not in ran.stderr, ran.stderr
    name = block.block.name.upper()
    given = [*Sensed._fields, *(f"q_{f}" for f in Sensed._fields), "reset"]
    put = "\n".join(f"        __SET_VAR(b.,{f.upper()},,in[{i}]);" for i, f in enumerate(given))
    get = "\n".join(f"        out[{i}] = __GET_VAR(b.{f.upper()},);" for i, f in enumerate(GuardedCommands._fields))
    n_in, n_out = len(given), len(GuardedCommands._fields)
    (folder / "main.c").write_text(MAIN.format(block=name, n_in=n_in, n_out=n_out, put=put, get=get))
    command = [
        "gcc",
        "-O2",
        "-ffp-contract=off",
        "-w",
        "-I",
        library / "C",
        "-I",
        folder,
        "main.c",
        "-o",
        "main",
        "-lm",
    ]
    subprocess.run(command, cwd=folder, check=True)
    return folder / "main"


def outputs_of(made, rows):
    ran = subprocess.run([made], input=np.ascontiguousarray(rows).tobytes(), capture_output=True, check=True)
    return np.frombuffer(ran.stdout).reshape(len(rows), len(GuardedCommands._fields))


@pytest.mark.slow
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_a_free_compiler_takes_the_text_and_its_program_passes_the_test_sequence(crane, controller, program):
    block = block_of(crane, controller)
    cycles = list(inputs(block, Reference(block)))
    ours = outputs_of(program(crane, controller), np.array([numbers(o) for o, _ in cycles]))
    np.testing.assert_array_equal(bits(ours), bits(np.array([d for _, d in cycles])))


def rows_with_faults(block, n, seed):
    """Any value on any signals for any time, bad qualities and resets."""
    rows = faulty(block, n, seed)
    rows[:, N_SIGNALS:] = np.abs(rows[:, N_SIGNALS:] - 1.0) < 0.5  # BOOL
    return rows


@pytest.mark.slow
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_random_faults_give_the_program_the_bits_of_the_simulated_controller(crane, controller, program):
    block = block_of(crane, controller)
    rows, reference = rows_with_faults(block, FAULTY, 5), Reference(block)
    wanted = [reference.step(Sensed(*r[:N_SIGNALS]), Sensed(*r[N_SIGNALS:-1]), r[-1]) for r in rows.tolist()]
    ours = outputs_of(program(crane, controller), rows)
    np.testing.assert_array_equal(bits(ours), bits(np.array(wanted)))
    assert set(ours[:, STATE]) == {HEALTHY, SUBSTITUTED, STOPPED}


@pytest.mark.thorough
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_a_million_cycles_with_faults_give_the_program_the_numbers_of_the_compiled_controller(
    crane, controller, program
):
    """The compiled one may give the other sign of a zero."""
    block = block_of(crane, controller)
    rows = rows_with_faults(block, FAULTY_LONG, 6)
    ours = outputs_of(program(crane, controller), rows)
    np.testing.assert_array_equal(ours, GuardedPlc(block).run(rows))
    assert np.isfinite(ours).all()
    assert set(ours[:, STATE]) == {HEALTHY, SUBSTITUTED, STOPPED}


@pytest.mark.thorough
def test_a_hundred_thousand_cycles_of_the_compiled_text_give_the_bits_of_the_simulated_controller(program):
    block = block_of(CLOSED, "ssc")
    rows, reference = random_inputs(block, CYCLES), Reference(block)
    wanted = np.array([reference.step(Sensed(*row)) for row in rows.tolist()])
    np.testing.assert_array_equal(bits(outputs_of(program(CLOSED, "ssc"), all_good(rows))), bits(wanted))


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
