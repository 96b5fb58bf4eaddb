"""A TOML file handed to the wrong command: one line says what it is and which command reads it."""

from pathlib import Path

import pytest
from tests.commands import refusal

import stillhook
from stillhook.base.gateway.named_files import VARIABLE
from stillhook.cli import run
from stillhook.library.toml.kinds import FileKind, kind_of_toml
from stillhook.library.toml.tree import toml_text

PACKAGE = Path(stillhook.__file__).parent
LIBRARY = PACKAGE / "library" / "data"
MAPPING = '[signals]\np_a = { column = "PT101", unit = "bar" }\n'
FILES = {
    FileKind.LIFT: LIBRARY / "lifts" / "anchor-to-3000m.toml",
    FileKind.CRANE: LIBRARY / "cranes" / "nov-250t.toml",
    FileKind.PAYLOAD: LIBRARY / "payloads" / "manifold-60t.toml",
    FileKind.COMPENSATOR: LIBRARY / "compensators" / "phc-60t.toml",
    FileKind.FRICTION: LIBRARY / "friction" / "crane-1.toml",
    FileKind.MOTOR: LIBRARY / "motors" / "A6VM170.toml",
    FileKind.RULES: PACKAGE / "plan" / "definition" / "rule_sets" / "offshore-lift.toml",
    FileKind.CRITERIA: PACKAGE / "validate" / "criteria" / "criteria_sets" / "paper-f.toml",
    FileKind.ALPHA: PACKAGE / "weather" / "alpha_tables" / "dnv-os-h101.toml",
}
TEXTS = {
    FileKind.CASE: 'crane = "nov-250t"\n[scenario]\nload = "100 t"\ns_w = "100 m"\ntip = "sine 2.8 m 12 s"\n',
    FileKind.FRICTION_CAMPAIGN: 'title = "x"\ncrane = "nov-150t"\n[[test]]\nname = "1"\nlog = "1.csv"\nload = "30 t"\n',
    FileKind.CAMPAIGN: 'crane = "nov-250t"\n[[test]]\nname = "1"\nlog = "1.csv"\nkind = "ahc"\nmode = "ssc"\n',
    FileKind.CONTROLLER: 'mode = "ssc"\n[control]\nK_p = "0.2 1/m"\n',
    FileKind.VESSEL: 'motions = "hull.nc"\nmass = "9000 t"\n',
    FileKind.FACTORS: "[factors]\nfriction = { lognormal = [1, 1.3] }\n",
    FileKind.MAPPING: MAPPING,
    FileKind.WEATHER: 'file = "site.csv"\n[columns]\nHs = "height"\n',
    FileKind.EVENTS: '[[event]]\ndate = 2027-03-01\nwhat = "repair"\nnumbers = ["friction"]\n',
    FileKind.COSTS: '[year]\nhours = "600 h"\n[drive.electric]\nmass = "60 t"\n',
    FileKind.LIVE: 'case = "case.toml"\nfolder = "twin"\n',
    FileKind.PLC: 'case = "case.toml"\ncontroller = "ssc"\n',
    FileKind.SCRIPT: '[[input]]\nname = "s_w"\nat = "1 s"\nlost = true\n',
    FileKind.REGISTERS: '[[register]]\nname = "s_w"\naddress = 0\n',
}
READERS = {
    FileKind.LIFT: ("lower",),
    FileKind.CASE: ("run",),
    FileKind.CRANE: ("crane",),
    FileKind.PAYLOAD: ("payload",),
    FileKind.CAMPAIGN: ("validate",),
    FileKind.FRICTION_CAMPAIGN: ("identify", "friction"),
    FileKind.FRICTION: ("friction", "compare"),
    FileKind.WEATHER: ("weather", "show"),
    FileKind.FACTORS: ("uncertainty", "--factors"),
    FileKind.COSTS: ("compare", "nov-250t", "--drives"),
    FileKind.CONTROLLER: ("map", "nov-250t", "--controllers"),
    FileKind.ALPHA: ("weather", "alpha", "--hs", "2 m", "--t-pop", "24 h", "--forecast-factors"),
}
ALSO_READ = {(FileKind.FRICTION, FileKind.MOTOR), (FileKind.PAYLOAD, FileKind.LIFT)}
"""What a command takes beside its own kind: loss models of a motor; of a lift the payload."""


@pytest.fixture
def files(tmp_path):
    """A file of every kind."""
    for kind, text in TEXTS.items():
        (tmp_path / f"{kind.name.lower()}.toml").write_text(text)
    return FILES | {kind: tmp_path / f"{kind.name.lower()}.toml" for kind in TEXTS}


def test_every_kind_of_file_is_known_by_its_tables(files):
    assert set(files) == set(FileKind)
    assert {kind: kind_of_toml(toml_text(path)) for kind, path in files.items()} == {kind: kind for kind in files}


@pytest.mark.parametrize("folder", ["cranes", "payloads", "compensators", "lifts", "friction", "motors"])
def test_every_file_of_the_library_is_known_as_what_it_is(folder):
    of = {
        "cranes": FileKind.CRANE,
        "payloads": FileKind.PAYLOAD,
        "compensators": FileKind.COMPENSATOR,
        "lifts": FileKind.LIFT,
        "friction": FileKind.FRICTION,
        "motors": FileKind.MOTOR,
    }
    assert {kind_of_toml(toml_text(path)) for path in (LIBRARY / folder).glob("*.toml")} == {of[folder]}


@pytest.mark.thorough
@pytest.mark.parametrize("wanted", list(READERS), ids=lambda kind: kind.name)
def test_a_command_names_the_file_that_it_was_handed_and_who_reads_it(wanted, files, capsys):
    for kind, path in files.items():
        if kind is wanted or (wanted, kind) in ALSO_READ:
            continue
        said = refusal(capsys, *READERS[wanted], path)
        assert f"{path.name} is {kind.noun}, not {wanted.noun}: {kind.read_by}." in said


@pytest.mark.slow
def test_names_of_the_library_are_told_apart_too(capsys):
    assert "The library has it as a payload file" in refusal(capsys, "crane", "manifold-60t")


def test_a_file_named_within_another_is_told_by_its_kind(files, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(LIBRARY))
    plan = tmp_path / "mine.toml"
    plan.write_text(
        toml_text(LIBRARY / "lifts" / "template-to-1500m.toml").replace(
            'payload = "template-120t"', f'payload = "{files[FileKind.LIFT]}"'
        )
    )
    assert "anchor-to-3000m.toml is a lift file, not a payload file" in refusal(capsys, "plan", plan, "--check")


def test_vessel_files_and_toml_files_are_told_apart(files, capsys):
    assert "is a lift file, not a vessel file" in refusal(capsys, "vessel", "--check", files[FileKind.LIFT])
    assert "is a vessel file, not TOML: stillhook vessel reads it" in refusal(
        capsys, "crane", LIBRARY / "vessels" / "supply-vessel-82m.csv"
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "wanted"),
    [
        (("sea",), "a file of measured waves"),
        (("weather", "show"), "a description of a weather file"),
        (("compare", "--motion"), "a log of motion"),
        (("identify", "motor"), "a table of numbers"),
    ],
)
def test_a_toml_file_in_place_of_data_is_told_too(command, wanted, files, capsys):
    said = refusal(capsys, *command, files[FileKind.LIFT])
    assert (
        f"anchor-to-3000m.toml is a lift file, not {wanted}: stillhook lower, response, plan and payload read it. Give {wanted} here."
        in said
    )


def test_a_mapping_says_what_it_is_not(files, tmp_path, capsys):
    (tmp_path / "log.csv").write_text("t;p\n0;1\n1;2\n")
    assert "is a lift file, not a mapping file: stillhook lower" in refusal(
        capsys, "identify", "curve", tmp_path / "log.csv", "--mapping", files[FileKind.LIFT]
    )


def test_a_crane_file_that_only_changes_one_part_is_still_read(tmp_path, capsys):
    (tmp_path / "mine.toml").write_text('base = "nov-250t"\nname = "mine"\n')
    assert run(["crane", str(tmp_path / "mine.toml"), "--json"]) == 0
    assert '"mine"' in capsys.readouterr().out
