"""What a wheel holds in addition to the package: its kernels, compiled for every platform, and residuals, top speeds
and strong gains of the winches in the example plans. See docs/decisions/0021-what-a-wheel-holds.md.

A standard build of a wheel calls this; an editable installation compiles when something is first run.
"""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

if TYPE_CHECKING:
    from stillhook.kernels.c99.library import Library

ROOT = Path(__file__).resolve().parent
MADE = ROOT / "build" / "shipped"
PLACE = "stillhook/shipped"
VARIABLE, PURE = "STILLHOOK_WHEEL", "pure"
NEEDS = (
    "A wheel holds compiled kernels. That needs Zig and the packages that Stillhook runs with: make wheel sets them up,"
    f" or use an environment that has the extra native, without build isolation. {VARIABLE}={PURE} makes a wheel"
    " without; its kernels are compiled where it is installed."
)


class Target(NamedTuple):
    """A platform that kernels are compiled for: name for Zig, processor, suffix of a shared library."""

    triple: str
    cpu: str
    suffix: str


TARGETS = {
    "linux-x86_64_v2": Target("x86_64-linux-gnu", "x86_64_v2", ".so"),
    "linux-x86_64_v3": Target("x86_64-linux-gnu", "x86_64_v3", ".so"),
    "linux-aarch64": Target("aarch64-linux-gnu", "generic", ".so"),
    "windows-x86_64_v2": Target("x86_64-windows-gnu", "x86_64_v2", ".dll"),
    "windows-x86_64_v3": Target("x86_64-windows-gnu", "x86_64_v3", ".dll"),
    "macos-aarch64": Target("aarch64-macos.11.0", "apple_m1", ".dylib"),
}
LINK = ("build-lib", "-dynamic", "-fno-entry", "-fcompiler-rt", "-fstrip", "-fno-emit-implib", "-O", "ReleaseFast")
"""Without a C library: what the kernels use of one, copies of memory, is in the library."""


class CustomBuildHook(BuildHookInterface[Any]):
    """Puts what it makes into a wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        asked = os.environ.get(VARIABLE, "")
        if version != "standard" or asked == PURE:
            return
        names = [name for name in asked.split(",") if name] or list(TARGETS)
        if unknown := set(names) - set(TARGETS):
            raise SystemExit(
                f"{VARIABLE}: unknown {', '.join(unknown)}. Choose {PURE}, or some of {','.join(TARGETS)}."
            )
        if any(importlib.util.find_spec(package) is None for package in ("ziglang", "filelock", "numpy", "pydantic")):
            raise SystemExit(NEEDS)
        environment = {name: value for name, value in os.environ.items() if not name.startswith("STILLHOOK_")}
        environment |= {"PYTHONPATH": str(ROOT / "src"), "NUMBA_DISABLE_JIT": "0"}
        subprocess.run([sys.executable, __file__, str(MADE), *names], env=environment, check=True)
        build_data["force_include"][str(MADE)] = PLACE


def libraries() -> list[Library]:
    """Every kernel that the package calls without a winch or controller of the user."""
    from stillhook.identify.component import swash_fit
    from stillhook.kernels import plc_alone, tip_sampling
    from stillhook.kernels.build import Setup, driver, equations
    from stillhook.kernels.control_laws import controllers_of_winch
    from stillhook.kernels.lanes import VL
    from stillhook.winches.load_path.registry import UNITS
    from stillhook.winches.registry import WINCH_TYPES

    paths = [("wire", name, "payload") for name in ("slings", *UNITS)]
    paths += [("wire", "slings", body) for body in ("current", "deck")]
    setups = [Setup(), *map(Setup, paths)]
    of = {plant: controllers_of_winch(winch) for plant, winch in WINCH_TYPES.items()}
    kinds = [(plant, setup) for plant in of for setup in setups]
    kinds += [(plant, Setup(ports=True)) for plant, winch in WINCH_TYPES.items() if "active" in winch.tables]
    runs = [driver(plant, lanes, setup, of[plant]).run for plant, setup in kinds for lanes in (1, VL)]
    rates = [equations(driver(plant, 1, extra_controllers=extra)).rates_at for plant, extra in of.items()]
    alone = [plc_alone.kernel(names).run for names in sorted(set(of.values()))]
    return [entry.library for entry in (*runs, *rates, *alone, tip_sampling.kernel(), swash_fit.kernel())]


def compile_all(folder: Path, targets: Mapping[str, Target] = TARGETS) -> None:
    """Translate the kernels, compile them for each target, write the index."""
    from stillhook.kernels.build import kernel_hash
    from stillhook.kernels.c99.library import FLAGS, Index, code_hash

    kernels: dict[str, str] = {}
    with tempfile.TemporaryDirectory() as work:
        sources: list[Path] = []
        for n, library in enumerate(libraries()):
            source = library.source()
            kernels |= dict.fromkeys(library.entries, code_hash(source))
            sources.append(Path(work) / f"{n}.c")
            sources[-1].write_text(source, encoding="utf-8")
        for name, target in targets.items():
            cross_compile(sources, target, folder / f"{name}{target.suffix}", FLAGS)
    files = {name: f"{name}{target.suffix}" for name, target in targets.items()}
    Index(kernel_hash(), kernels, files).write(folder)


def cross_compile(sources: Sequence[Path], target: Target, file: Path, flags: Sequence[str]) -> None:
    """One shared library of all sources."""
    work = sources[0].parent
    compiling = [flag for flag in flags if flag not in ("-shared", "-s")]
    compiling += ["-c", "-fPIC", "-target", target.triple, f"-mcpu={target.cpu}"]
    objects = [work / f"{source.stem}.o" for source in sources]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        pairs = zip(sources, objects, strict=True)
        list(pool.map(lambda pair: zig(["cc", *compiling, "-o", str(pair[1]), str(pair[0])]), pairs))
    name = (
        ["-install_name", f"@rpath/{file.name}"] if file.suffix == ".dylib" else []
    )  # else it is the path of this build
    zig([*LINK, *name, "-target", target.triple, "--name", "kernels", f"-femit-bin={file}", *map(str, objects)])


def zig(arguments: Sequence[str]) -> None:
    """Run Zig."""
    kept = {f"ZIG_{which}_CACHE_DIR": str(ROOT / "build" / "zig") for which in ("LOCAL", "GLOBAL")}
    command = [sys.executable, "-m", "ziglang", *arguments]
    run = subprocess.run(command, env=os.environ | kept, capture_output=True, text=True, check=False)
    if run.returncode:
        raise SystemExit(f"Zig did not compile the kernels: {' '.join(arguments)}\n{run.stderr}")


def identify_all(folder: Path) -> None:
    """Residuals of the winches in the library's plans and lifts, as the frequency-domain method needs them; for a plan
    also top speeds of its winches and the gain of strong SSC. What a plan by runs needs besides is found there."""
    from stillhook.analysis.kept import FOLDER
    from stillhook.base.kept.checked import Kept, read_checked, write_checked
    from stillhook.formats.lift_file import load_lift
    from stillhook.library.toml.tree import shelf
    from stillhook.plan.file import load_plan, plans
    from stillhook.plan.planning import plan
    from stillhook.response.lift import compensated_depth
    from stillhook.response.suspended_load import suspended_load
    from stillhook.response.winch.identify import KEPT, identify_residual

    with tempfile.TemporaryDirectory() as cache:
        os.environ["STILLHOOK_CACHE"] = cache
        for name in plans():
            plan(load_plan(name), tier="frequency")
        for name in shelf("lifts"):
            of = load_lift(name, duration="60 s", moving=False)
            duty = suspended_load(of.crane, of.lift, -compensated_depth(of.lift)).duty
            identify_residual(of.crane, replace(duty, sensors=of.lift.sensors), of.lift.controller)
        shutil.copytree(Path(cache) / KEPT, folder / KEPT)
        for file in (Path(cache) / FOLDER).iterdir():
            answer = read_checked(file, Kept.ANSWER)
            assert answer is not None
            write_checked(folder / FOLDER / json.loads(answer)[-1], answer)


def main(folder: Path, *names: str) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    compile_all(folder, {name: TARGETS[name] for name in names or TARGETS})
    identify_all(folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
