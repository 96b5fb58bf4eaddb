"""The generated C99 as a reference: compiled with gcc, called with the same arrays as our own kernels."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
from numpy.ctypeslib import ndpointer

from stillhook.kernels.build import c_source

COMMON = (
    "-std=c99 -O3 -march=native -ffp-contract=fast -fno-math-errno -fno-trapping-math -fno-signed-zeros -fopenmp-simd"
)
WIDTHS = {
    "512-bit vectors": "-mprefer-vector-width=512",
    "256-bit vectors": "-mprefer-vector-width=256",
    "default vectors": "",
}
"""Ways to compile; the fastest that the machine and gcc take is the reference."""


class CKernel:
    """`run` and `at_rest` of a compiled library for a number of lanes."""

    def __init__(self, library: ctypes.CDLL, lanes: int) -> None:
        array, integer = ndpointer(np.float64, flags="C_CONTIGUOUS"), ctypes.c_int64
        self.run = getattr(library, f"run_{lanes}")
        self.run.argtypes = [array, array, integer, array, array, array, *[integer] * 7, ctypes.c_double]
        self.run.restype = None


def compiler() -> str | None:
    return shutil.which("gcc")


def compile_c(plant: str, folder: Path, flags: str) -> ctypes.CDLL | None:
    """The plant's C file as a shared library; None where gcc refuses the flags."""
    gcc = compiler()
    assert gcc is not None
    source, library = folder / f"{plant}.c", folder / f"{plant}-{abs(hash(flags))}.so"
    source.write_text(c_source(plant), encoding="utf-8")
    command = [gcc, *flags.split(), "-shared", "-fPIC", str(source), "-o", str(library), "-lm"]
    done = subprocess.run(command, capture_output=True, text=True)
    return ctypes.CDLL(str(library)) if done.returncode == 0 else None


def gcc_version() -> str:
    return subprocess.run([compiler() or "gcc", "--version"], capture_output=True, text=True).stdout.splitlines()[0]
