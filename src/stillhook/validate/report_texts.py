"""A validation in words: the verdict in a sentence, its lines and load cases as cells of tables, for the terminal and the page alike."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

from stillhook.units import number
from stillhook.validate.campaign import MARK
from stillhook.validate.criteria import By, Criterion
from stillhook.validate.judging import in_words
from stillhook.validate.lines import Line, Step, StepNumber, Table, Verdict
from stillhook.validate.record import Segment
from stillhook.validate.validation import Validation

MEANING = {
    Verdict.PASS: "the data show that the criterion is met",
    Verdict.FAIL: "the data show that it is not met",
    Verdict.NOT_SHOWN: "the data cannot tell; in capitals it makes the verdict a no, for what counts must be shown (the line says by what)",
    Verdict.TOLD: "for information, no part of the verdict",
}
SHOWS = {
    StepNumber.DATA: "Do the tests cover enough loads, wire lengths, motion and time for a verdict on this crane?",
    StepNumber.PARAMETERS: "Are pumps, motors, gears, drum, friction and sensors those of the crane file?",
    StepNumber.CONTROLLER: "Fed with the logged inputs, does the twin's controller give the commands that the PLC gave?",
    StepNumber.LIMITS: "With the pumps full, is the twin as fast as the winch?",
    StepNumber.DYNAMICS: "With the logged commands, do pressures rise, swing and settle as on the crane?",
    StepNumber.AHC: "With the logged tip motion and nothing else, does the whole twin miss by as much as the crane did?",
}
SEGMENT_HEAD = ("test", "from\n[s]", "for\n[s]", "load\n[t]", "wire out\n[m]", "tip p-p\n[m]", "period\n[s]", "mode")
SHORT_HEAD = ("", "criterion", "found", "limit", "verdict")
FULL_HEAD = ("", "criterion", "found (95 %)", "limit", "verdict", "rests on", "source")
LINE_HEAD = ("", "criterion", "found", "95 %", "limit", "verdict", "rests on", "source")
STEP_HEAD = ("step", "", "pass", "fail", "not shown", "told")


LONGEST_NUMBER = 20  # characters: a longer cell is text


def columns_of_words(table: Table) -> set[int]:
    """Places of the columns of a step's table that hold text, and may fold."""
    return {i for row in table.rows for i, cell in enumerate(row) if len(cell) > LONGEST_NUMBER}


def title(validation: Validation) -> str:
    """The campaign's title, marked where no crane was measured."""
    campaign = validation.campaign
    mark = f"{MARK} " if campaign.synthetic and MARK not in campaign.title else ""
    return f"{mark}{campaign.title}: {campaign.crane.name}"


def sentence(validation: Validation) -> str:
    """The verdict in one sentence."""
    campaign, lines = validation.campaign, validation.lines
    judged = [line for line in lines if line.judged]
    criteria = campaign.criteria.label
    part = "" if validation.whole else f" This is {_steps(validation.steps)} only: a certificate needs all steps, 0 to {max(StepNumber)}."
    if not judged:
        return f"NOT JUDGED: {criteria} has no criterion that counts here.{part}"
    if validation.passed:
        this = f"the {MARK} crane of these logs" if campaign.synthetic else "this crane"
        what = f'"{campaign.crane.name}" as described represents {this}, inside what was tested' if validation.whole else "no objection"
        return f"PASSED: {what}: {_count(len(judged), 'criterion', 'criteria')} of {criteria} met.{part}"
    no = [line for line in judged if line.no]
    found = [f"{n} {v.value} ({_keys(line for line in no if line.verdict is v)})" for v, n in Counter(x.verdict for x in no).items()]
    return f"NOT PASSED: of {_count(len(judged), 'criterion', 'criteria')} of {criteria}, {' and '.join(found)}.{part}"


def _steps(steps: Sequence[Step]) -> str:
    numbers = [str(int(s.number)) for s in steps]
    return f"step {numbers[0]}" if len(numbers) == 1 else f"steps {', '.join(numbers[:-1])} and {numbers[-1]}"


def _keys(lines: Iterable[Line]) -> str:
    return ", ".join(line.key for line in lines)


def _count(n: int, one: str, many: str) -> str:
    return f"{n} {one if n == 1 else many}"


def criterion(validation: Validation, line: Line) -> Criterion:
    """The criterion behind a verdict line."""
    return next(c for c in validation.campaign.criteria.criteria if c.key == line.key)


def line_cells(validation: Validation, line: Line) -> tuple[str, ...]:
    """A verdict line as cells, see LINE_HEAD: the figure and its 95 % interval in the unit of the limit, the data and the reason."""
    c, m = criterion(validation, line), line.measure
    between = f"{in_words(c, m.low)} to {in_words(c, m.high)}" if m is not None and m.low is not None and m.high is not None else ""
    behind = (m.test, m.data, m.note) if m is not None else ()
    figure = "-" if m is None or m.value is None else in_words(c, m.value)
    asked = line.limit + _BY[c.by]
    return line.key, line.what, figure, between, asked, verdict_word(line), "; ".join(x for x in behind if x), line.source


def short_cells(validation: Validation, line: Line) -> tuple[str, ...]:
    """A verdict line in short, see SHORT_HEAD."""
    key, what, figure, _, limit, verdict, *_ = line_cells(validation, line)
    return key, what, figure, limit, verdict


def full_cells(validation: Validation, line: Line) -> tuple[str, ...]:
    """A verdict line in full with few columns, see FULL_HEAD."""
    key, what, figure, between, *rest = line_cells(validation, line)
    return key, what, f"{figure} ({between})" if between else figure, *rest


def joined(header: str) -> str:
    """The head of a column on one line."""
    return header.replace("-\n", "").replace("\n", " ")


_BY = {By.VALUE: "", By.WHOLE: " (whole interval)", By.ANY: " (any of the interval)"}


def verdict_word(line: Line) -> str:
    """The verdict; a no in capitals."""
    return line.verdict.value.upper() if line.no else line.verdict.value


def segment_cells(segment: Segment) -> tuple[str, ...]:
    """A load case as cells, see SEGMENT_HEAD."""
    s = segment
    low, high = (number(x, 4) for x in (s.s_w_min, s.s_w_max))
    moving = s.s_tip_pp > 0.0
    return (
        s.test, f"{s.start:.0f}", f"{s.duration:.0f}", number(s.load / 1e3, 3), low if low == high else f"{low}-{high}",
        f"{s.s_tip_pp:.2f}" if moving else "-", f"{s.period:.1f}" if moving and math.isfinite(s.period) else "-", s.mode.value,
    )  # fmt: skip


def segments(validation: Validation) -> list[Segment]:
    """The load cases of all tests."""
    return [s for record in validation.records for s in record.segments]


def found_on_the_way(validation: Validation) -> list[str]:
    """What reading the logs brought up, each with its test; without what a step says again."""
    said = []
    for record in validation.records:
        test = f'Test "{record.test.name}"'
        said += [text if text.startswith(test) else f"{test}: {text}" for text in record.statements]
    again = {text for step in validation.steps for text in step.statements}
    return [text for text in said if text not in again]


def step_row(validation: Validation, step: Step) -> tuple[str, ...]:
    """How the criteria of a step came out, see STEP_HEAD."""
    counts = Counter(line.verdict for line in lines_of(validation, step))
    return str(int(step.number)), step.title, *(str(counts[v]) if counts[v] else "" for v in Verdict)


def lines_of(validation: Validation, step: Step) -> list[Line]:
    """The verdict lines of a step."""
    return [line for line in validation.lines if line.step == step.number]


def step_verdict(validation: Validation, step: Step) -> str:
    """The verdict of a step alone, in a few words."""
    lines = [line for line in lines_of(validation, step) if line.judged]
    if not lines:
        return "not judged"
    no = [line for line in lines if line.no]
    return f"not passed ({_keys(no)})" if no else "passed"
