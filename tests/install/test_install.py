"""A wheel in a clean environment, outside of a checkout, in folders with blanks and letters of other alphabets.

STILLHOOK_INSTALL_PYTHONS="3.11 3.12 3.13 3.14" tries every one of these that the machine has; without it the interpreter
of the tests alone.
"""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stillhook import __version__
from stillhook.cli import COMMANDS

pytestmark = pytest.mark.thorough
ROOT = Path(__file__).resolve().parents[2]
THIS = f"{sys.version_info.major}.{sys.version_info.minor}"
VERSIONS = os.environ.get("STILLHOOK_INSTALL_PYTHONS", THIS).split()
FOLDER = "Kran Ålesund 起重机 no. 7"
EXTRA = "native"
"""A pure wheel has no compiled kernels: Zig compiles them."""
SCRIPT = """
import stillhook
crane = stillhook.load_crane("nov-250t")
case = stillhook.Scenario(load="100 t", s_w="100 m", tip="sine 1 m 10 s", duration="60 s", warm_up="30 s")
run = stillhook.simulate(crane, case)
stillhook.save_run(run, "Lauf 1 ø.nc")
print(stillhook.__file__)
print(run.status.item(), float(run.eta_c))
"""


@functools.cache
def interpreter(version: str) -> str | None:
    """A Python of this version that starts, None where there is none."""
    if version == THIS:
        return sys.executable
    roots = [Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"]
    found = [str(p) for root in roots for p in sorted(root.glob(f"{version}.*/bin/python"))]
    found += [p] if (p := shutil.which(f"python{version}")) else []
    uv = shutil.which("uv")
    if uv is not None:
        asked = subprocess.run([uv, "python", "find", version], capture_output=True, text=True, check=False)
        found += [asked.stdout.strip()] if asked.returncode == 0 else []
    test = "import sys, venv, ensurepip; print('%d.%d' % sys.version_info[:2])"
    for path in found:
        started = subprocess.run([path, "-c", test], capture_output=True, text=True, check=False)
        if started.returncode == 0 and started.stdout.strip() == version:
            return path
    return None


def clean_environment(**more: str) -> dict[str, str]:
    """The environment without what points to a checkout."""
    left_out = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "PYTHONDONTWRITEBYTECODE")
    return {k: v for k, v in os.environ.items() if k not in left_out and not k.startswith("STILLHOOK_")} | more


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("hatchling", reason="hatchling is not installed: no wheel can be built")
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    environment = os.environ | {"STILLHOOK_WHEEL": "pure"}
    subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    (path,) = folder.glob("*.whl")
    return path


@pytest.mark.parametrize("version", VERSIONS)
def test_a_wheel_works_in_a_clean_environment_under_any_name_of_its_folder(
    version: str, wheel: Path, tmp_path_factory: pytest.TempPathFactory
):
    python = interpreter(version)
    if python is None:
        pytest.skip(f"no Python {version} here")
    work = tmp_path_factory.mktemp("install") / FOLDER
    work.mkdir()
    here = work / "Umgebung ä"
    subprocess.run([python, "-m", "venv", str(here)], env=clean_environment(), check=True)
    scripts = here / ("Scripts" if os.name == "nt" else "bin")
    environment = clean_environment(STILLHOOK_CACHE=str(work / "Cache ü"), HOME=str(work), OPENBLAS_NUM_THREADS="1")

    def call(*command: str | Path, code: int = 0, **more: str) -> str:
        done = subprocess.run(
            list(map(str, command)), cwd=work, env=environment | more, capture_output=True, check=False, timeout=900
        )
        assert done.returncode == code, done.stderr.decode("utf-8", "replace")[-2000:]
        return done.stdout.decode("utf-8", "replace")

    pip = (scripts / "python", "-m", "pip", "--quiet", "--disable-pip-version-check", "install")
    subprocess.run([*map(str, pip), f"stillhook[{EXTRA}] @ {wheel.as_uri()}"], env=clean_environment(), check=True)
    stillhook = scripts / "stillhook"
    assert call(stillhook, "--version").strip() == f"stillhook {__version__}"
    place, result = call(scripts / "python", "-X", "utf8", "-c", SCRIPT).splitlines()
    assert Path(place).is_relative_to(here)
    assert result.startswith("ok ")
    assert (work / "Lauf 1 ø.nc").is_file()
    assert call(stillhook, "run", "Lauf 1 ø.nc", "--out", "Ergebnis å") != ""
    call(stillhook, "new", "crane", "min kran å.toml")
    assert "hook_mass" in call(stillhook, "crane", "min kran å.toml", PYTHONIOENCODING="cp1252")
    call(stillhook, "convert", "min kran å.toml", "ark ø.csv")
    if "inspect" in COMMANDS:
        (work / "Møling.csv").write_text("time [s],heave [m]\n0,0.1\n1,0.2\n2,0.1\n", encoding="utf-8")
        assert "heave" in call(stillhook, "inspect", "Møling.csv")
    call(stillhook, "crane", "kein Kran ß.toml", code=2)
