"""Texts that a person reads are in the terms of the field: messages, reports, tables and pages hold no phrase of
`language.toml`."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import stillhook
from stillhook.plan.definition.rules import Alternative
from stillhook.spec.lift.phase import PhaseKind, WinchMode
from stillhook.variables import VARIABLES

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "stillhook"
PHRASES = tomllib.loads(Path(__file__).with_name("language.toml").read_text(encoding="utf-8"))["phrase"]
PAGES = sorted([*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md"])
TABLES = sorted(p for s in ("toml", "csv", "typ") for f in (SOURCE, ROOT / "docs") for p in f.rglob(f"*.{s}"))
CODE = sorted([*SOURCE.rglob("*.py"), *(ROOT / "docs" / "validation").glob("*.py")])
FENCE = re.compile(r"^ {0,3}(```|~~~).*?^ {0,3}\1[^\n]*$", re.MULTILINE | re.DOTALL)
COMPUTED = re.compile(r"<!-- [\w-]+ -->\n.*?<!-- end -->", re.DOTALL)
MOST_WORDS = 900
"""Most words of a page besides its tables, code and what a script computes: what is read before a task is done."""
FOLDERS = ("how-to", "explanation", "validation")
LONGER = {"run-beside-a-plc.md"}
NAMES = re.compile(r"`[^`\n]*`|\]\([^)\n]*\)|\{[^{}\n]*\}|[\w.-]+\.(?:md|toml|py|csv)\b|[\w-]*_[\w-]*")
"""What is a name in a text: inline code, the target of a link, a field that is filled in, a file, a variable."""


def plain(text: str) -> str:
    """A text without its names, of the same lines."""
    return NAMES.sub("...", text)


def literals(path: Path) -> Iterator[tuple[int, str]]:
    """String literals of a module with their lines, fields of f-strings left out. Docstrings are read of commands
    alone, whose help they are."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped: set[int] = set()
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and not path.is_relative_to(SOURCE / "cli")
        ):
            skipped.add(id(node.value))
        if isinstance(node, ast.JoinedStr):
            skipped.update(id(part) for part in node.values)
            parts = (part.value if isinstance(part, ast.Constant) else "..." for part in node.values)
            yield node.lineno, "".join(str(part) for part in parts)
    for node in ast.walk(tree):
        value = node.value if isinstance(node, ast.Constant) and id(node) not in skipped else None
        if isinstance(value, str) and not value.isidentifier():
            yield node.lineno, value


def texts(path: Path) -> Iterator[tuple[int, str]]:
    if path.suffix == ".py":
        yield from literals(path)
    else:
        yield 1, path.read_text(encoding="utf-8")


def hits(text: str, line: int = 1) -> Iterator[str]:
    """Each forbidden phrase of a text, with its line and what is written in its place."""
    words = plain(text)
    for phrase in PHRASES:
        for hit in re.finditer(phrase["pattern"], words, re.IGNORECASE):
            around = " ".join(words[max(0, hit.start() - 40) : hit.end() + 40].split())
            place = line + words.count("\n", 0, hit.start())
            yield f'{place}: "{hit[0]}" in "{around}": write {phrase["instead"]}'


def found(path: Path) -> Iterator[str]:
    for line, text in texts(path):
        for hit in hits(text, line):
            yield f"{path.relative_to(ROOT).as_posix()}:{hit}"


@pytest.mark.long
@pytest.mark.parametrize("files", [CODE, TABLES, PAGES], ids=["messages", "tables", "pages"])
def test_no_text_holds_a_phrase_of_the_house_alone(files: list[Path]):
    assert [hit for path in files for hit in found(path)] == []


def test_no_public_docstring_holds_such_a_phrase():
    """The reference of functions and classes is read as the pages are."""
    faces = [stillhook, *(x for n in dir(stillhook) if isinstance(x := getattr(stillhook, n), ModuleType))]
    public = {n: getattr(face, n) for face in faces for n in getattr(face, "__all__", []) if not n.startswith("_")}
    members = {
        f"{n}.{m}": x for n, c in public.items() if isinstance(c, type) for m, x in vars(c).items() if m[0] != "_"
    }
    shown = {n: x.__doc__ for n, x in (public | members).items() if callable(x) or isinstance(x, property)}
    assert [f"{n}: {hit}" for n, text in shown.items() for hit in hits(text or "")] == []


@pytest.mark.parametrize("phrase", PHRASES, ids=lambda phrase: phrase["example"])
def test_every_phrase_of_the_list_finds_its_example(phrase: dict[str, str]):
    assert re.search(phrase["pattern"], phrase["example"], re.IGNORECASE)


def test_names_in_a_text_are_not_taken_for_words():
    assert "beside" not in plain("see `beside = 1`, [page](run-beside-a-plc.md), {beside} and told_apart in told.toml")
    assert "lies" in plain("the error `e_c` lies below")


def test_every_name_in_the_glossary_exists():
    """Results, options, choices and tables of files: what the last column names can be typed."""
    page = (ROOT / "docs" / "reference" / "glossary.md").read_text(encoding="utf-8")
    rows = [line.split("|") for line in page.splitlines() if line.startswith("| ")]
    names = {name for row in rows for name in re.findall(r"`([^`]+)`", row[-2])}
    options = tomllib.loads(Path(__file__).with_name("options.toml").read_text(encoding="utf-8"))
    crane = SOURCE.joinpath("library", "data", "cranes", "nov-250t.toml").read_text(encoding="utf-8")
    known = {v.name for v in VARIABLES} | {f"--{option}" for option in options}
    known |= {*PhaseKind, *Alternative, *WinchMode, "[sensors]"} | set(re.findall(r"^\[[\w.]+\]|^SWL", crane, re.M))
    assert sorted(names - known) == []


@pytest.mark.parametrize(
    "page",
    sorted(page for folder in FOLDERS for page in (ROOT / "docs" / folder).glob("*.md")),
    ids=lambda page: f"{page.parent.name}/{page.stem}",
)
def test_a_page_is_one_subject(page: Path):
    lines = FENCE.sub("", COMPUTED.sub("", page.read_text(encoding="utf-8"))).splitlines()
    words = re.sub(r"\]\([^)]*\)", "]", "\n".join(line for line in lines if not line.lstrip().startswith("|"))).split()
    assert len(words) <= MOST_WORDS or page.name in LONGER
