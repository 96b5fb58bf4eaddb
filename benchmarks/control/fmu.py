"""An FMU with a controller in it as the PLC of the twin.

At every PLC cycle the FMU gets what the PLC reads, through the sensors of the case with their noise and delay, as the
inputs `sensed_...` of `stillhook fmu --contents controller` (those that it has), and gives `u_p`, `u_m` and `brake`
(those that it has; the motors are else at full displacement and the brake open); then it steps by a cycle. An FMU that
calculates its outputs in the step alone is a cycle late, as a PLC would be that writes at its next cycle. Commands
beyond their range are held in it, as an actuator would.

Everything else is that of a run: the same kernel, sixteen cases side by side, its statistics. A cycle takes some 20 us.
The library in an FMU is run: it may do whatever the user may.
"""

from __future__ import annotations

import atexit
import functools
import hashlib
import math
import shutil
import signal
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.progress import Progress
from stillhook.control.interface import Sensed
from stillhook.engine.inputs import COMMAND_AT, OVERRIDE, TICK
from stillhook.engine.scenario.run import Ready, ScenarioBlock, ScenarioType
from stillhook.engine.simulate import row_of
from stillhook.engine.store import Store, keys_of
from stillhook.engine.tasks import Task
from stillhook.errors import SimulationError, SpecError
from stillhook.kernels.build import compiled, driver
from stillhook.kernels.lanes import VL, offset
from stillhook.spec.crane import Crane
from stillhook.spec.scenario import Scenario

LEADS_OF, GAIN = ("t_lead", "t_lead_ff"), "K_p"
"""Parameters of an FMU that are the lead [s] and the position gain [1/m], where it has them."""
RANGES = {"u_p": (-1.0, 1.0), "u_m": (0.0, 1.0), "brake": (0.0, 1.0)}
ABSENT = {"u_m": 1.0, "brake": 0.0}
"""Commands of an FMU that does not give them."""
PREFIX = "sensed_"


class ControllerFmu(NamedTuple):
    """file; digest of its content; values: its parameters of LEADS_OF and GAIN that it has, by name, at the start those
    of the file; once: whether a process may have one instance alone."""

    file: Path
    digest: str
    values: tuple[tuple[str, float], ...] = ()
    once: bool = False

    @property
    def tunable(self) -> dict[str, float]:
        """Its parameters by name [SI]."""
        return dict(self.values)

    def at(self, lead: float, K_p: float) -> ControllerFmu:
        """With this lead [s] and gain [1/m], where it has such parameters."""
        new = {**dict.fromkeys(LEADS_OF, lead), GAIN: K_p}
        return self._replace(values=tuple((name, new[name]) for name, _ in self.values))


def controller_fmu(file: Path) -> ControllerFmu:
    """The FMU in a file. Errors: SpecError where it is none, has no u_p, or FMPy is not installed."""
    model = description(file)
    names = {v.name for v in model.modelVariables if v.causality == "output"}
    if model.coSimulation is None or "u_p" not in names:
        raise SpecError(f"{file}: no FMU for co-simulation with an output u_p. See docs/how-to/enter-the-benchmark.md.")
    ours = [v for v in model.modelVariables if v.causality == "parameter" and v.name in (*LEADS_OF, GAIN)]
    values = tuple((v.name, float(v.start or 0.0)) for v in ours)
    once = bool(model.coSimulation.canBeInstantiatedOnlyOncePerProcess)
    return ControllerFmu(file.resolve(), hashlib.sha256(file.read_bytes()).hexdigest(), values, once)


@functools.cache
def description(file: Path) -> Any:
    """Description of the model in a file. Errors: SpecError."""
    try:
        from fmpy.model_description import read_model_description
    except ImportError:
        raise SpecError('An FMU as an entry needs FMPy: pip install "fmpy>=0.3.26".') from None
    try:
        return read_model_description(str(file))
    except Exception as problem:  # of a file that is no FMU many kinds come
        raise SpecError(f"{file}: not an FMU ({' '.join(str(problem).split())[:120]}).") from None


@functools.cache
def unpacked(file: Path) -> str:
    """Folder of the content of an FMU, until the process ends."""
    from fmpy import extract

    folder = tempfile.mkdtemp(prefix="stillhook-fmu-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return str(extract(str(file), folder))


class Instance:
    """One FMU that runs. Parameters: of; t_cycle time of a cycle [s]."""

    def __init__(self, of: ControllerFmu, t_cycle: float) -> None:
        from fmpy.simulation import instantiate_fmu

        model = description(of.file)
        by_name = {v.name: v for v in model.modelVariables}
        read = [name for name in Sensed._fields if PREFIX + name in by_name]
        real = [name for name in read if by_name[PREFIX + name].type in ("Real", "Float64")]
        self.of, self.t_cycle = of, t_cycle
        self.places = [Sensed._fields.index(name) for name in real]
        self.inputs = [by_name[PREFIX + name].valueReference for name in real]
        self.whole = {
            by_name[PREFIX + name].valueReference: Sensed._fields.index(name) for name in read if name not in real
        }
        self.commands = [name for name in RANGES if name in by_name]
        self.outputs = [by_name[name].valueReference for name in self.commands]
        self.parameters = [(by_name[name].valueReference, value) for name, value in of.values]
        try:
            self.fmu = instantiate_fmu(unpacked(of.file), model, "CoSimulation")
        except Exception as problem:  # such as no library for this system
            raise SimulationError(f"{of.file.name}: {' '.join(str(problem).split())}") from None
        two = model.fmiVersion.startswith("2")
        self.set_real = self.fmu.setReal if two else self.fmu.setFloat64
        self.get_real = self.fmu.getReal if two else self.fmu.getFloat64
        self.set_whole = self.fmu.setInteger if two else self.fmu.setInt32
        self.two, self.n = two, 0

    def cycle(self, read: Sequence[float]) -> dict[str, float]:
        """Commands on what the PLC reads, a number for each field of `Sensed`; then a step. Errors: SimulationError."""
        time = self.n * self.t_cycle
        try:
            if self.n == 0:
                self._begin(read)
            self.set_real(self.inputs, [read[i] for i in self.places])
            found = dict(zip(self.commands, self.get_real(self.outputs), strict=True))
            self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=self.t_cycle)
        except Exception as problem:  # of FMPy, which names no class of its own for all of them
            raise SimulationError(f"{self.of.file.name}, at {time:.6g} s: {problem}") from None
        if not all(map(math.isfinite, found.values())):
            raise SimulationError(f"{self.of.file.name}, at {time:.6g} s: a command is not a number: {found}.")
        self.n += 1
        held = {name: min(max(x, RANGES[name][0]), RANGES[name][1]) for name, x in found.items()}
        return ABSENT | held

    def _begin(self, read: Sequence[float]) -> None:
        """Start with the parameters of the entry and what is read first."""
        if self.two:
            self.fmu.setupExperiment(startTime=0.0)
        for reference, value in self.parameters:
            self.set_real([reference], [value])
        self.set_real(self.inputs, [read[i] for i in self.places])
        for reference, i in self.whole.items():
            self.set_whole([reference], [round(read[i])])
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def close(self) -> None:
        """The end of it."""
        self.fmu.terminate()
        self.fmu.freeInstance()


@functools.cache
def reader(winch: str, lanes: int, setup: Any, extra_controllers: tuple[str, ...]) -> Any:
    """What the PLC of every lane of a kernel reads, compiled."""
    of = hashlib.sha256(repr((winch, setup, extra_controllers)).encode()).hexdigest()[:12]
    return compiled(driver(winch, lanes, setup, extra_controllers).read, f"reads-{of}-{lanes}")


class FmuBlock(ScenarioBlock):
    """Scenarios side by side, whose winches take the commands of FMUs."""

    def __init__(self, ready: Sequence[Ready], *, of: ControllerFmu, **more: Any) -> None:
        super().__init__(ready, **more)
        winch = self.ready[0].winch
        self.reads = reader(winch.name, len(self.lanes), self.setup(self.ready[0]), winch.extra_controllers)
        self.tick = offset(self.d.Lane, "tick", 1)
        self.read = np.zeros((len(Sensed._fields), len(self.lanes)))
        self.fmus = [Instance(of, self.drive.t_cycle) for _ in self.ready]

    def piece(self, D: FloatArray, k: int, count: int) -> None:
        """Run cycles k .. k + count. The last cycle of a run, which is observed alone, has the commands before it."""
        for j in range(count):
            self._command(D[j])
            D[j + 1, OVERRIDE:TICK] = D[j, OVERRIDE:TICK]
            super().piece(D[j : j + 2], k + j, 1)

    def _command(self, row: FloatArray) -> None:
        """Commands of the FMUs into the row of a cycle (TICK, lanes)."""
        self.A[self.tick : self.tick + TICK] = row
        self.reads(self.A.reshape(-1), self.read.reshape(-1))
        for i, fmu in enumerate(self.fmus):
            row[OVERRIDE, i] = 1.0
            for name, value in fmu.cycle(self.read[:, i].tolist()).items():
                row[COMMAND_AT[name], i] = value

    def results(self) -> list[Any]:
        """The run of every case."""
        for fmu in self.fmus:
            fmu.close()
        return super().results()


class FmuType(ScenarioType):
    """Scenarios under an FMU."""

    def __init__(self, of: ControllerFmu) -> None:
        self.of = of

    def block(self, ready: Sequence[Ready], *, lanes: int, n_sub: int, every: int) -> FmuBlock:
        return FmuBlock(ready, of=self.of, lanes=lanes, n_sub=n_sub, every=every)

    def as_bytes(self, cases: Sequence[Scenario]) -> list[bytes]:
        of = f"{self.of.digest} {self.of.values}".encode()
        return [of + case for case in super().as_bytes(cases)]


def run_hosted(
    cranes: Sequence[Crane],
    cases: Sequence[Scenario],
    fmus: Sequence[ControllerFmu],
    *,
    every: int = 0,
    keep: Any = row_of,
    store: Path | None,
    processes: int,
    progress: Progress | None,
) -> list[Any]:
    """What is kept of every case on its crane under its FMU, in processes of their own, as
    `stillhook.engine.simulate.run_cases` has it; summaries are kept in the store, where one is given and nothing else
    is kept. Errors: SimulationError, of the FMU as well."""
    groups: dict[ControllerFmu, list[int]] = {}
    for i, fmu in enumerate(fmus):
        groups.setdefault(fmu, []).append(i)
    results: dict[int, Any] = {}
    keys: dict[int, bytes] = {}
    tasks: list[Task] = []
    folder = Store(store) if store is not None and keep is row_of else None
    for fmu, places in groups.items():
        of, machines, done = FmuType(fmu), [cranes[i] for i in places], [cases[i] for i in places]
        of.check(machines, done)
        n_sub = of.default_steps(machines, done, series=every > 0)
        if folder is not None:
            names = [of.names(crane, case) for crane, case in zip(machines, done, strict=True)]
            own = keys_of(machines, of.as_bytes(done), names, n_sub)
            keys |= dict(zip(places, own, strict=True))
            results |= {places[j]: row for j, row in folder.find(own, names.__getitem__).items()}
        missing = [i for i in places if i not in results]
        lanes = 1 if fmu.once else VL
        for k in range(0, len(missing), lanes):
            part = missing[k : k + lanes]
            tasks.append(Task(of, part, [cranes[i] for i in part], [cases[i] for i in part], n_sub, lanes, every, keep))
    for task, made in _in_processes(tasks, processes):
        if folder is not None:
            folder.put([keys[i] for i in task.indices], made)
        results |= dict(zip(task.indices, made, strict=True))
        if progress is not None:
            progress(len(results) / len(cases))
    return [results[i] for i in range(len(cases))]


def _in_processes(tasks: Sequence[Task], processes: int) -> Any:
    """Tasks with what is kept of their runs, as they finish."""
    if not tasks:
        return
    with ProcessPoolExecutor(processes, get_context("spawn"), _end_at_once) as pool:
        waiting = {pool.submit(Task.run, task.light()): task for task in tasks}
        try:
            for done in as_completed(waiting):
                yield waiting[done], done.result()
        except BrokenProcessPool:
            name = tasks[0].type.of.file.name  # type: ignore[attr-defined]
            raise SimulationError(f"{name}: the process that it ran in ended without a word.") from None
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _end_at_once() -> None:
    """Ctrl-C ends a process without a word: its parent says what there is to say."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
