"""Which code the tables of the slow pages were computed by. While that code and the tables are the same, nothing is
computed again.

Kept for each page: the files that its computation imported or read, below the root; a hash of what they say (with the
pinned libraries), and a hash of its tables. What decides is the content: comments, docstrings, empty lines and line
ends of Python files are left out, and files that git does not know are no part of it, so that a fresh clone has the
hash of the place that computed. Prose around the tables is free to change.
"""

from __future__ import annotations

import ast
import hashlib
import io
import subprocess
import sys
import time
import tokenize
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from re import DOTALL
from re import compile as pattern

from trials import store as outcomes

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
STORE = HERE / "computed.json"
LOCK = "requirements.lock"
BLOCK = pattern(r"<!-- [\w-]+ -->\n.*?<!-- end -->", DOTALL)
DIGITS = 16
BOOKKEEPING = ("make.py", "computed.py", "store.py")
"""Scripts that no number comes from; nor does one from a stub."""
PLACES = ("src/stillhook", "docs/validation", "trials")
_opened: set[str] = set()
_since: list[float] = []


def watch() -> None:
    """Note from now on which files this process opens, and when that began; those that it imports are known."""
    _since.append(time.time())
    sys.addaudithook(lambda event, of: _opened.add(str(of[0])) if event == "open" else None)


def loaded(root: Path = ROOT) -> list[str]:
    """What this process has imported or read so far, as paths below the root, of the files that git knows."""
    modules = {str(file) for module in list(sys.modules.values()) if (file := getattr(module, "__file__", None))}
    files = {Path(file).resolve() for file in modules | {f for f in _opened if f.startswith(str(root))}}
    return sorted(
        path
        for path in (f.relative_to(root).as_posix() for f in files if f.is_relative_to(root))
        if _counts(path, root)
    )


def _counts(path: str, root: Path) -> bool:
    ours = path.startswith(tuple(f"{place}/" for place in PLACES)) and path in _tracked(root)
    return ours and not path.endswith((".pyi", ".md", ".png", STORE.name)) and Path(path).name not in BOOKKEEPING


@cache
def _tracked(root: Path) -> frozenset[str]:
    """Files that a fresh clone will have: those that git knows, or would add."""
    asked = ["git", "-C", str(root), "ls-files", "--cached", "--others", "--exclude-standard", *PLACES]
    return frozenset(subprocess.run(asked, capture_output=True, text=True, check=True).stdout.splitlines())


def says(path: Path) -> bytes:
    """What a file says: of Python without comments, docstrings and empty lines; of others without carriage returns."""
    found = path.stat()
    return _says(path, found.st_mtime_ns, found.st_size)


@cache
def _says(path: Path, *_: int) -> bytes:
    content = path.read_bytes().replace(b"\r\n", b"\n")
    if path.suffix != ".py":
        return content
    lines = content.decode().split("\n")
    tree = ast.parse(content)
    for node in ast.walk(tree):
        match node:
            case ast.Expr(ast.Constant(str())) if not lines[node.lineno - 1][: node.col_offset].strip():
                last = node.end_lineno or node.lineno
                lines[node.lineno - 1 : last] = [""] * (last - node.lineno + 1)
    for token in tokenize.generate_tokens(io.StringIO(content.decode()).readline):
        if token.type == tokenize.COMMENT and lines[token.start[0] - 1]:
            lines[token.start[0] - 1] = lines[token.start[0] - 1][: token.start[1]]
    return "\n".join(line.rstrip() for line in lines if line.strip()).encode()


def code(places: Iterable[str], root: Path = ROOT) -> str:
    """Hash of what these files and the pinned libraries say; empty where one is gone."""
    digest = hashlib.sha256()
    for place in (*sorted(places), LOCK):
        if not (root / place).is_file():
            return ""
        digest.update(place.encode() + b"\0" + says(root / place))
    return digest.hexdigest()[:DIGITS]


def packed(paths: Iterable[str]) -> dict[str, str]:
    """Files by folder, their names in a line."""
    folders: dict[str, list[str]] = {}
    for path in sorted(paths):
        folder, _, name = path.rpartition("/")
        folders.setdefault(folder, []).append(name)
    return {folder: " ".join(names) for folder, names in folders.items()}


def unpacked(folders: Mapping[str, str]) -> Iterator[str]:
    for folder, names in folders.items():
        yield from (f"{folder}/{name}" for name in names.split())


def tables(text: str) -> str:
    """Hash of a page's computed parts."""
    return hashlib.sha256("\n".join(BLOCK.findall(text)).encode()).hexdigest()[:DIGITS]


def stands(page: Path, root: Path = ROOT, store: Path = STORE) -> bool:
    """Whether the tables of the page are those kept, by code that has not changed since."""
    kept = outcomes.read(store).get(page.name)
    return (
        kept is not None
        and kept["code"] == code(unpacked(kept["loaded"]), root)
        and kept["tables"] == tables(page.read_text(encoding="utf-8"))
    )


def ranked_by(name: str, store: Path = STORE) -> str:
    """Hash of the code that computed the rankings of causes that a page shows."""
    kept = outcomes.read(store).get(name, {})
    return str(kept.get("causes", kept.get("code", "")))


def record(text: str, causes: str = "") -> dict[str, object] | None:
    """What to keep of a page that this process, and it alone, has just computed; nothing where a file was changed
    meanwhile, since nobody knows which of both it rests on. causes: the code of an older computation that its ranking
    of causes is left from."""
    places = loaded()
    if any((ROOT / place).stat().st_mtime > _since[0] for place in places):
        return None
    return {
        "code": code(places),
        "tables": tables(text),
        "loaded": packed(places),
        **({"causes": causes} if causes else {}),
    }


def keep(records: dict[str, dict[str, object]], store: Path = STORE) -> None:
    """Write records of pages beside those that are there."""
    now = {**outcomes.read(store), **records}
    outcomes.write(store, sorted(now), now)
