"""Texts of a crane file, such as its name, are text in every program that is exported, and never code of it."""

import ast
import re

import pytest

import stillhook
from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.export.hosts import host_source, write_host
from stillhook.export.plc import structured_text
from stillhook.export.plc.block import controller_block
from stillhook.export.twin import export
from stillhook.library import changed

ENDS = ('"""', "*)", "*/", "??/", "\\", '";', "$'", "-->", "]]>")
"""What ends a comment or a text in Python, Structured Text and C."""
NAME = "".join(f"n{end} EVIL := 1; (* /* " for end in ENDS)
CRANE = changed(stillhook.load_crane("nov-250t"), {"name": NAME, "title": NAME})
CASE = stillhook.Scenario(load="100 t", s_w="100 m", mode="ssc")


def test_a_name_of_two_lines_is_refused():
    with pytest.raises(StillhookError, match="give a text of one line"):
        changed(stillhook.load_crane("nov-250t"), {"title": "Crane 7\ntwin: validated"})


@pytest.mark.slow
def test_in_structured_text_the_name_ends_no_comment():
    text = structured_text(controller_block(CRANE, "ssc"))
    assert "EVIL" in text
    assert "EVIL" not in re.sub(r"\(\*.*?\*\)", "", text, flags=re.S)
    assert text.count("(*") == text.count("*)")  # nor begins one, for compilers that nest them


@pytest.mark.slow
def test_in_the_module_for_orcaflex_the_name_ends_no_text(tmp_path):
    write_host("orcaflex", CRANE, CASE, tmp_path / "out", platforms=())
    module = ast.parse((tmp_path / "out" / "stillhook_winch.py").read_text(encoding="utf-8"))
    assert [type(each) for each in module.body] == [ast.Expr, ast.ImportFrom, ast.ImportFrom, ast.ClassDef]
    assert "EVIL" not in ast.unparse(module)


@pytest.mark.slow
def test_in_c_the_name_is_nowhere_or_in_a_comment():
    source = host_source(export(CRANE, CASE, coupling="wire"), "simo")
    assert "EVIL :=" not in re.sub(r"/\*.*?\*/|//[^\n]*", "", source, flags=re.S)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["../../up", "-rf", "/abs", "a/b", "..", "$(id)"])
def test_the_name_leads_to_no_other_folder_and_is_no_option(name, tmp_path, monkeypatch):
    work = tmp_path / "a" / "b"
    work.mkdir(parents=True)
    (work / "crane.toml").write_text(f'base = "nov-250t"\nname = "{name}"\n')
    monkeypatch.chdir(work)
    assert run(["fmu", "crane.toml", "--platforms", "source"]) == 0
    written = {path for path in tmp_path.rglob("*") if path.is_file()} - {work / "crane.toml"}
    assert {path.parent for path in written} == {work}
    assert {path.name[0].isalnum() for path in written} == {True}
