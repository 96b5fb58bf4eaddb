"""What a hurried or careless person types into the commands of the control analysis: one clear line, or an answer that
is whole."""

from __future__ import annotations

import os
import re
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from tests.commands import case_file

from stillhook.cli import run

FEW = ["--loads", "100 t", "--speeds", "40 m/min"]


def _on_terminal(columns: int, *arguments: str) -> str:
    """What a command prints on a terminal of this width, without its colours."""
    pytest.importorskip("termios", reason="no terminals of this kind here")
    import fcntl
    import pty
    import termios

    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    code = "import sys; from stillhook.cli import run; sys.exit(run(sys.argv[1:]))"
    around = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES")} | {"TERM": "xterm"}
    command = [sys.executable, "-c", code, *arguments]
    with subprocess.Popen(command, stdin=slave, stdout=slave, stderr=subprocess.DEVNULL, env=around) as process:
        os.close(slave)
        out = b""
        while True:
            try:
                part = os.read(master, 65536)
            except OSError:  # the other end is closed
                break
            if not part:
                break
            out += part
        process.wait()
    os.close(master)
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", out.decode())


@pytest.mark.thorough
def test_narrow_terminal_shows_every_number_whole() -> None:
    """No number is cut and no column lost on a terminal that is narrower than the table."""
    shown = _on_terminal(60, "envelope", "nov-250t", "--loads", "100 t", "--controllers", "ns,hs,ssc")
    for whole in ("86.93 m/min", "2771 rev/min", "108.3 bar", "+25.7 %", "-4.7 %", "over HS", "ssc"):
        assert whole in shown, whole
    assert max(len(line) for line in shown.splitlines() if line.startswith(("│", "┃"))) <= 60


@pytest.mark.slow
@pytest.mark.parametrize("name", ["best classic", "physical", "$x^{$"])
def test_controller_file_cannot_take_the_name_of_another_row(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A file called as the map's best classic would stand in its place in the answer, and $ is a formula in
    pictures."""
    path = tmp_path / f"{name}.toml"
    path.write_text('mode = "ssc"\n')
    assert run(["map", "--controllers", f"ns,{path}", *FEW]) == 2
    assert "Rename the file" in capfd.readouterr().err


@pytest.mark.thorough
def test_band_of_one_draw_is_no_band(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A single draw has no spread, and a heavy lift in HS with an open relief valve is no working controller: both are
    said."""
    assert (
        run(
            [
                "uncertainty",
                case_file(tmp_path, settings="seed = 3", load="250 t", tip="sine 2.8 m 12 s", duration="60 s"),
                "--controllers",
                "hs",
                "--draws",
                "1",
                "--verbose",
            ]
        )
        == 1
    )
    said = capfd.readouterr().out
    assert "too few draws for a 5 to 95 % band" in said
    assert "hs: every draw goes beyond a limit" in said
