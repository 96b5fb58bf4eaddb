"""C core, FMUs and libraries for hosts under the sanitizers for addresses and undefined behaviour."""

import functools
import os
import shutil
import subprocess
from pathlib import Path

import pytest

import stillhook
from stillhook.export.fmu.package import source_of
from stillhook.export.hosts import host_source
from stillhook.export.twin import export

HERE = Path(__file__).parent
FLAGS = (
    "-std=c99", "-D_GNU_SOURCE", "-O1", "-g", "-w", "-ffp-contract=off",
    "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer",
)  # fmt: skip

pytestmark = pytest.mark.thorough


@functools.cache
def compiler() -> str | None:
    """The first compiler here whose sanitizers work."""
    probe = "int main(void) { return 0; }"
    for name in ("gcc", "clang", "cc"):
        found = shutil.which(name)
        if found is None:
            continue
        target = Path(os.environ.get("TMPDIR", "/tmp")) / f"stillhook-probe-{os.getpid()}"
        built = subprocess.run(
            [found, *FLAGS, "-x", "c", "-", "-o", str(target)], input=probe, text=True, capture_output=True, check=False
        )
        ran = built.returncode == 0 and subprocess.run([str(target)], capture_output=True, check=False).returncode == 0
        target.unlink(missing_ok=True)
        if ran:
            return found
    return None


def run(program: str, source: str, folder: Path, *defines: str, apart: bool = False) -> list[int]:
    """Compile a program around a source, or apart from it, run it, and give the numbers that it prints."""
    found = compiler()
    if found is None:
        pytest.skip("no compiler with the sanitizers for addresses and undefined behaviour (gcc or clang with libasan)")
    model = folder / "model.c"
    model.write_text(source, encoding="utf-8")
    command = [found, *FLAGS, f'-DMODEL="{model}"', *defines, str(HERE / program), "-o", "program"]
    command += [str(model), "-rdynamic", "-ldl"] if apart else []
    built = subprocess.run([*command, "-lm"], cwd=folder, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr[-2000:]
    options = {"UBSAN_OPTIONS": "print_stacktrace=1", "ASAN_OPTIONS": "detect_stack_use_after_return=1"}
    done = subprocess.run(
        ["./program"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=500,
        env=os.environ | options,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return [int(word) for word in done.stdout.split()]


def exported(name: str, contents: str = "plant+controller", coupling: str = "tip"):
    crane = stillhook.load_crane(name)
    mode = crane.plant.type.default_mode
    case = stillhook.Scenario(load=f"{0.4 * crane.SWL} kg", s_w="100 m", tip="still", mode=mode)
    return export(crane, case, contents, coupling)


@pytest.mark.parametrize("fmi", ["2", "3"])
@pytest.mark.parametrize(
    ("name", "contents", "coupling"),
    [
        ("nov-250t", "plant+controller", "tip"),
        ("nov-250t", "controller", "tip"),
        ("nov-100t-cylinder", "plant", "tip"),
        ("nov-100t-electric", "plant+controller", "wire"),
        ("nov-250t-secondary", "plant", "wire"),
        ("utility-20t-open-circuit", "plant+controller", "tip"),
        ("nov-250t-digital", "plant+controller", "tip"),
    ],
)
def test_an_fmu_stays_within_its_memory_whatever_a_host_does(name, contents, coupling, fmi, tmp_path: Path):
    damaged, wild, said = run("fmu.c", source_of(exported(name, contents, coupling), fmi), tmp_path, f"-DFMI={fmi}")
    assert damaged > 3500  # of 6600; the others are states of a winch, if a strange one
    assert wild > 500
    assert said > 10_000


@pytest.mark.parametrize(("host", "number"), [("orcaflex", 1), ("simo", 2)])
def test_a_library_for_a_host_stays_within_its_memory_whatever_it_does(host: str, number: int, tmp_path: Path):
    source = host_source(exported("nov-250t", coupling="wire"), host)
    refused, calls, said = run("hosts.c", source, tmp_path, f"-DHOST={number}", apart=True)
    assert refused > 2500  # of 4000
    assert calls > 20
    assert said > 1000
