"""The exported Structured Text as a soft PLC: compiled to a shared library by a compiler that is found, and called.

MATIEC (iec2c) turns the text into C, which the C compiler of the other exports turns into a library. Another compiler
joins as one more entry of `COMPILERS`: what it makes of the text has to offer the three functions of `LIBRARY`.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.base.kept.leftovers import temporary_folder
from stillhook.errors import ExportError, LiveError
from stillhook.export.plc.block import controller_block
from stillhook.export.plc.text import structured_text
from stillhook.export.twin import compile_library, own_platform
from stillhook.live.hil.controller import INPUTS, OUTPUTS, SIGNALS
from stillhook.spec.crane import Crane

LONGEST = 60.0
"""Time of a compiler at most [s]."""
LIBRARY: Mapping[str, tuple[type, ...]] = {
    "stillhook_size": (),
    "stillhook_start": (ctypes.c_void_p,),
    "stillhook_cycles": (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t),
}
"""Functions of a library with the types of what they take: bytes of a block's memory; put its first values there; n
cycles from rows of `INPUTS` to rows of `OUTPUTS`, doubles all of them."""
SOURCE = Path(__file__).with_name("block.c").read_text(encoding="utf-8")
"""What calls a block's C source."""


class TextCompiler(Protocol):
    """A compiler of IEC 61131-3 Structured Text. looked_for: what of it a machine has to have, and where."""

    looked_for: ClassVar[str]

    @classmethod
    def find(cls) -> TextCompiler | None:
        """This machine's; None where it has none."""

    def library(self, text: str, block: str, folder: Path) -> Path:
        """A shared library with the functions of `LIBRARY` of a function block in a text, in an empty folder.

        Errors: LiveError, one line, where the text is not taken.
        """


@dataclass(frozen=True)
class Matiec:
    """iec2c of MATIEC, and its folder lib."""

    looked_for: ClassVar[str] = (
        "iec2c of MATIEC on the PATH or named by STILLHOOK_IEC2C, with its folder lib next to it or named by"
        " STILLHOOK_IEC2C_LIB"
    )
    iec2c: Path
    lib: Path

    @classmethod
    def find(cls) -> Matiec | None:
        """As of `TextCompiler`."""
        named = os.environ.get("STILLHOOK_IEC2C") or shutil.which("iec2c")
        if not named:
            return None
        iec2c = Path(named).resolve()
        lib = Path(os.environ.get("STILLHOOK_IEC2C_LIB") or iec2c.parent / "lib").resolve()
        return cls(iec2c, lib) if iec2c.is_file() and (lib / "C" / "iec_std_lib.h").is_file() else None

    def library(self, text: str, block: str, folder: Path) -> Path:
        """As of `TextCompiler`."""
        (folder / "block.st").write_text(text, encoding="utf-8")
        done = _run([str(self.iec2c), "-f", "-I", str(self.lib), "-T", str(folder), str(folder / "block.st")])
        if done.returncode != 0 or "error" in done.stderr or not (folder / "POUS.c").is_file():
            lines = [line for line in done.stderr.splitlines() if "error" in line] or done.stderr.splitlines()
            raise LiveError(f"Structured Text: iec2c refused it: {(lines or ['no reason'])[0].strip()[:300]}")
        put = [f"        __SET_VAR(b->,{name.upper()},,in[{i}]);" for i, name in enumerate(SIGNALS)]
        put += [
            f"        __SET_VAR(b->,{name.upper()},,in[{i}] > 0.5 && in[{i}] < 1.5);"
            for i, name in enumerate(INPUTS[len(SIGNALS) :], len(SIGNALS))
        ]
        get = [f"        out[{i}] = __GET_VAR(b->{name.upper()},);" for i, name in enumerate(OUTPUTS)]
        of = {"block": block.upper(), "n_in": len(INPUTS), "n_out": len(OUTPUTS)}
        source = SOURCE.format(**of, put="\n".join(put), get="\n".join(get))
        file, platform = folder / "library", own_platform()
        flags = ("-std=gnu99", "-w", f"-I{self.lib / 'C'}", f"-I{folder}")
        try:
            compile_library(source, platform or "this machine's", file, flags)
        except ExportError as problem:
            raise LiveError(f"Structured Text: {problem}") from None
        return file


COMPILERS: Sequence[type[TextCompiler]] = (Matiec,)
"""In the order in which they are looked for."""


def find_compiler() -> TextCompiler:
    """The first compiler of this machine. Errors: LiveError, one line, where it has none."""
    compiler = next((made for each in COMPILERS if (made := each.find()) is not None), None)
    if compiler is None:
        looked_for = "; or ".join(each.looked_for for each in COMPILERS)
        raise LiveError(
            f"Structured Text: this machine has no compiler of it. Looked for: {looked_for}. Get one, or run the"
            " library's controller, which needs none."
        )
    return compiler


class CompiledText:
    """The exported text of a controller, compiled: a `Controller`. Several have a memory each.

    Parameters: crane; name of the controller; text: that of a file which `stillhook plc export` wrote for them, with
    settings that were changed since, say; default is what it writes now. A text is a program: it runs in this process.

    Errors: PlcError where the crane's drive does not take the controller; LiveError, one line, without a compiler, and
    for a text that it does not take.
    """

    def __init__(self, crane: Crane, name: str, text: str | None = None) -> None:
        block = controller_block(crane, name)
        compiler = find_compiler()
        self.t_cycle = block.t_cycle
        text = structured_text(block) if text is None else text
        if f"FUNCTION_BLOCK {block.block.name}" not in text.replace("\r", "\n").split("\n"):
            raise LiveError(
                f"Structured Text: has no function block {block.block.name}. Give a text that stillhook plc export"
                f" wrote for the controller {name}."
            )
        self._folder = temporary_folder("plc")
        library = ctypes.CDLL(str(compiler.library(text, block.block.name, Path(self._folder.name))))
        for function, arguments in LIBRARY.items():
            getattr(library, function).argtypes = arguments
        library.stillhook_size.restype = ctypes.c_size_t
        self._cycles = library.stillhook_cycles
        self._start = library.stillhook_start
        self._memory = ctypes.create_string_buffer(library.stillhook_size())
        self.start()

    def start(self) -> None:
        """Begin again, before the first cycle."""
        self._start(self._memory)

    def cycle(self, inputs: FloatArray) -> FloatArray:
        """As of `Controller`."""
        return self.cycles(inputs).reshape(-1)

    def cycles(self, inputs: FloatArray) -> FloatArray:
        """Commands (n, len(OUTPUTS)) of n cycles on inputs (n, len(INPUTS)), as many calls of `cycle` give."""
        rows = np.ascontiguousarray(inputs, dtype=np.float64).reshape(-1, len(INPUTS))
        commands = np.empty((len(rows), len(OUTPUTS)))
        self._cycles(self._memory, rows.ctypes.data, commands.ctypes.data, len(rows))
        return commands


def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=LONGEST, check=False)
    except (OSError, subprocess.TimeoutExpired) as problem:
        reason = getattr(problem, "strerror", None) or f"did not end within {LONGEST:g} s"
        raise LiveError(f"Structured Text: {command[0]}: {reason}. Name another with STILLHOOK_IEC2C.") from None
