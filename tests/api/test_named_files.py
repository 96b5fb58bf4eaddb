"""A file reads and writes what it names in its own folder, and elsewhere only where the user allows it."""

import os
from pathlib import Path

import numpy as np
import pytest
from tests.commands import refusal

import stillhook
from stillhook.base.gateway.named_files import VARIABLE, named_path, plain_name
from stillhook.errors import SeaError, SpecError, StillhookError, UnreadableError
from stillhook.formats.binary import read_dataset
from stillhook.formats.waves.wavespectra import read_wavespectra
from stillhook.live.live_file import read_live_file
from stillhook.logs.formats.columnar import open_hdf

N = 200
T = np.arange(N) * 0.1


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A folder with a crane above it that a file in it may not name."""
    (tmp_path / "up.toml").write_text('base = "nov-250t"\n')
    (tmp_path / "case").mkdir()
    return tmp_path / "case"


def wrong(why: str) -> StillhookError:
    return SpecError(f"file.toml: base: {why}")


@pytest.mark.parametrize("name", ["../up.toml", "/etc/passwd", "sub/../../up.toml", "./../case/../up.toml"])
def test_a_path_that_leads_out_of_the_folder_is_refused_by_its_name(project: Path, name: str) -> None:
    with pytest.raises(SpecError, match="leads out of the folder of this file"):
        named_path(project, name, wrong)


@pytest.mark.parametrize(
    "name", ["a.toml", "./a.toml", "sub/a.toml", "sub/../a.toml", "..a.toml", "a..toml", "~/a.toml"]
)
def test_a_path_below_the_folder_is_taken_whether_or_not_it_exists(project: Path, name: str) -> None:
    assert named_path(project, name, wrong) == project / name


@pytest.mark.skipif(os.name == "nt", reason="links need a right there")
def test_a_link_that_leads_out_of_the_folder_is_refused(project: Path) -> None:
    (project / "near.toml").symlink_to(project.parent / "up.toml")
    (project / "own.toml").write_text("")
    (project / "inside.toml").symlink_to(project / "own.toml")
    assert named_path(project, "inside.toml", wrong).is_file()
    with pytest.raises(SpecError, match="is a link that leads out"):
        named_path(project, "near.toml", wrong)


@pytest.mark.skipif(os.name == "nt", reason="links need a right there")
def test_a_sheet_of_a_book_that_is_a_link_is_refused_as_the_book_is(project: Path) -> None:
    (project.parent / "up.xlsx").write_bytes(b"")
    (project / "near.xlsx").symlink_to(project.parent / "up.xlsx")
    with pytest.raises(SpecError, match="is a link that leads out"):
        named_path(project, "near.xlsx#limits", wrong)
    assert named_path(project, "own.xlsx#limits", wrong) == project / "own.xlsx#limits"


@pytest.mark.skipif(os.name == "nt", reason="links need a right there")
def test_a_folder_that_is_reached_by_a_link_is_its_own_folder(project: Path) -> None:
    (project.parent / "short").symlink_to(project)
    (project / "a.toml").write_text("")
    assert named_path(project.parent / "short", "a.toml", wrong).is_file()


def test_a_path_that_no_system_follows_is_one_line(project: Path) -> None:
    for name in ("a\0b", "a" * 5000):
        with pytest.raises(SpecError, match="not a path that can be followed"):
            named_path(project, name, wrong)


@pytest.mark.parametrize(
    "name", ["", "..", "a/b", "/etc/passwd", "//host/share/a", "c:a", "\\\\host\\share\\a", "a" * 300]
)
def test_what_leads_anywhere_is_no_plain_name(name: str) -> None:
    assert not plain_name(name)
    assert plain_name("campaign 2.toml")


def test_the_line_names_what_the_user_sets_to_allow_it(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (project / "own.toml").write_text('base = "../up.toml"\n')
    with pytest.raises(SpecError) as refused:
        stillhook.load_crane(project / "own.toml")
    assert str(refused.value) == (
        'own.toml: base = "../up.toml": leads out of the folder of this file. Copy it there, or allow its folder, or'
        f" that of the whole project, in the environment: {VARIABLE}={project.parent}."
    )
    variable, _, folder = str(refused.value).rpartition(": ")[2].rstrip(".").partition("=")
    monkeypatch.setenv(variable, folder)
    assert stillhook.load_crane(project / "own.toml").SWL == stillhook.load_crane("nov-250t").SWL
    monkeypatch.chdir(project.parent)
    monkeypatch.setenv(variable, ".")
    assert stillhook.load_crane("case/own.toml").SWL == stillhook.load_crane("nov-250t").SWL


def test_a_folder_that_is_allowed_does_not_allow_those_above_it(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, os.pathsep.join([str(project / "logs"), ""]))
    with pytest.raises(SpecError, match="leads out"):
        named_path(project, "../up.toml", wrong)


CASE = 'crane = "{crane}"\n[scenario]\nload = "100 t"\ns_w = "100 m"\nmode = "ssc"\nduration = "10 s"\n{more}\n'
OUT = {
    "crane": (CASE.format(crane="../up.toml", more='tip = "sine 1 m 12 s"'), ("run",)),
    "crane of another ending": (CASE.format(crane="/etc/passwd", more='tip = "sine 1 m 12 s"'), ("run",)),
    "crane of a network": (CASE.format(crane="//host/share/crane", more='tip = "sine 1 m 12 s"'), ("run",)),
    "motion": (CASE.format(crane="nov-250t", more='tip = { file = "/etc/passwd" }'), ("run",)),
    "mapping": (
        CASE.format(crane="nov-250t", more='tip = { file = "log.csv", mapping = "../up.toml", position = "tip" }'),
        ("run",),
    ),
    "certificate": ('base = "nov-250t"\ncertificate = "../certificate.json"\n', ("crane",)),
    "condition": ('base = "nov-250t"\ncertificate = "c.json"\ncondition = "../up.json"\n', ("crane",)),
    "base": ('base = "../up.toml"\n', ("crane",)),
    "friction": ('base = "nov-250t"\nname = "own"\n[friction]\nlibrary = "../up.toml"\n', ("crane",)),
}


@pytest.mark.parametrize("field", OUT)
def test_every_field_with_a_path_keeps_to_the_folder(
    project: Path, capsys: pytest.CaptureFixture[str], field: str
) -> None:
    text, command = OUT[field]
    file = project / "own.toml"
    file.write_text(text)
    (project / "log.csv").write_text("t [s],heave [m]\n0,0\n1,1\n")
    assert "leads out of the folder of this file" in refusal(capsys, *command, file)


def test_the_store_of_a_case_file_is_not_written_elsewhere(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = project / "own.toml"
    file.write_text(CASE.format(crane="nov-250t", more='tip = "sine 1 m 12 s"') + '[settings]\nstore = "../kept"\n')
    assert "leads out" in refusal(capsys, "map", file)
    assert not (project.parent / "kept").exists()


def test_a_file_of_the_working_folder_is_not_taken_for_one_next_to_the_file(
    project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(project.parent)
    file = project / "own.toml"
    file.write_text(CASE.format(crane="up.toml", more='tip = "sine 1 m 12 s"'))
    assert "no such file" in refusal(capsys, "run", file)


def other_file(path: Path, way: str) -> None:
    """An HDF5 file whose column p_a is in a file of the folder above, in each way that the format has."""
    import h5py

    secret = path.parent.parent / "secret.h5"
    with h5py.File(secret, "w") as file:
        file["p_a"] = T
    T.astype("<f8").tofile(path.parent.parent / "secret.bin")
    layout = h5py.VirtualLayout(shape=(N,), dtype="<f8")
    layout[:] = h5py.VirtualSource(str(secret) if way == "virtual" else ".", "p_a", shape=(N,))
    with h5py.File(path, "w", libver="latest") as file:
        file["time"] = T
        if way == "link":
            file["group/p_a"] = h5py.ExternalLink(str(secret), "/p_a")
        elif way == "raw":
            file.create_dataset("p_a", (N,), "<f8", external=[(str(secret.with_suffix(".bin")), 0, 8 * N)])
        elif way == "virtual":
            file.create_virtual_dataset("p_a", layout)
        else:
            file["p_a"], file["soft"], file["up"] = T, h5py.SoftLink("/p_a"), file["/"]
            file.create_virtual_dataset("again", layout)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["link", "raw", "virtual"])
def test_what_an_hdf5_file_takes_from_another_file_is_not_read(tmp_path, way):
    """It would read any file of the user, whose numbers are then in the answer."""
    (tmp_path / "in").mkdir()
    path = tmp_path / "in" / "a.nc"
    other_file(path, way)
    with pytest.raises(UnreadableError, match=r'takes "(group/)?p_a" from another file'):
        read_dataset(path)
    with pytest.raises(UnreadableError, match=r'takes "(group/)?p_a" from another file'):
        open_hdf(path)


@pytest.mark.long
def test_nor_does_the_reader_of_other_programs_spectra_read_it(tmp_path):
    (tmp_path / "in").mkdir()
    other_file(tmp_path / "in" / "a.nc", "raw")
    with pytest.raises(SeaError, match='takes "p_a" from another file'):
        read_wavespectra(tmp_path / "in" / "a.nc", "era5")


def test_links_within_an_hdf5_file_are_followed(tmp_path):
    (tmp_path / "in").mkdir()
    other_file(tmp_path / "in" / "a.h5", "within")
    assert set(open_hdf(tmp_path / "in" / "a.h5").headings) == {"time", "p_a", "again"}


@pytest.mark.skipif(os.name == "nt", reason="links need a right there")
def test_a_twin_does_not_write_through_a_link_in_its_folder(
    project: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder that was unpacked may hold links, and events are written at the end of their file."""
    case = CASE.format(crane="nov-250t", more='tip = "still"')
    (project / "case.toml").write_text(case.replace('duration = "10 s"\n', ""))
    file = project / "live.toml"
    file.write_text('case = "case.toml"\nfolder = "twin"\n')
    (project / "twin" / "history").mkdir(parents=True)
    (project / "twin" / "state.bin").symlink_to("kept.bin")
    assert read_live_file(file).folder == project / "twin"
    (project / "twin" / "events.jsonl").symlink_to(project.parent / "up.toml")
    assert 'folder = "twin": "events.jsonl" in it is a link that leads out' in refusal(capsys, "live", "run", file)
    monkeypatch.setenv(VARIABLE, str(project.parent))
    assert read_live_file(file).folder == project / "twin"
