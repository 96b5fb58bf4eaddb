"""A page is computed again when code, libraries or its tables change, and only then."""

import shutil

import pytest
from tests.scripts import PAGES, script

from trials import store as outcomes

MAKE = script(PAGES / "make.py")
TEXT = "# Page\n\nProse.\n\n<!-- table -->\n| a |\n| 1 |\n<!-- end -->\n"


@pytest.fixture(scope="module")
def computed():
    return script(PAGES / "computed.py")


@pytest.fixture
def house(tmp_path, computed):
    """A small project with one page that is kept."""
    for name, text in {
        "src/stillhook/physics/load_path/drum.py": "k = 1",
        "src/stillhook/plan/definition/rules.py": "r = 1",
        "src/stillhook/units.py": "u = 1",
        "docs/validation/case.py": "c = 1",
        "requirements.lock": "numpy==2",
        "page.md": TEXT,
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    places = ["src/stillhook/physics/load_path/drum.py", "src/stillhook/units.py", "docs/validation/case.py"]
    kept = {"code": computed.code(places, tmp_path), "tables": computed.tables(TEXT), "loaded": computed.packed(places)}
    computed.keep({"page.md": kept}, tmp_path / "computed.json")
    return tmp_path


def stands(computed, house):
    return computed.stands(house / "page.md", house, house / "computed.json")


def test_a_page_stands_while_nothing_that_it_rests_on_changes(computed, house):
    assert stands(computed, house)
    (house / "src/stillhook/plan/definition/rules.py").write_text("r = 2")
    (house / "page.md").write_text(TEXT.replace("Prose.", "Other prose."))
    assert stands(computed, house)


@pytest.mark.parametrize(
    "change",
    [
        {"src/stillhook/physics/load_path/drum.py": "k = 2"},
        {"src/stillhook/units.py": "u = 2"},
        {"docs/validation/case.py": "c = 2"},
        {"requirements.lock": "numpy==3"},
        {"page.md": TEXT.replace("| 1 |", "| 2 |")},
        {"computed.json": "{}"},
    ],
    ids=lambda change: next(iter(change)),
)
def test_a_change_of_code_libraries_or_tables_asks_for_a_new_computation(computed, house, change):
    for name, text in change.items():
        (house / name).write_text(text)
    assert not stands(computed, house)


@pytest.mark.parametrize(
    "change",
    [
        {"src/stillhook/physics/new.py": "n = 1"},
        {"src/stillhook/units.py": '"""Units."""\n\n# of the package\nu = 1  # none\n'},
        {"docs/validation/case.py": "c = 1\r\n"},
    ],
    ids=["a module that no run imported", "comments and docstrings", "line ends"],
)
def test_what_no_number_comes_from_asks_for_nothing(computed, house, change):
    for name, text in change.items():
        (house / name).write_bytes(text.encode())
    assert stands(computed, house)


def test_a_function_on_the_line_of_its_docstring_counts(computed, tmp_path):
    file = tmp_path / "a.py"
    file.write_text('def f(x): "Twice."; return 2 * x\n')
    assert b"return 2 * x" in computed.says(file)


def test_files_that_a_fresh_clone_lacks_are_no_part_of_a_stamp(computed):
    kept = [path for record in outcomes.read(computed.STORE).values() for path in computed.unpacked(record["loaded"])]
    assert kept
    assert not [path for path in set(kept) if not (computed.ROOT / path).is_file() or "__pycache__" in path]


def test_a_ranking_that_is_left_keeps_the_code_that_computed_it(computed, house):
    store = house / "computed.json"
    first = outcomes.read(store)["page.md"]["code"]
    assert computed.ranked_by("page.md", store) == first
    computed.keep({"page.md": {"code": "0" * 16, "tables": "", "loaded": {}, "causes": first}}, store)
    assert computed.ranked_by("page.md", store) == first


def test_a_package_that_is_gone_asks_for_a_new_computation(computed, house):
    shutil.rmtree(house / "src/stillhook/physics")
    assert not stands(computed, house)


@pytest.mark.long
def test_what_a_computation_loads_is_found(computed):
    import stillhook.physics.load_path.drum
    import stillhook.units  # noqa: F401

    places = computed.loaded()
    assert {"src/stillhook/physics/load_path/drum.py", "src/stillhook/units.py"} <= set(places)
    assert computed.code(places) != ""


@pytest.mark.slow
@pytest.mark.parametrize("name", MAKE.scripts())
def test_the_script_of_every_page_finds_what_it_imports(name):
    """Pages are computed rarely; a name that the package no longer has is found here."""
    assert callable(MAKE.module_of(name).compute)
