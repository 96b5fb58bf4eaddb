"""The drawn circuits are those that the winch types compute."""

import importlib
import re
import typing
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest
from tests.scripts import DOCS, script

from stillhook.thesis import gallery
from stillhook.winches import types

SCRIPTS = DOCS / "explanation" / "circuits"
FOLDER = Path(gallery.__file__).parent / "data"
PAGE = DOCS / "explanation" / "circuits.md"
SOURCES = Path(typing.cast(str, types.__file__)).parents[2]

NET = {"Q_a", "Q_b", "Q_s"}  # sums into a volume: no line of their own
DRAWN_STATE = re.compile(r"(p|V|alpha|x)_\w+(?<!_dot)|omega_m|E|i|theta")
ELEMENT = "phc"  # hangs below any winch, is none
SVG = "{http://www.w3.org/2000/svg}"


def modules() -> list[ModuleType]:
    """The winch types that are in the package."""
    folder = Path(typing.cast(str, types.__file__)).parent
    names = sorted(p.stem for p in folder.glob("*.py") if p.stem != "__init__")
    return [importlib.import_module(f"stillhook.winches.types.{name}") for name in names]


def letters(name: str) -> set[str]:
    """Letters of the code in a drawing."""
    root = ElementTree.parse(FOLDER / f"{name}.svg").getroot()
    titles = [node.findtext(f"{SVG}title") for node in root.iter(f"{SVG}text")]
    return {letter for title in titles if title for letter in title.split()}


LETTERS = {
    ("active-passive", "o"): {"Q_p": "Q_pp", "Q_ext": "Q_lp_ext", "Q_relief": "Q_relief_p"},
    ("secondary", "o"): {"Q_p": "Q_rp", "Q_ext": "Q_lp_ext"},
    ("digital", "o"): {"Q_p": "Q_rp", "Q_ext": "Q_lp_ext"},
    ("cylinder", "f"): {"Q_m": ""},
}
"""Letters of a drawing where they are others than in the record that several circuits share: winch and field -> letters;
"" for the motors' flow of a winch without motors."""


def records(module: ModuleType) -> dict[str, type]:
    """Records of a winch that hold flows, by the field of its circuit; "" its own."""
    hints = typing.get_type_hints(module.Circuit)
    return {"": module.Circuit, "u": module.Command} | {k: h for k, h in hints.items() if hasattr(h, "_fields")}


def flows(module: ModuleType) -> set[str]:
    """Flows and electric powers between the parts of a winch, by their letters in the drawing."""
    named = {
        LETTERS.get((module.NAME, field), {}).get(name, name)
        for field, record in records(module).items()
        for name in record._fields
    }
    electric = "P_dc" in named
    return {name for name in named if re.match("Q_|P_" if electric else "Q_", name)} - NET


@pytest.mark.parametrize("module", modules(), ids=lambda m: m.NAME)
def test_every_flow_of_the_equations_is_a_line_in_the_drawing(module):
    assert flows(module) - letters(module.NAME) == set()


@pytest.mark.parametrize("module", modules(), ids=lambda m: m.NAME)
def test_every_flow_in_the_drawing_is_one_of_the_equations(module):
    drawn = {letter for letter in letters(module.NAME) if letter.startswith("Q_")}
    rooms = {module.__name__, *(record.__module__ for record in records(module).values())}
    files = [str(importlib.import_module(room).__file__) for room in rooms]
    code = "\n".join(Path(file).read_text(encoding="utf-8") for file in files)
    rest = {name for name in drawn - flows(module) if not re.search(rf"\b{name}\b.* = ", code)}
    assert rest == set()


@pytest.mark.parametrize("module", modules(), ids=lambda m: m.NAME)
def test_every_pressure_volume_setting_and_speed_of_the_state_is_in_the_drawing(module):
    state = {name for name in module.State._fields if DRAWN_STATE.fullmatch(name)}
    assert state, module.NAME
    assert state - letters(module.NAME) == set()


def sections() -> dict[str, str]:
    """Sections of the page by the drawing that they show."""
    parts = PAGE.read_text(encoding="utf-8").split("\n## ")
    shown = [(re.search(r"/data/([\w-]+)\.svg\)", part), part) for part in parts]
    return {found[1]: part for found, part in shown if found}


def test_the_page_shows_every_drawing():
    assert set(sections()) == {path.stem for path in FOLDER.glob("*.svg")}


@pytest.mark.parametrize("module", modules(), ids=lambda m: m.NAME)
def test_the_functions_that_the_page_names_exist(module):
    code = "\n".join(path.read_text(encoding="utf-8") for path in SOURCES.rglob("*.py"))
    defined = set(re.findall(r"^def (\w+)\(", code, flags=re.MULTILINE))
    rows = [row.split("|") for row in sections()[module.NAME].splitlines() if row.startswith("| ")]
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row[3]) if not re.match(r"[QpV]_", name)}
    assert named, module.NAME
    assert named - defined == set()


def test_the_drawings_are_what_their_script_draws(tmp_path):
    pytest.importorskip("schemdraw", reason="the extra docs draws circuits")
    circuits = script(SCRIPTS / "draw_circuits.py")
    circuits.main(tmp_path)
    drawn = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.glob("*.svg")}
    kept = {path.name: path.read_text(encoding="utf-8") for path in FOLDER.glob("*.svg")}
    assert drawn.keys() == kept.keys()
    changed = [name for name in kept if kept[name] != drawn[name]]
    assert not changed, "run python docs/explanation/circuits/draw_circuits.py and look at the pictures"
