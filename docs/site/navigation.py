"""Navigation of the site: the links of an index page, in their order and under their headings, are its menu."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterable

from sphinx.application import Sphinx

FENCE = re.compile(r"^(```|~~~).*?^\1[^\n]*$", re.MULTILINE | re.DOTALL)
HEADING_OR_LINK = re.compile(
    r"^##\s+(?P<heading>.+?)\s*$|\[(?P<text>[^\]]*)\]\((?P<page>[^)#:\s]+\.md)[)#]", re.MULTILINE
)
ABOVE = re.compile(r"\]\((?:\.\./)+(CHANGELOG|CONTRIBUTING|README)\.md")
"""Links to files above the documentation, and the pages of the site that hold them."""
PAGES = {"CHANGELOG": "/changes.md", "CONTRIBUTING": "/contributing.md", "README": "/index.md"}


def contents(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append the hidden tables of contents that an index page's own links describe, one for each of its headings."""
    source[0] = ABOVE.sub(lambda found: f"]({PAGES[found[1]]}", source[0])
    folder, _, name = docname.rpartition("/")
    if name == "index":
        menus = sections(source[0], folder, sorted(app.env.found_docs))
        source[0] += "".join(toctree(caption, entries) for caption, entries in menus.items())


def sections(text: str, folder: str, known: Iterable[str]) -> dict[str, list[str]]:
    """Entries of the menu by heading of an index page; pages of its folder that it does not name come last."""
    entries: dict[str, list[str]] = {"": []}
    heading, seen = "", {f"{folder}/index" if folder else "index"}
    for found in HEADING_OR_LINK.finditer(FENCE.sub("", text)):
        if found["heading"]:
            heading = found["heading"]
            continue
        page = posixpath.normpath(posixpath.join(folder, found["page"])).removesuffix(".md")
        if below(page, folder) and page not in seen:
            seen.add(page)
            title = found["text"]
            entry = f"/{page}" if folder else f"{title[:1].upper()}{title[1:]} </{page}>"
            entries.setdefault(heading, []).append(entry)
    entries.setdefault(heading, []).extend(f"/{page}" for page in known if page not in seen and below(page, folder))
    return entries


def below(page: str, folder: str) -> bool:
    """Whether a page is of this folder, or the index of a folder in it."""
    above, _, name = page.rpartition("/")
    return above == folder or (name == "index" and above.rpartition("/")[0] == folder)


def toctree(caption: str, entries: list[str]) -> str:
    """One table of contents that only the menu shows."""
    lines = "\n".join([":hidden:", *([f":caption: {caption}"] if caption else []), "", *entries])
    return f"\n\n```{{toctree}}\n{lines}\n```\n" if entries else ""


def setup(app: Sphinx) -> dict[str, bool]:
    """Entry point of the extension."""
    app.connect("source-read", contents)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
