"""The repository keeps its own promises: lock, version, size of files, documentation, what the wheel carries."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from graphlib import TopologicalSorter
from pathlib import Path
from types import ModuleType

import grimp
import pytest
from tests.scripts import DOCS, script

import stillhook
from stillhook.base.extras import EXTRAS

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "stillhook"

LONGEST_FILE = 500  # lines; beyond, a module is doing two things
MOST_ENTRIES = 12  # of a folder; the package itself has one for each concern
LONGEST_DECISION = 60  # lines; about a page

PYTHON_FILES = sorted(SOURCE.rglob("*.py"))
DECISIONS = sorted((DOCS / "decisions").glob("[0-9]*.md"))
PAGES_WITH_CODE = sorted(
    p for p in [*DOCS.rglob("*.md"), *ROOT.glob("*.md")] if "```python" in p.read_text(encoding="utf-8")
)


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def tracked_files() -> list[Path]:
    """Files under version control."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: nothing says which files belong to the repository")
    listed = subprocess.run([git, "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    return [ROOT / name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def project() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


LOCKS = ("requirements.lock", "tests/requirements.lock", "docs/requirements.lock")
"""What runs Stillhook and its tests; what checks, benchmarks and a few tests, and what the site, take on top."""


def locked(lock: str = LOCKS[0]) -> dict[str, str]:
    """Each locked package (name as in the index) with everything that a lock says about it."""
    text = (ROOT / lock).read_text(encoding="utf-8")
    entries: dict[str, str] = {}
    for entry in re.split(r"^(?=[a-z0-9])", text, flags=re.MULTILINE)[1:]:
        name = re.match(r"[a-z0-9._-]+", entry)
        assert name is not None
        entries[name[0]] = entries.get(name[0], "") + entry
    return entries


def generator() -> ModuleType:
    """docs/generate.py as a module."""
    return script(DOCS / "generate.py")


# The lock


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_pins_every_package_with_a_hash(lock: str):
    assert locked(lock)
    for name, entry in locked(lock).items():
        assert re.match(r"[a-z0-9._-]+==\S", entry), f"{name} is not pinned to one version"
        assert re.search(r"--hash=sha256:[0-9a-f]{64}", entry), f"{name} has no hash"


def test_lock_holds_every_declared_dependency():
    groups = [project()["dependencies"], *project()["optional-dependencies"].values()]
    names = {re.split(r"[\[<>=!~; ]", d)[0].lower().replace("_", "-") for group in groups for d in group}
    assert names - {"stillhook"} - locked().keys() - locked(LOCKS[1]).keys() == set()


@pytest.mark.parametrize(("lock", "group"), [(LOCKS[1], "development"), (LOCKS[2], "docs")])
def test_lock_of_a_group_holds_what_it_declares_at_the_versions_of_the_first_lock(lock: str, group: str):
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["dependency-groups"][group]
    more, package = locked(lock), locked()
    assert {re.split(r"[<>=]", item)[0] for item in declared} - more.keys() == set()
    versions = {name: set(re.findall(r"^[a-z0-9._-]+==(\S+)", package[name], re.M)) for name in more.keys() & package}
    assert versions
    for name, allowed in versions.items():
        assert set(re.findall(r"^[a-z0-9._-]+==(\S+)", more[name], re.M)) <= allowed, name


def test_extra_all_consists_of_extras_that_exist():
    extras = project()["optional-dependencies"]
    (own,) = extras["all"]
    parts = re.fullmatch(r"stillhook\[(.*)\]", own)[1].split(",")
    assert set(parts) < set(extras) - {"all", "dev"}
    assert {"report", "stability", "logs"} <= set(parts)


def test_every_library_that_may_be_missing_is_in_its_extra():
    """The hint `pip install "stillhook[...]"` brings what it promises."""
    extras = project()["optional-dependencies"]
    for library, extra in EXTRAS.items():
        assert any(re.split(r"[<>=]", item)[0].lower() == library for item in extras[extra]), library


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_names_no_address_and_no_folder(lock: str):
    text = (ROOT / lock).read_text(encoding="utf-8")
    for forbidden in ("://", "file:", "--index", "--extra-index", "--find-links", "--trusted-host", " @ "):
        assert forbidden not in text, f'{lock} contains "{forbidden}"'


def test_there_is_no_lock_of_another_kind():
    names = {path.name for path in tracked_files()}
    assert names.isdisjoint({"uv.lock", "pylock.toml", "poetry.lock", "Pipfile.lock"})


# The version


def test_version_is_the_changelogs_top_entry():
    entries = re.findall(r"^## v?(\d\S*)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert entries[0] == stillhook.__version__


def test_citation_gives_this_version():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {stillhook.__version__}\n" in citation


# The source


@pytest.mark.slow
def test_no_source_file_outgrows_its_subject():
    lines = {relative(path): len(path.read_text(encoding="utf-8").splitlines()) for path in PYTHON_FILES}
    assert {name: n for name, n in lines.items() if n > LONGEST_FILE} == {}


def test_no_folder_is_a_heap():
    folders = [SOURCE, *(path for path in SOURCE.rglob("*") if path.is_dir() and path.name != "__pycache__")]
    entries = {
        folder: [p.name for p in folder.iterdir() if p.stem not in ("__pycache__", "__init__")] for folder in folders
    }
    crowded = {relative(f): len(names) for f, names in entries.items() if len(names) > MOST_ENTRIES and f != SOURCE}
    assert crowded == {}


@pytest.mark.slow
def test_no_imports_run_in_a_circle():
    """Those inside functions and for type checkers count as well."""
    graph = grimp.build_graph("stillhook", cache_dir=None)
    TopologicalSorter({m: graph.find_modules_directly_imported_by(m) for m in graph.modules}).prepare()


def test_rooms_that_hashes_cover_exist():
    """A hash over a folder that is gone would cover nothing, and say nothing."""
    from stillhook.kernels import build
    from stillhook.validate.certificate import content

    folders = (*build.KERNEL_FOLDERS, *build.RESULT_FOLDERS, *content.METHOD_FOLDERS)
    assert [f for f in folders if not any((SOURCE / f).rglob("*.py"))] == []


def test_no_module_is_a_drawer_for_odds_and_ends():
    drawers = {"utils", "util", "helpers", "helper", "misc", "common", "tools"}
    assert [relative(p) for p in PYTHON_FILES if drawers & set(p.relative_to(SOURCE).with_suffix("").parts)] == []


@pytest.mark.thorough
def test_no_file_names_a_folder_of_one_machine():
    """Absolute paths of somebody's machine in a committed file are wrong for everybody else."""
    folders = "|".join(("tmp", "work", "opt", "home", "root", "Users", "mnt"))
    pattern = re.compile(rf"(?<![\w.)\]}}*/-])/(?:{folders})/\w|file://|[A-Z]:\\\\Users")
    found = []
    for path in tracked_files():
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        if path.name not in (Path(__file__).name, "test_platforms.py"):  # these look for such paths
            found += [f"{relative(path)}: {hit}" for hit in pattern.findall(text)]
    assert found == []


# The documentation


def test_every_relative_link_leads_somewhere():
    docs = generator()
    assert list(docs.broken_links(docs.documents())) == []


def test_the_site_shows_every_line_of_a_page():
    """A line that begins with a percent sign is a comment of the site, and a dollar no equation."""
    docs = generator()
    pages = {page: docs.FENCE.sub("", page.read_text(encoding="utf-8")) for page in docs.documents()}
    assert [relative(page) for page, text in pages.items() if re.search(r"^ *%", text, re.MULTILINE)] == []
    assert [relative(page) for page, text in pages.items() if re.search(r"\$[\\\w]+[_^{]", text)] == []


def test_link_check_sees_a_broken_link(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text("# Head\n[good](page.md#head) [code] `[no](link.md)`\n[bad](gone.md) [worse](page.md#tail)\n")
    found = [re.search(r"\((.*)\)", line)[1] for line in generator().broken_links([page])]
    assert found == ["gone.md", "page.md#tail"]


def test_generated_pages_are_up_to_date():
    assert list(generator().outdated()) == []


def test_every_page_can_be_reached_from_the_index():
    docs = generator()
    seen: set[Path] = set()
    ahead = [DOCS / "index.md"]
    while ahead:
        page = ahead.pop()
        if page in seen:
            continue
        seen.add(page)
        links = (link.partition("#")[0] for link in docs.LINK.findall(docs.prose(page)))
        ahead += [t for link in links if link and (t := (page.parent / link).resolve()).suffix == ".md" and t.is_file()]
    lost = set(DOCS.rglob("*.md")) - seen
    assert sorted(map(relative, lost)) == []


@pytest.mark.parametrize("path", DECISIONS, ids=relative)
def test_decision_is_short_and_says_what_was_chosen(path: Path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST_DECISION
    for part in ("Status:", "## Context", "## Decision", "## Consequences"):
        assert part in text, f"{relative(path)} lacks {part}"


@pytest.mark.thorough
@pytest.mark.parametrize("path", PAGES_WITH_CODE, ids=relative)
def test_python_in_the_documentation_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "documentation"}
    for block in re.findall(r"^```python\n(.*?)^```", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL):
        code = compile(block, relative(path), "exec")
        if not block.startswith("# needs "):  # what a test does not have
            exec(code, names)


# The wheel


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> set[str]:
    """Names of the files in a wheel built from this tree, without compiled kernels."""
    pytest.importorskip("hatchling", reason="hatchling is not installed: no wheel to look into")
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    environment = os.environ | {"STILLHOOK_WHEEL": "pure"}
    built = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as archive:
        return set(archive.namelist())


@pytest.mark.long
def test_wheel_carries_every_file_of_the_package(wheel: set[str]):
    files = {p.relative_to(SOURCE.parent).as_posix() for p in tracked_files() if p.is_relative_to(SOURCE)}
    assert len(files) > 800
    assert files - wheel == set()


@pytest.mark.slow
def test_wheel_carries_the_licence_and_nothing_but_the_package(wheel: set[str]):
    tops = {name.split("/")[0] for name in wheel}
    assert tops == {"stillhook", f"stillhook-{stillhook.__version__}.dist-info"}
    assert any(name.endswith("licenses/LICENSE") for name in wheel)
