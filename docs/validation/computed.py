"""Which code the tables of the slow pages were computed by. While that code and the tables are the same, nothing is
computed again.

Kept for each page: the packages and scripts that its computation loaded, with the claims of these scripts; a hash of
all their files (with the pinned libraries), and a hash of its tables. Prose around the tables is free to change.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from trials import store as outcomes

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
STORE = HERE / "computed.json"
LOCK = "requirements.lock"
BLOCK = re.compile(r"<!-- [\w-]+ -->\n.*?<!-- end -->", re.DOTALL)
DIGITS = 16
BOOKKEEPING = ("make.py", "computed.py", "store.py")
"""Scripts that no number comes from."""


def loaded() -> list[str]:
    """What this process has imported so far, as paths below the root: folders of the package, its own modules, scripts
    beside the pages and their claims."""
    files = [
        Path(file).resolve() for module in list(sys.modules.values()) if (file := getattr(module, "__file__", None))
    ]
    places = {place for file in files if file.is_relative_to(ROOT) and (place := _place(file.relative_to(ROOT)))}
    claims = {f"docs/validation/claims/{Path(place).stem}.toml" for place in places if place.startswith("docs/")}
    return sorted(places | {file for file in claims if (ROOT / file).is_file()})


def _place(path: Path) -> str:
    """`src/stillhook/<folder>` for all modules in and below it, the file itself for others, nothing for what no number
    comes from."""
    if path.parts[:2] == ("src", "stillhook"):
        return Path(*path.parts[:3]).as_posix()
    ours = path.parts[:2] == ("docs", "validation") or path.parts[0] == "trials"
    return path.as_posix() if ours and path.name not in BOOKKEEPING else ""


def code(places: Iterable[str], root: Path = ROOT) -> str:
    """Hash of every file in these places and of the pinned libraries; empty where a place is gone."""
    digest = hashlib.sha256()
    for place in (*sorted(places), LOCK):
        if not (root / place).exists():
            return ""
        for path in _files(root / place):
            digest.update(
                path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n")
            )
    return digest.hexdigest()[:DIGITS]


def _files(place: Path) -> Iterator[Path]:
    if place.is_file():
        yield place
    else:
        yield from sorted(p for p in place.rglob("*") if p.is_file() and "__pycache__" not in p.parts)


def tables(text: str) -> str:
    """Hash of a page's computed parts."""
    return hashlib.sha256("\n".join(BLOCK.findall(text)).encode()).hexdigest()[:DIGITS]


def stands(page: Path, root: Path = ROOT, store: Path = STORE) -> bool:
    """Whether the tables of the page are those kept, by code that has not changed since."""
    kept = outcomes.read(store).get(page.name)
    return (
        kept is not None
        and kept["code"] == code(kept["loaded"], root)
        and kept["tables"] == tables(page.read_text(encoding="utf-8"))
    )


def record(text: str) -> dict[str, object]:
    """What to keep of a page that this process, and it alone, has just computed."""
    places = loaded()
    return {"code": code(places), "tables": tables(text), "loaded": places}


def keep(records: dict[str, dict[str, object]], store: Path = STORE) -> None:
    """Write records of pages beside those that are there."""
    now = {**outcomes.read(store), **records}
    outcomes.write(store, sorted(now), now)
