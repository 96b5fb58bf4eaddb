"""Binds the drivers to one plant and its controllers, and caches the machine code under a hash of every kernel source.

A cache that is keyed on one file serves stale physics after an edit in another: hence the hash over all of them.

A wheel holds them compiled; what it does not hold is compiled by Zig where it is installed, else by Numba, which is
loaded for that alone.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.util
import os
import re
import threading
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from stillhook.base.extensions import extension_sources
from stillhook.base.kept.sources import PACKAGE
from stillhook.control.interface import DISPLACEMENT
from stillhook.control.registry import CONTROLLERS
from stillhook.errors import SimulationError
from stillhook.kernels import control_laws
from stillhook.kernels.c99.library import Entry, Library, native
from stillhook.kernels.c99.source import Translator, entry_types
from stillhook.kernels.cache import kernel_folder
from stillhook.kernels.drivers import lift, loop
from stillhook.kernels.drivers.equations import Equations, equations_of
from stillhook.kernels.drivers.rest import rest_of
from stillhook.kernels.drivers.winch import Driver, LaneParts, winch_driver
from stillhook.physics.hydraulics.motor_laws import labelled
from stillhook.physics.records import fields, with_class
from stillhook.winches.load_path.registry import ELEMENTS
from stillhook.winches.registry import WINCH_TYPES

PLANTS: dict[str, ModuleType] = {name: each.module for name, each in WINCH_TYPES.items()}
"""Module of every winch type. A plant from outside the package may be added under another name (`trials`)."""
KERNEL_FOLDERS = ("physics", "control", "winches", "kernels")
"""Rooms of every source that a kernel can inline, and of what compiles them."""
LOCK = threading.RLock()


class Setup(NamedTuple):
    """What a kernel runs besides a winch. path: names of the elements below it from the drum down, of
    `stillhook.winches.load_path.registry`: one that moves with the winch's own state, such as a host's tension, or the
    three of a lowering; () what the winch type names as its PATH. guarded: `stillhook.control.guard` stands before the
    PLC. sensors: those of the crane, by name. losses: torque losses of motors by other models than MJ4, each with its
    place in the winch's Params and its label of `stillhook.physics.hydraulics.motor_laws`. ports: the lines have
    restrictions, and a series holds the pressures at the ports of pumps and motors. checks:
    `stillhook.control.checks` is before that guard. late: displacement controls follow their commands after a dead
    time. predicts: the PLC predicts the tip's motion."""

    path: tuple[str, ...] = ()
    guarded: bool = False
    sensors: tuple[str, ...] = ()
    losses: tuple[tuple[str, str], ...] = ()
    ports: bool = False
    checks: bool = False
    late: bool = False
    predicts: bool = False

    @property
    def label(self) -> str:
        """What files of such kernels are called."""
        losses = (f"{place}-{loss}" for place, loss in self.losses)
        flags = {"checked": self.checks, "guarded": self.guarded, "ports": self.ports, "late": self.late}
        flags["predicts"] = self.predicts
        words = (*(word for word, on in flags.items() if on), *self.path, *losses)
        return "".join(f"{word}-" for word in words)


LOAD_ON_WIRE = Setup()


@functools.cache
def kernel_hash() -> str:
    """Hash of every source that a kernel can inline, and of the codes of the controllers that every kernel holds: they
    move where a user's own one is listed before them."""
    codes = [f"{law.name} {law.code}" for law in CONTROLLERS.values() if law.in_every_kernel]
    return PACKAGE.hash(PACKAGE.inside(KERNEL_FOLDERS, (".py",)), before=" ".join(codes))[:16]


RESULT_FOLDERS = (*KERNEL_FOLDERS, "engine", "sea", "spec", "tables", "library")
RESULT_FILES = ("metrics.py", "variables.csv", "variables.py")


@functools.cache
def results_hash() -> str:
    """Hash of everything but crane and scenario that a result follows from: `model_hash`, and the libraries that make
    sines and splines."""
    digest = hashlib.sha256(f"{model_hash()} numpy {version('numpy')} scipy {version('scipy')}".encode())
    return digest.hexdigest()[:16]


@functools.cache
def model_hash() -> str:
    """Hash of every source that a result follows from: kernels, motions, tables of the library."""
    names = [*PACKAGE.inside(RESULT_FOLDERS, (".py", ".toml")), *RESULT_FILES]
    return PACKAGE.hash(names, before=kernel_hash(), others=extension_sources())[:16]


def cache_folder(plant: str, lanes: int) -> Path:
    return kernel_folder(f"{kernel_hash()}-{plant}-{lanes}")


def _folder(plant: str, setup: Setup, extra_controllers: tuple[str, ...], prefix: str = "") -> str:
    """What the folder of a kernel is called; it holds the hash of the user's modules where winch or element are theirs,
    and of the files beside any other plant from outside the package."""
    of_user = extension_sources()
    files = [Path(str(module.__file__)) for module in (PLANTS[plant], *(ELEMENTS[name] for name in setup.path))]
    if not any(file in of_user for file in files):
        of_user = [] if files[0].is_relative_to(PACKAGE.folder) else sorted(files[0].parent.glob("*.py"))
    sources = b"\0".join(path.read_bytes() for path in of_user)
    digest = f"-{hashlib.sha256(sources).hexdigest()[:12]}" if sources else ""
    modules = control_laws.label(extra_controllers) + control_laws.sensors_label(setup.sensors)
    return f"{prefix}{setup.label}{plant}{digest}{modules}"


def interpreted() -> bool:
    """Whether kernels stay plain Python."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def is_compiled(plant: str, lanes: int, setup: Setup = LOAD_ON_WIRE, extra_controllers: tuple[str, ...] = ()) -> bool:
    """Whether a run of this plant starts from cached machine code."""
    if interpreted():
        return True
    entry = driver(plant, lanes, setup, extra_controllers).run
    if isinstance(entry, Entry) and not entry.library.failed:
        return entry.library.is_compiled()
    return any(cache_folder(_folder(plant, setup, extra_controllers), lanes).rglob("*.nbc"))


def driver(plant: str, lanes: int, setup: Setup = LOAD_ON_WIRE, extra_controllers: tuple[str, ...] = ()) -> Driver:
    """The driver of one plant for 1 or 16 lanes, compiled on first call, cached on disk.

    extra_controllers: those that it holds in addition to those of every kernel, see `stillhook.kernels.control_laws`.
    """
    with LOCK:
        return _driver(plant, lanes, setup, extra_controllers)


@functools.cache
def _driver(plant: str, lanes: int, setup: Setup, extra_controllers: tuple[str, ...]) -> Driver:
    module = PLANTS[plant]
    drive = getattr(module, "CONTROL", DISPLACEMENT)
    late = tuple(getattr(module, "SERVOS", ())) if setup.late else ()
    laws = control_laws.control_laws(
        extra_controllers, drive, setup.guarded, setup.sensors, setup.checks, late, setup.predicts
    )
    below = [ELEMENTS[name] for name in setup.path]
    lowers = len(below) > 1
    path = module.PATH if lowers or not below else below[0]
    parts = lift.lane_parts(*below) if lowers else LaneParts()
    Params = functools.reduce(lambda of, loss: with_class(of, loss[0], labelled(loss[1])), setup.losses, module.Params)
    of = (plant, extra_controllers, setup.losses)
    made = winch_driver(module, path, laws, lanes, of, parts, Params, ports=setup.ports)
    rest, run = rest_of(made), lift.run_of(made, *below) if lowers else loop.run_of(made)
    folder = _folder(plant, setup, extra_controllers)
    code = _machine_code({"run": run, "at_rest": rest.at_rest}, folder, lanes)
    return dataclasses.replace(made, prepare=rest.prepare, read=rest.read, **code)


def compiled(function: Any, name: str) -> Any:
    """A kernel of its own besides the drivers, compiled on first call and cached on disk under this name; see
    `driver`."""
    return _machine_code({function.__name__: function}, name, 1)[function.__name__]


@functools.cache
def equations(d: Driver) -> Equations:
    """The equations of a driver for one lane, for what differentiates them: compiled on first call, cached on disk;
    plain Python where no compiler is installed."""
    plant, extra_controllers, losses = d.made_of
    made = equations_of(d)
    kernels = {"rates_at": made.rates_at, "cycles_at": made.cycles_at}
    folder = _folder(plant, Setup(losses=losses), extra_controllers, "equations-")
    return dataclasses.replace(made, **_machine_code(kernels, folder, 1, make=_by_numba_or_python))


def _machine_code(
    kernels: Mapping[str, Any], name: str, lanes: int, make: Callable[[Any, Path], Any] | None = None
) -> dict[str, Any]:
    """Kernels as a wheel holds them, or as Zig compiles them, else as `make` does, default Numba; compiled on first
    call, cached under this name."""
    if interpreted() or not kernels:
        return dict(kernels)
    folder = cache_folder(name, lanes)
    other = _by_numba if make is None else make
    by_numba = {each: functools.partial(other, function, folder) for each, function in kernels.items()}
    if not native():
        return {each: make() for each, make in by_numba.items()}
    symbols = {each: re.sub(r"\W", "_", f"{each}_{name}_{lanes}") for each in kernels}
    entries = {symbol: kernels[each] for each, symbol in symbols.items()}
    library = Library(entries, folder, kernel_folder("native"), sources=kernel_hash())
    return {each: Entry(library, symbol, by_numba[each]) for each, symbol in symbols.items()}


def _by_numba_or_python(function: Any, folder: Path) -> Any:
    return function if importlib.util.find_spec("numba") is None else _by_numba(function, folder)


def _by_numba(function: Any, folder: Path) -> Any:
    if importlib.util.find_spec("numba") is None:
        raise SimulationError(
            "No compiler is installed. A winch or controller of your own, sensors with faults or drift, displacement"
            " controls with a dead time, a loss model other than MJ4, a compensator in a current, changed sources and"
            ' processors that the package holds no compiled model for need one: pip install "stillhook[compiler]".'
        )
    from stillhook.kernels.by_numba import machine_code  # heavy

    with LOCK:
        return machine_code(function, folder)


def c_source(plant: str, lanes: tuple[int, ...] = (1, 16), setup: Setup = LOAD_ON_WIRE) -> str:
    """One C99 file with everything that a plant's kernels do.

    For each lane count it exports `run_<lanes>` and `at_rest_<lanes>` (arguments as in
    `stillhook.kernels.drivers.loop`) and `step_<lanes>`, one step of one trajectory on structs.
    """
    t = Translator()
    for n in lanes:
        d = driver(plant, n, setup)
        lane = dict(fields(d.Lane))
        step = tuple(lane[f] for f in ("x", "u", "geo", "tip_0", "tip_1", "tip_2", "p"))
        for name in ("run", "at_rest"):
            t.function(getattr(d, name), entry_types(getattr(d, name)), export=f"{name}_{n}")
        t.function(d.step, (*step, float), export=f"step_{n}")
    return t.source()
