"""The manifest of a command's files names every file that they follow from: those typed, and those that they name."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest
from tests.commands import answer, case_file

from stillhook.base.gateway.inputs import collecting, inputs, note_input
from stillhook.cli import run
from stillhook.errors import PlanError
from stillhook.formats.case_file import load_case
from stillhook.library.toml.tree import LIBRARY
from stillhook.plan.result import PLAN_FILES, load_plan_result
from stillhook.trust.manifest import NAME, Made, Manifest, manifest_of, read_manifest
from stillhook.trust.results import result_folder


def named(folder: Path) -> dict[str, str]:
    """Inputs in the manifest of a folder by name."""
    (made,) = read_manifest(folder / NAME).sets
    return dict(made.inputs)


def hashes(*files: Path) -> dict[str, str]:
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """A case of a crane file that builds on another."""
    (tmp_path / "base.toml").write_text('base = "nov-250t"\ntitle = "Base"\n')
    (tmp_path / "mine.toml").write_text('base = "base.toml"\ntitle = "Mine"\n')
    return Path(case_file(tmp_path, crane="mine.toml"))


def test_files_that_are_typed_and_that_they_name_are_inputs_with_their_hashes(case: Path, tmp_path: Path):
    def write() -> bytes:
        with collecting({"case": case}):
            load_case(case)
            with result_folder(tmp_path / "o", "run") as part:
                (part / "run.nc").write_bytes(b"numbers")
        assert named(tmp_path / "o") == hashes(case, tmp_path / "base.toml", tmp_path / "mine.toml")
        return (tmp_path / "o" / NAME).read_bytes()

    first = write()
    assert write() == first
    case.write_text(case.read_text() + "# one more remark\n")
    assert write() != first


def test_files_of_the_library_are_covered_by_the_hash_of_the_code(tmp_path: Path):
    with (
        collecting({"crane": LIBRARY / "cranes" / "nov-250t.toml", "wave": "jonswap Hs=2 m"}),
        result_folder(tmp_path / "o", "run") as part,
    ):
        (part / "run.nc").write_bytes(b"numbers")
    assert named(tmp_path / "o") == {}
    assert '"inputs"' not in (tmp_path / "o" / NAME).read_text()


def test_no_file_is_an_input_outside_of_a_command_or_of_the_command_before(case: Path, tmp_path: Path):
    with collecting({"case": case, "out": case, "key": case}):
        assert [*inputs()] == [case]
    note_input(case)
    with result_folder(tmp_path / "o", "plan") as part:
        (part / "plan.nc").write_bytes(b"numbers")
    assert named(tmp_path / "o") == {}


def test_an_input_that_changed_meanwhile_is_not_named_and_costs_no_result(
    case: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
):
    with collecting({"case": case, "more": [tmp_path / "mine.toml"], "none": tmp_path / "gone.toml"}):
        case.write_text("crane = 'another'\n")
        with result_folder(tmp_path / "o", "plan") as part:
            (part / "plan.nc").write_bytes(b"numbers")
    assert named(tmp_path / "o") == hashes(tmp_path / "mine.toml")
    assert "case.toml: changed while the command ran, so that the manifest does not name it." in caplog.text


def test_a_manifest_gives_back_its_inputs_each_once(tmp_path: Path, case: Path):
    made = Made.of("plan", inputs=[case, case])
    assert manifest_of(Manifest({made: {}}).text().encode(), NAME).sets == {made: {}}


@pytest.mark.slow
def test_a_command_collects_them_and_without_out_a_program_for_a_plc_has_a_folder_of_its_own(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    before = {*os.listdir()}
    files: list[str] = answer(capsys, "plc", "export", case.name)["files"]
    assert {*os.listdir()} - before == {"mine-plc"}
    assert {*os.listdir("mine-plc")} == {NAME, *(Path(file).name for file in files)}
    assert named(tmp_path / "mine-plc") == hashes(case, tmp_path / "base.toml", tmp_path / "mine.toml")
    run(["manifest", "mine-plc"])
    assert ", of base.toml, case.toml, mine.toml" in " ".join(capsys.readouterr().out.split())


def test_a_report_names_the_files_of_its_plan(tmp_path: Path):
    """Also those that turn out to be no plan: what was read is what it follows from."""
    for name in PLAN_FILES:
        (tmp_path / name).write_text("{}")
    with collecting({"folder": tmp_path}):
        with pytest.raises(PlanError):
            load_plan_result(tmp_path)
        assert {path.name for path in inputs()} == set(PLAN_FILES)
