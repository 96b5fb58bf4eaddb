"""What every command does with its command line: repeated options, brackets in help, errors of Stillhook itself."""

import os
import re
import subprocess
import sys

import pytest
from tests.commands import commands, refusal

import stillhook
from stillhook.cli import main, run
from stillhook.cli.groups import Command

EVERY = commands()


class TestRepeatedOptions:
    def test_every_command_is_held_to_it(self):
        assert len(EVERY) > 30
        assert all(isinstance(command, Command) for command in EVERY.values())

    @pytest.mark.thorough
    @pytest.mark.parametrize("path", EVERY)
    def test_no_command_lets_the_last_of_repeated_values_win(self, capsys, path):
        options = [p for p in EVERY[path].params if p.param_type_name == "option"]
        one_value = [o for o in options if not (o.multiple or o.is_flag)]
        for option in one_value:
            said = refusal(capsys, *path.split(), option.opts[0], "1", option.opts[0], "2")
            assert said.startswith(f"error: {option.opts[0]} appears 2 times and takes one value. Give it once"), path

    def test_repeated_modes_do_not_drop_the_first(self, capsys):
        said = refusal(capsys, "compare", "--controllers", "ns", "--controllers", "ssc")
        assert "with commas between the values" in said

    def test_the_same_option_with_an_equals_sign_counts_too(self, capsys):
        assert "--controllers appears 3 times" in refusal(
            capsys, "compare", "--controllers=ns", "--controllers", "hs", "--controllers=ssc"
        )

    @pytest.mark.slow
    def test_values_of_options_that_may_be_repeated_all_count(self, capsys):
        assert run(["envelope", "nov-250t", "--loads", "100 t", "--loads", "150 t", "--json"]) == 0
        out = capsys.readouterr().out
        assert '"load":100000.0' in re.sub(r"\s", "", out)
        assert '"load":150000.0' in re.sub(r"\s", "", out)

    def test_two_limits_on_one_number_are_refused(self, capsys):
        said = refusal(capsys, "tune", "nov-250t", "--limit", "p_max <= 200 bar", "--limit", "p_max <= 300 bar")
        assert "p_max has a limit already. Write each limit once." in said


class TestHelp:
    @pytest.mark.thorough
    @pytest.mark.parametrize("path", EVERY)
    def test_help_shows_every_bracket_that_is_written_in_it(self, capsys, monkeypatch, path):
        monkeypatch.setenv("COLUMNS", "100")
        assert run([*path.split(), "--help"]) == 0
        shown = squeezed(capsys.readouterr().out)
        callback = EVERY[path].callback
        texts = [callback.__doc__, *(p.help for p in written(callback))]
        for text in texts:
            for bracket in re.findall(r"\[[^\]]*\]", text or ""):
                assert squeezed(bracket) in shown, (path, bracket)

    @pytest.mark.slow
    def test_the_case_file_of_run_has_a_scenario(self, capsys):
        assert run(["run", "--help"]) == 0
        assert "Casefile:craneand[scenario];" in squeezed(capsys.readouterr().out)

    def test_printed_names_and_values_keep_their_brackets(self, capsys):
        from stillhook.report.terminal import print_table, print_values

        print_values({"[bold]": "a [red] value"})
        print_table(["name [m]", "[x]"], [["[dim]row", "[1]"]], title="a [title]")
        shown = capsys.readouterr().out
        for text in ("[bold]", "a [red] value", "name [m]", "[x]", "[dim]row", "[1]", "a [title]"):
            assert text in shown

    def test_a_progress_bar_keeps_the_brackets_of_a_file_name(self, monkeypatch, capsys):
        from rich.console import Console

        from stillhook.report.terminal import progress_bar

        monkeypatch.setattr(Console, "is_terminal", property(lambda self: True))
        with progress_bar("lift[red]") as bar:
            bar(0.5)
        assert "lift[red]" in capsys.readouterr().err


class TestInternalErrors:
    def broken(self, monkeypatch: pytest.MonkeyPatch) -> None:
        import stillhook.library

        def cranes() -> list[str]:
            return [{}["nov-250t"]]

        monkeypatch.setattr(stillhook.library, "cranes", cranes)

    def test_an_internal_error_is_3_and_one_line_that_says_where_to_report_it(self, capsys, monkeypatch):
        monkeypatch.delenv("STILLHOOK_DEBUG", raising=False)
        self.broken(monkeypatch)
        assert run(["list", "cranes"]) == 3
        out, err = capsys.readouterr()
        assert out == ""
        assert err.count("\n") == 1
        assert err.startswith("error: Internal error of Stillhook ")
        assert "KeyError \"'nov-250t'\" in test_command_parser.py, line " in err
        assert (
            'Report it with the command and its files (CONTRIBUTING.md, "Report a finding"); STILLHOOK_DEBUG=1 shows the traceback.'
            in err
        )

    def test_the_page_that_the_line_names_has_that_heading(self):
        page = (os.path.dirname(__file__), "..", "..", "CONTRIBUTING.md")
        with open(os.path.join(*page), encoding="utf-8") as text:
            assert "\n## Report a finding\n" in text.read()

    def test_the_traceback_is_shown_on_request(self, capsys, monkeypatch):
        monkeypatch.setenv("STILLHOOK_DEBUG", "1")
        self.broken(monkeypatch)
        assert run(["list", "cranes"]) == 3
        err = capsys.readouterr().err
        assert "Traceback (most recent call last)" in err
        assert "in _cranes" in err
        assert err.splitlines()[-1].startswith("error: Internal error of Stillhook ")

    def test_a_message_of_many_lines_stays_one(self, capsys, monkeypatch):
        import stillhook.library

        def cranes() -> list[str]:
            raise ValueError("first\nsecond\x1b[31m" + 500 * "x")

        monkeypatch.setattr(stillhook.library, "cranes", cranes)
        monkeypatch.delenv("STILLHOOK_DEBUG", raising=False)
        assert run(["list", "cranes"]) == 3
        err = capsys.readouterr().err
        assert err.count("\n") == 1
        assert "\x1b" not in err

    def test_the_process_reads_its_arguments_without_its_own_name(self, capsys, monkeypatch):
        monkeypatch.setattr(sys, "argv", ["list", "--version"])
        monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0
        assert capsys.readouterr().out == f"stillhook {stillhook.__version__}\n"

    @pytest.mark.slow
    def test_the_process_itself_ends_with_3(self):
        code = "import stillhook.library as l, sys; l.cranes = lambda: 1 / 0; from stillhook.cli import main; sys.argv = ['stillhook', 'cranes']; main()"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
        assert done.returncode == 3
        assert "Traceback" not in done.stderr
        assert "ZeroDivisionError" in done.stderr


def written(callback: object) -> list[object]:
    """What a command's function says of its parameters, as typed."""
    import typing

    hints = typing.get_type_hints(callback, include_extras=True)
    return [
        info for hint in hints.values() for info in getattr(hint, "__metadata__", ()) if getattr(info, "help", None)
    ]


def squeezed(text: str) -> str:
    """Without spaces and frames: help is folded."""
    return re.sub(r"[\s│]", "", text)
