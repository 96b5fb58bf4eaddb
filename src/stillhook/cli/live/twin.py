"""`stillhook live`: the twin beside a PLC in real time."""

from __future__ import annotations

import select
import sys
import time
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer

from stillhook.cli.parser import Columns, Json, Load, MappingFile, SubjectArgument, case_of, present
from stillhook.errors import LiveError
from stillhook.report.formatting import wrapped
from stillhook.report.terminal import Answer, Line, columns, print_table, say

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from stillhook.live.demo import Moment
    from stillhook.live.runtime import Event
    from stillhook.live.runtime.doctor import Diagnosis, Lateness
    from stillhook.live.watch.replay import Moment as ReplayMoment
    from stillhook.live.watch.replay import Replayed
    from stillhook.spec.crane import Crane

USUAL = {"load": "100 t", "s_w": "100 m", "tip": "sine 1 m 9 s", "mode": "ssc"}
"""What a twin runs where a case file says nothing else."""
CRANE = "nov-250t"
LINE_EVERY = 5.0
"""Time between two lines of the demonstration without a terminal [s]."""
SHOWN_EVENTS = 6
HALF_KINDS = {"temperature": "temperature_rise"}
"""Kinds whose differences have another unit."""
STATE_FILE, EVENTS_FILE, HISTORY = "state.bin", "events.jsonl", "history"
"""In the folder of a live file."""
LONGEST_LINE = 2000
"""Characters of an event that are printed: a pipe that takes a line takes one of these [-]."""


def doctor(
    subject: SubjectArgument = CRANE,
    duration: Annotated[str, typer.Option(help="Length of each measurement.")] = "30 s",
    json: Json = False,
) -> None:
    """Measure how late this machine wakes a twin, before anyone trusts it: with the real-time class and without.

    99.9 % of the cycles may begin 2 ms late and none more than 10 ms. Exit code 1 if this machine does not keep that.
    It says what was measured under the load of that time: let the machine do what it will do beside the twin.

    Example: stillhook live doctor --duration "60 s"
    """
    from stillhook.formats.case_file import load_subject
    from stillhook.live.runtime.doctor import diagnose
    from stillhook.units import parse

    of = load_subject(subject)
    seconds = parse(duration, "time", "--duration")
    diagnosis = diagnose(of.crane, case_of(of, USUAL), seconds, tell=say)
    measured = [m._asdict() for m in diagnosis.measured]
    data = {**diagnosis._asdict(), "measured": measured, "good": diagnosis.good, "reason": diagnosis.reason}
    present(data, brief=lambda: _answer_of_diagnosis(diagnosis), json=json)
    raise typer.Exit(0 if diagnosis.good else 1)


def _answer_of_diagnosis(diagnosis: Diagnosis) -> Answer:
    """Whether this machine keeps time, and the lateness of each class."""
    from stillhook.live.runtime.causes import Cause

    def row(m: Lateness, *times: float, counts: tuple[int, ...]) -> list[str]:
        of = "real-time" if m.real_time else "ordinary"
        return [of, str(m.cycles), *(f"{1e3 * x:.2f}" for x in times), *map(str, counts)]

    of = diagnosis.measured
    short = [row(m, m.p50, m.p999, m.worst, counts=(m.late,)) for m in of]
    full = [row(m, m.p50, m.p99, m.p999, m.worst, m.cost_p50, m.cost_p99, counts=(m.late, m.overrun)) for m in of]
    header = ["class", "cycles", "p50", "p99", "p99.9", "worst", "cost p50", "cost p99", "late", "overrun"]
    costs = f"machine code {1e6 * diagnosis.kernel:.0f} us, the session around it {1e6 * diagnosis.session:.0f} us"
    details = [f"{costs}; the rest of the cost reads, checks and shares the row."]
    details += [f"{count} late: {Cause[name.upper()].text}." for name, count in diagnosis.judged.causes.items()]
    if diagnosis.throttled > 0.0:
        limit = "The limit of a group of processes (a container's) held this one up for"
        details.append(f"{limit} {diagnosis.throttled:.2f} s.")
    if diagnosis.stolen > 0.0:
        host = "A virtual machine: its host took"
        details.append(f"{host} {diagnosis.stolen:.2%} of the processors' time, which no class prevents.")
    lines: list[Line] = [
        diagnosis.reason,
        *columns(["class", "cycles", "median", "99.9 %", "worst", "late"], short),
        partial(print_table, header, full, title="Lateness and cost of a cycle [ms]"),
        f"{diagnosis.system}, {diagnosis.processors} processors, load {diagnosis.load:.1f}.",
        *(partial(wrapped, detail) for detail in details),
        "" if of[0].real_time else of[0].scheduling,
    ]
    title = f"Lateness of a cycle of {1e3 * diagnosis.cycle:g} ms [ms]"
    return Answer(title, lines, more="cost of a cycle, causes of late cycles")


def run(
    live_file: Annotated[
        Path, typer.Argument(metavar="LIVE.toml", help="Live file: case, folder and servers (stillhook example live).")
    ],
    duration: Annotated[str | None, typer.Option(help="Length of the run; without it until it is stopped.")] = None,
    allow_writes: Annotated[
        bool, typer.Option("--allow-writes", help="Take inputs over Modbus and UDP, which have no security.")
    ] = False,
    insecure: Annotated[
        bool, typer.Option("--insecure", help="OPC UA also without security, on this machine alone.")
    ] = False,
) -> None:
    """Run the twin in real time beside a PLC, with the servers of a live file, until it is stopped (Ctrl-C, SIGTERM).

    Its state is saved when it ends and every second, and the next start resumes it. Events go to events.jsonl in
    the file's folder and to standard error; late cycles are counted, and the clock is never stretched.

    Example: stillhook live run live.toml --duration "60 s"
    """
    from stillhook.live.history import HistorySink
    from stillhook.live.live_file import read_live_file
    from stillhook.live.observer import ObservedTwin, columns
    from stillhook.live.runtime import STATUS, EventLog, LiveTwin, Sink, Task
    from stillhook.live.servers.serving import serve

    plan = read_live_file(live_file, writes=allow_writes, insecure=insecure)
    end = ending(duration)
    case = plan.case
    task = Task(case.crane, case.case, case.step, plan.folder / STATE_FILE, plan.timeout, sensed=plan.sensed)
    sinks: list[Sink] = [EventLog(plan.folder / EVENTS_FILE), _EventLines()]
    history = None
    if plan.history is not None:
        every, budget = plan.history
        own = {**STATUS, **({} if plan.observer is None else columns(plan.observer))}
        history = HistorySink(plan.folder / HISTORY, own, every=every, budget=budget)
        sinks.append(history)
    over, ready = lambda: time.monotonic() >= end, lambda line: print(line, flush=True)
    if plan.observer is None:
        with LiveTwin(task, sinks, history) as twin:
            serve(twin, twin, plan, over, ready)
            last = twin.latest()
    else:
        with ObservedTwin(task, sinks, plan.observer, plan.folder, history) as observed:
            serve(observed.twin, observed, plan, over, ready)
            last = observed.latest()
    if last is not None:
        v = last.values
        counts = f"{v['late_cycles']:.0f} late, {v['overrun_cycles']:.0f} overrun, {v['missed_cycles']:.0f} missed"
        print(f"{v['cycle_number'] + 1:.0f} cycles, {counts}; worst lateness {1e3 * v['worst_lateness']:.2f} ms.")


def ending(duration: str | None) -> float:
    """When to end, on the monotonic clock [s]."""
    from stillhook.units import parse

    if duration is None:
        return float("inf")
    seconds = parse(duration, "time", "--duration")
    if not seconds > 0.0:
        raise LiveError(f"--duration {seconds:g} s: give a time above 0, or leave it out.")
    return time.monotonic() + seconds


class _EventLines:
    """A sink that prints events on standard error; where that is a full pipe without a reader, they are left out and
    counted, and hold up no server."""

    def __init__(self) -> None:
        self._left_out = 0

    def rows(self, first: int, names: object, rows: object) -> None:
        """Not printed."""

    def event(self, happened: Event) -> None:
        """One line."""
        if not _takes_a_line(sys.stderr):
            self._left_out += 1
            return
        if self._left_out:
            say(f"{self._left_out} events were not read here: see {EVENTS_FILE}.")
            self._left_out = 0
        say(f"{happened.source}: {happened.text:.{LONGEST_LINE}}")

    def close(self) -> None:
        """Nothing to close."""


def _takes_a_line(stream: TextIO) -> bool:
    """Whether writing to it returns at once. Only POSIX says so of a pipe; elsewhere it is taken to."""
    try:
        return bool(select.select([], [stream.fileno()], [], 0.0)[1])
    except (OSError, ValueError):
        return True


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a crane (CSV, Parquet, MDF4, TDMS, MAT).")],
    crane: Annotated[
        str, typer.Option(metavar="CRANE|CASE", help="Crane, or case file with load, water and sensors.")
    ] = CRANE,
    mapping: MappingFile = None,
    column: Columns = None,
    load: Load = None,
    speed: Annotated[float, typer.Option(help="Times as fast as it happened, 0.1 to 20.")] = 1.0,
    live: Annotated[
        Path | None, typer.Option("--serve", help="Live file whose servers show twin, log and deviations.")
    ] = None,
    json: Json = False,
) -> None:
    """Drive the twin with a log as if it happened now, and compare it with what was measured.

    The longest stretch without a gap is replayed; tip, wire out, modes and joystick are those of the log. Criteria of
    validation are judged on windows of 30 s, 5 min and 1 h; causes of what fails and virtual sensors are shown. Exit
    code 1 if a criterion was not met, or the rms of a signal over 20 s was above 5 cm, 20 bar, 20 bar, 3 %.

    Example: stillhook live replay log.csv --mapping mapping.toml --load "82 t" --speed 10
    """
    from stillhook.formats.case_file import load_subject
    from stillhook.live.live_file import read_live_file
    from stillhook.live.watch.replay import replay as run_replay
    from stillhook.logs.log import read_log
    from stillhook.logs.understood import signals_of

    of = load_subject(crane)
    if load is None and "load" not in of.scenario:
        raise LiveError('--load: missing: pressures follow from it. Give it, such as --load "82 t", or a case file.')
    usual = {"load": load or "0 t", "s_w": "100 m", "tip": "still"}
    base = case_of(of, usual, load=load)
    read = read_log(log, signals_of(log, mapping, column))
    plan = None if live is None else read_live_file(live)
    lines = _Lines(quiet=json)
    result = run_replay(of.crane, base, read, speed, lines.show, plan=plan, ready=say)
    parts = {name: [x._asdict() for x in getattr(result, name)] for name in ("entries", "criteria", "virtual")}
    data = {k: parts.get(k, x) for k, x in result._asdict().items() if k != "summary"}
    present(data, brief=lambda: _answer_of_replay(of.crane, result), json=json)
    raise typer.Exit(1 if result.failed else 0)


def _answer_of_replay(crane: Crane, result: Replayed) -> Answer:
    """Deviation of each signal against its limit, alarms, criteria that failed and their cause; with --verbose what was
    wrong and when, and virtual sensors."""
    from stillhook.live.watch.deviation import LIMITS, shown

    signals = ("signal", "rms", "limit of 20 s", "status")
    alarms = {name: f"ALARM from {t:.1f} s" for name, t in result.alarms.items()}
    rows = [[n, shown(n, rms), shown(n, LIMITS[n]), alarms.get(n, "ok")] for n, rms in result.rms.items()]
    failed = list(dict.fromkeys(r.key for r in result.criteria if r.status.value == "not ok"))
    lines: list[Line] = [
        *columns(signals, rows, left=(0, 3)),
        partial(print_table, signals, rows),
        partial(_print_criteria, result),
        partial(_print_entries, result),
        partial(_print_virtual, crane, result),
        f"Criteria not met at the end: {', '.join(failed)}." if failed else "No criterion is refuted at the end.",
        result.cause or "",
    ]
    title = f"Measured less simulated over {result.compared:.0f} s: {'NOT PASSED' if result.failed else 'PASSED'}"
    return Answer(title, lines, more="criteria by window, what was outside its limits, virtual sensors")


def _print_criteria(result: Replayed) -> None:
    from stillhook.live.watch.windows.batches import WINDOWS
    from stillhook.live.watch.windows.criteria import Status

    lines: dict[tuple[str, str], dict[str, Any]] = {}
    for r in result.criteria:
        lines.setdefault((r.key, r.of), {})[r.window] = r
    rows = []
    for (key, of), by_window in lines.items():
        known = [r for r in by_window.values() if r.status is not Status.FILLING]
        if known:
            last = known[-1]
            states = [by_window[w].status.value if w in by_window else "-" for w in WINDOWS]
            rows.append([key, f"{last.title}{f' ({of})' if of else ''}", last.limit, last.text, *states])
    if rows:
        header = ["key", "criterion", "limit", "longest full window (95 %)", *WINDOWS]
        print_table(header, rows, title="Criteria at the end", left=4, texts=(1,))
    print(f"{len(result.not_judged)} criteria are not judged on this stream; --json says which, and why.")
    offset, half = result.clock
    if offset == offset:
        print(
            f"Clock: the encoder is {1e3 * offset:.0f} ms +- {1e3 * half:.0f} ms late against the pressures; taken out."
        )
    else:
        print("Clock: offset of the encoder not found (it needs alpha_p, alpha_m, p_a, p_b in motion); none taken out.")


def _print_entries(result: Replayed) -> None:
    rows = [
        [f"{e.start:.0f} s", "lasts" if e.end != e.end else f"{e.end:.0f} s", str(times), e.sort, e.text]
        for e, times in result.summary
    ]
    if rows:
        header = ["from", "to", "times", "what", "at first"]
        print_table(header, rows, title="What was outside its limits", left=0, texts=(3, 4))
    else:
        print("Nothing was outside its limits.")
    if result.cause:
        from stillhook.live.watch.causes.diagnosis import NOT_VARIED

        print(f"Not judged as causes: {', '.join(NOT_VARIED)}; see docs/validation/watch.md.")


def _print_virtual(crane: Crane, result: Replayed) -> None:
    from stillhook.live.watch.virtual import sensors_of
    from stillhook.units import show

    known = {s.name: s for s in sensors_of(crane)}
    rows = [
        [
            f"virtual.{r.name}",
            show(r.value, known[r.name].kind),
            f"+-{show(r.half, HALF_KINDS.get(known[r.name].kind, known[r.name].kind), 2)}" if r.half == r.half else "-",
            "yes" if r.valid else f"no: {r.reason}",
            known[r.name].meaning,
        ]
        for r in result.virtual
    ]
    if rows:
        header = ["virtual sensor", "at the end", "95 %", "valid", "meaning"]
        print_table(header, rows, title="What the crane does not measure", texts=(3, 4))


def demo(
    duration: Annotated[str, typer.Option(help="Length of the demonstration.")] = "60 s",
    json: Json = False,
) -> None:
    """A soft PLC with its crane, the twin next to it, and an alarm when the crane's friction grows: in the terminal,
    without a network. What is not a terminal gets lines. Exit code 1 if no alarm came.

    Example: stillhook live demo --duration "20 s"
    """
    from stillhook.library import load_crane
    from stillhook.live.demo import SHORTEST, demonstrate
    from stillhook.units import parse

    seconds = parse(duration, "time", "--duration")
    if seconds < SHORTEST:
        raise LiveError(
            f"--duration {seconds:g} s: too short for waves on both sides of the change. Give {SHORTEST:g} s or more."
        )
    with _watched(quiet=json) as show:
        outcome = demonstrate(load_crane(CRANE), seconds, show)
    lines = [outcome.reason, outcome.scheduling]
    answer = Answer("A soft PLC with its crane, and the twin beside the PLC", lines)
    present(outcome._asdict(), brief=lambda: answer, json=json)
    raise typer.Exit(0 if outcome.alarm == outcome.alarm else 1)


@contextmanager
def _watched(*, quiet: bool) -> Iterator[Callable[[Moment], None]]:
    """What shows a moment: a table that is drawn again, or lines without a terminal."""
    from rich.console import Console
    from rich.live import Live

    console = Console()
    if quiet:
        yield lambda moment: None
    elif not console.is_terminal:
        yield _Lines().show
    else:
        with Live(console=console, auto_refresh=False) as live:
            events: list[str] = []

            def show(moment: Moment) -> None:
                events.extend(f"{e.source}: {e.text}" for e in moment.events)
                if moment.events or round(moment.time * 10) % 3 == 0:
                    live.update(_table(moment, events[-SHOWN_EVENTS:]), refresh=True)

            yield show


class _Lines:
    """Moments as lines: every event, and the deviations now and then."""

    def __init__(self, *, quiet: bool = False) -> None:
        self._next = 0.0
        self._quiet = quiet

    def show(self, moment: Moment | ReplayMoment) -> None:
        """Print a moment where it is time for it."""
        from stillhook.live.watch.deviation import shown

        if self._quiet:
            return

        for happened in moment.events:
            say(f"{moment.time:6.1f} s  {happened.source}: {happened.text}")
        if moment.time >= self._next:
            self._next = moment.time + LINE_EVERY
            parts = [f"{d.name} {shown(d.name, d.measured - d.simulated)} {d.status}" for d in moment.deviations]
            say(f"{moment.time:6.1f} s  measured less twin: {', '.join(parts)}")


def _table(moment: Moment, events: list[str]) -> Any:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from stillhook.live.watch.deviation import shown

    status = moment.status
    title = (
        f"{moment.time:5.1f} s   cycle {status['cycle_number']:.0f}   late {status['late_cycles']:.0f}"
        f"   worst {1e3 * status['worst_lateness']:.2f} ms"
    )
    table = Table(title=title, title_justify="left")
    for name in ("signal", "crane of the PLC", "twin", "rms deviation", "limit", "status"):
        table.add_column(name, justify="left" if name in ("signal", "status") else "right")
    for d in moment.deviations:
        cells = [d.name, *(shown(d.name, x) for x in (d.measured, d.simulated, d.rms, d.limit))]
        table.add_row(*cells, Text(d.status, style="bold red" if d.alarm else "green"))
    return Group(table, *(Text(line) for line in events))
