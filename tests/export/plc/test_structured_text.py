"""The exported text, read by an interpreter of its own, against the cycle that Stillhook simulates with."""

from __future__ import annotations

import csv
import io
import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest
from tests.export.plc.cases import (
    CLOSED,
    all_good,
    bits,
    block_of,
    cycles_of,
    machine_of,
    open_wide,
    pairs,
    random_inputs,
    sequence_of,
    unguarded,
)
from tests.export.plc.structured_text import Machine
from tests.scripts import DOCS

from stillhook.control.commands import SMALL
from stillhook.control.guard import HEALTHY, STOPPED, SUBSTITUTED
from stillhook.control.interface import Sensed
from stillhook.control.plc import ActuatorCommands
from stillhook.export.plc import sequence, structured_text
from stillhook.export.plc.block import controller_block
from stillhook.export.plc.program import RESERVED, Names, literal
from stillhook.export.plc.sequence import numbers
from stillhook.kernels.plc_alone import PlcInputs, plc_alone
from stillhook.library import changed, load_crane

SHORT, LONG = 1_000, 1_000_000


def outputs_of(step, rows):
    return np.array([step(*row) for row in rows.tolist()])


@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_the_text_commands_what_the_simulated_controller_commands_bit_for_bit(crane, controller):
    """On noise that no crane has, which its guard would refuse: with ranges without ends it changes nothing."""
    block = block_of(crane, controller)
    machine, rows = machine_of(crane, controller), random_inputs(block, SHORT)
    open_wide(machine)
    ours = outputs_of(machine.start(), all_good(rows))
    np.testing.assert_array_equal(bits(ours[:, : len(ActuatorCommands._fields)]), bits(unguarded(block, rows)))
    assert not ours[:, len(ActuatorCommands._fields) :].any()


def test_the_text_has_the_bits_of_a_controller_whose_displacement_follows_from_torque_and_speeds():
    crane = changed(load_crane("nov-250t"), {"control": {"displacement_limit": "torque"}})
    block = controller_block(crane, "ssc")
    assert block.plc.motors.limits.by_torque == 1.0
    machine, rows = Machine(structured_text(block)), random_inputs(block, SHORT)
    open_wide(machine)
    ours, true = outputs_of(machine.start(), all_good(rows)), unguarded(block, rows)
    np.testing.assert_array_equal(bits(ours[:, : len(ActuatorCommands._fields)]), bits(true))
    by_load, u_m = unguarded(block_of("nov-250t", "ssc"), rows), ActuatorCommands._fields.index("u_m")
    assert np.abs(by_load[:, u_m] - true[:, u_m]).max() > 0.01


SAME = test_the_text_commands_what_the_simulated_controller_commands_bit_for_bit


@pytest.mark.thorough
@pytest.mark.parametrize("controller", ["ssc", "ssc-cubic"])
def test_a_million_cycles_of_the_text_give_the_bits_of_the_simulated_controller(controller):
    block = block_of(CLOSED, controller)
    machine, rows = machine_of(CLOSED, controller), random_inputs(block, LONG)
    open_wide(machine)
    ours = outputs_of(machine.start(), all_good(rows))
    np.testing.assert_array_equal(bits(ours[:, : len(ActuatorCommands._fields)]), bits(unguarded(block, rows)))


@pytest.mark.thorough
def test_a_million_cycles_of_the_text_give_the_numbers_of_the_compiled_controller():
    """The compiled one leaves out the brake and the pumps' torque limit, and may give the other sign of a zero."""
    block = block_of(CLOSED, "ssc")
    machine, rows = machine_of(CLOSED, "ssc"), random_inputs(block, LONG)
    at = Sensed._fields.index
    rows[:, at("dp")] = rows[:, at("dp_load")] = 0.0
    machine.settings["settings"].plc.brake.fitted = 0.0
    open_wide(machine)
    first = Sensed(*rows[0])
    memory = block.memory._replace(mode=first.mode, datum=first.s_w - first.s_tip, F=first.F)
    seen = PlcInputs(*(rows[:, at(f)] for f in PlcInputs._fields[:-2]), np.zeros(LONG), np.zeros(LONG))
    commands, _, _ = plc_alone(seen, rows[:, at("p_hp")], memory, block.plc, block.control, {})
    ours = outputs_of(machine.start(), all_good(rows))
    for name in ("u_p", "u_m", "u_ff", "u_raw", "e_c"):
        np.testing.assert_array_equal(ours[:, ActuatorCommands._fields.index(name)], getattr(commands, name))


@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_numbers_of_the_text_are_within_single_precision(crane, controller):
    """MATIEC, and with it OpenPLC and Beremiz, refuses others, also where an LREAL is wanted."""
    text = structured_text(block_of(crane, controller))
    written = {abs(float(x)) for x in re.findall(r"(?<![\w.])\d+\.\d+(?:E[+-]?\d+)?", text)} - {0.0}
    assert len(written) > 50
    single = np.finfo(np.float32)
    assert float(single.tiny) <= min(written) <= max(written) <= float(single.max)


@pytest.mark.long
@pytest.mark.parametrize(("crane", "controller"), pairs())
def test_the_test_sequence_holds_for_the_text_of_every_controller(crane, controller):
    rows, expected = cycles_of(crane, controller)
    np.testing.assert_array_equal(bits(outputs_of(machine_of(crane, controller).start(), rows)), bits(expected))


def reaches(rows: list) -> dict[str, bool]:
    """What a sequence of inputs and outputs brings about, each by name."""
    return {
        "manual": any(o.y.mode == 0.0 for o, _ in rows),
        "compensation": any(o.y.mode > 0.0 for o, _ in rows),
        "saturation": any(abs(d.u_raw) > 1.0 for _, d in rows),
        "half of the pumps": any(o.y.f_pump < 1.0 for o, _ in rows),
        "operator": any(abs(o.y.v_op) > SMALL for o, _ in rows),
        "brake closed": any(d.brake == 1.0 for _, d in rows),
        "brake open": any(d.brake == 0.0 for _, d in rows),
        "limited stroke": any(abs(d.u_p) < min(abs(d.u_raw), 1.0) for _, d in rows),
        "reduced displacement": any(d.u_m < 1.0 for _, d in rows),
        "replaced input": any(d.state == SUBSTITUTED for _, d in rows),
        "stop": any(d.state == STOPPED for _, d in rows),
        "refused acknowledgement": any(o.reset > 0.0 and d.state == STOPPED for o, d in rows),
        "acknowledgement": any(o.reset > 0.0 and d.state == HEALTHY for o, d in rows),
    }


def test_the_file_of_a_test_sequence_has_the_bits_of_its_cycles_and_reaches_every_part_of_the_controller(monkeypatch):
    block = block_of(CLOSED, "ssc")
    cycles = sequence_of(CLOSED, "ssc")
    reached = reaches(cycles)
    assert all(reached.values()), reached
    monkeypatch.setattr(sequence, "inputs", lambda *_: cycles)
    head, *rows = list(csv.reader(io.StringIO(sequence.sequence_csv(block))))
    n = 2 * len(Sensed._fields) + 1
    qualities = [f"q_{name}" for name in Sensed._fields]
    assert [h.split(" [")[0] for h in head[1 : n + 1]] == [*Sensed._fields, *qualities, "reset"]
    assert all(h.startswith("expected ") for h in head[n + 1 :])
    expected = np.array([[*numbers(o), *d] for o, d in cycles])
    np.testing.assert_array_equal(bits(np.array(rows, dtype=float)[:, 1:]), bits(expected))


def test_a_setting_that_is_changed_in_the_block_changes_its_commands():
    machine, rows = machine_of(CLOSED, "ssc"), all_good(random_inputs(block_of(CLOSED, "ssc"), 400))
    open_wide(machine)
    before = outputs_of(machine.start(), rows)
    machine.settings["settings"].plc.gains.k_p *= 2.0
    assert np.any(outputs_of(machine.start(), rows) != before)


@pytest.mark.parametrize("number", [0.0, 1.0, 0.1, 1e-9, 4.0304988655254083e-7, 1e30, 5e-324, 1.7976931348623157e308])
def test_a_literal_reads_back_to_the_same_double_and_has_a_decimal_point(number):
    text = literal(number)
    assert float(text) == number
    assert "." in text.split("E")[0]


def test_names_that_differ_by_case_alone_or_are_words_of_the_language_are_renamed():
    names = Names()
    made = [names.new(name) for name in ("T_m", "t_m", "on", "F", "f", "_a__b_")]
    assert len({name.casefold() for name in made}) == len(made)
    assert not any(name.casefold() in RESERVED or "__" in name or name.endswith("_") for name in made)


def test_the_text_is_ascii_and_names_units_and_sources():
    text = structured_text(block_of(CLOSED, "ssc"))
    assert text.isascii()
    assert "Source: Moslatt 2020 eqs 2.9 to 2.11" in text
    assert "(* its speed [m/s] *)" in text


def test_the_first_values_of_the_settings_are_those_of_the_crane():
    block = block_of(CLOSED, "ssc")
    held = machine_of(CLOSED, "ssc").settings["settings"]
    assert held.plc.gains.k_p == block.plc.gains.K_p
    for path, value, _ in block.settings:
        part = held
        for name in path.lower().split("."):
            part = getattr(part, name)
        assert part == value, path
    assert all(math.isfinite(value) for _, value, _ in block.settings)


@pytest.mark.long
def test_a_controller_of_the_user_with_a_memory_is_exported_like_a_shipped_one(tmp_path):
    """The one of the how-to page, in a process that knows it."""
    page = (DOCS / "how-to" / "add-a-controller.md").read_text(encoding="utf-8")
    module = tmp_path / "ssc_pi.py"
    module.write_text(re.search(r"```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)[1], encoding="utf-8")
    paths = os.pathsep.join([str(DOCS.parent / "src"), str(DOCS.parent)])
    code = f"from tests.export.plc import test_structured_text as t; t.{SAME.__name__}({CLOSED!r}, 'ssc-pi')"
    environment = os.environ | {"STILLHOOK_EXTENSIONS": str(module), "PYTHONPATH": paths}
    ran = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
