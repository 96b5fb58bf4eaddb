"""Where a source can be mutated, and a random sample of it: numbers and comparisons, none of texts, annotations,
decorators and `__repr__`."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

COMPARISONS: dict[type[ast.cmpop], tuple[str, tuple[str, ...]]] = {
    ast.Lt: ("<", ("<=", ">=")),
    ast.LtE: ("<=", ("<", ">")),
    ast.Gt: (">", (">=", "<=")),
    ast.GtE: (">=", (">", "<")),
    ast.Eq: ("==", ("!=",)),
    ast.NotEq: ("!=", ("==",)),
    ast.Is: ("is", ("is not",)),
    ast.IsNot: ("is not", ("is",)),
    ast.In: ("in", ("not in",)),
    ast.NotIn: ("not in", ("in",)),
}
"""Of each comparison how it is written, and what replaces it: the case of equality moved, or the contrary."""
ROUNDING = 1e-6
"""A number of this size or less guards against rounding: twice as much would change no result, so it becomes 1."""


class Site(NamedTuple):
    """A place in a source: bytes begin to end, the line, what is written there, what may replace it."""

    begin: int
    end: int
    line: int
    before: str
    after: tuple[str, ...]


class Mutant(NamedTuple):
    """One change of one file (path below the root, as text)."""

    file: str
    begin: int
    end: int
    line: int
    before: str
    after: str

    @property
    def change(self) -> str:
        """In a few characters."""
        return f"{self.before} -> {self.after}"

    def apply(self, source: bytes) -> bytes:
        """The source with the change."""
        assert source[self.begin : self.end] == self.before.encode()
        return source[: self.begin] + self.after.encode() + source[self.end :]


def sites(source: bytes) -> list[Site]:
    """All places of a source, in their order."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for node in _nodes(ast.parse(source)):
        if isinstance(node, ast.Constant):
            begin, end = starts[node.lineno - 1] + node.col_offset, starts[node.lineno - 1] + (node.end_col_offset or 0)
            found.append(Site(begin, end, node.lineno, source[begin:end].decode(), numbers(node.value)))
        elif isinstance(node, ast.Compare):
            found += _comparisons(node, source, starts)
    return sorted(found)


def numbers(value: int | float) -> tuple[str, ...]:
    """What replaces a number: an integer by its neighbours, another number by twice and half of it."""
    if isinstance(value, int):
        return (str(value + 1), str(value - 1)) if value else ("1",)
    return ("1.0",) if abs(value) <= ROUNDING else (repr(2.0 * value), repr(0.5 * value))


def _comparisons(node: ast.Compare, source: bytes, starts: list[int]) -> Iterator[Site]:
    left: ast.expr = node.left
    for operator, right in zip(node.ops, node.comparators, strict=True):
        text, after = COMPARISONS[type(operator)]
        begin = starts[(left.end_lineno or 1) - 1] + (left.end_col_offset or 0)
        end = starts[right.lineno - 1] + right.col_offset
        place = source.find(text.encode(), begin, end)
        if place >= 0:
            yield Site(place, place + len(text), source.count(b"\n", 0, place) + 1, text, after)
        left = right


def _nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Numbers and comparisons below a node, what is left out left out."""
    if isinstance(node, ast.JoinedStr) or (isinstance(node, ast.FunctionDef) and node.name == "__repr__"):
        return
    if isinstance(node, ast.If) and ast.unparse(node.test) in ("__name__ == '__main__'", "TYPE_CHECKING"):
        return
    if isinstance(node, ast.Compare) or (
        isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)
    ):
        yield node
    for name, value in ast.iter_fields(node):
        if name not in ("annotation", "returns", "decorator_list"):
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from _nodes(child)


def sources(root: Path) -> list[str]:
    """Files that are mutated, below the root of the repository."""
    return sorted(path.relative_to(root).as_posix() for path in (root / "src" / "stillhook").rglob("*.py"))


def draw(root: Path, seed: int, number: int) -> list[Mutant]:
    """Different mutants: a file by its lines, a place of it, a change of that, all by one seed."""
    chance = random.Random(seed)
    files = sources(root)
    texts = {file: (root / file).read_bytes() for file in files}
    weights = [text.count(b"\n") for text in texts.values()]
    places: dict[str, list[Site]] = {}
    drawn: dict[tuple[str, int], Mutant] = {}
    while len(drawn) < number:
        file = chance.choices(files, weights)[0]
        of_file = places[file] if file in places else places.setdefault(file, sites(texts[file]))
        if not of_file:
            continue
        site = chance.choice(of_file)
        mutant = Mutant(file, site.begin, site.end, site.line, site.before, chance.choice(site.after))
        drawn.setdefault((file, site.begin), mutant)
    return list(drawn.values())


def every(root: Path, file: str, lines: range) -> list[Mutant]:
    """All mutants of some lines of a file."""
    found = [site for site in sites((root / file).read_bytes()) if site.line in lines]
    return [Mutant(file, s.begin, s.end, s.line, s.before, after) for s in found for after in s.after]
