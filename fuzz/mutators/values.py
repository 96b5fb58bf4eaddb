"""Changes of the values of a tree of tables and lists, as TOML and JSON have them."""

from __future__ import annotations

import copy
import datetime
import json
import math
import random
import tomllib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from fuzz.mutators import odd
from fuzz.mutators.tokens import by_tokens, encoded

Path = tuple[Any, ...]
DEPTHS = (1, 2, 10, 60, 120)


def paths(node: Any, path: Path = ()) -> Iterator[Path]:
    """The place of every value in a tree, the root without."""
    pairs = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in pairs:
        yield (*path, key)
        yield from paths(value, (*path, key))


def at(tree: Any, path: Path) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def changed(r: random.Random, tree: Any, others: Callable[[], Any]) -> Any:
    """The tree with one value changed. others: gives another tree."""
    tree = copy.deepcopy(tree)
    places = list(paths(tree))
    if not places:
        return odd.value(r)
    path = r.choice(places)
    parent, key = at(tree, path[:-1]), path[-1]
    old, pick = parent[key], r.randrange(12)
    if pick < 3:
        parent[key] = odd.value(r)
    elif pick < 5 and isinstance(old, str):
        parent[key] = by_tokens(r, encoded(old), ()).decode("utf-8", "replace")
    elif pick < 5 and isinstance(old, int | float):
        parent[key] = r.choice((-old, old * 10, old / 7 if abs(old) < 1e300 else 0, old + 1, str(old), [old], 0, 1e308))
    elif pick < 6:
        parent[key] = copy.deepcopy(at(tree, r.choice(places)))
    elif pick < 7:
        del parent[key]
    elif pick < 8 and isinstance(parent, dict):
        parent[r.choice((*odd.ODD, *map(str, (p[-1] for p in places[:50]))))] = parent.pop(key)
    elif pick < 9 and (other_paths := list(paths(other := others()))):
        taken = r.choice(other_paths)
        if isinstance(parent, dict):
            parent[str(taken[-1])] = at(other, taken)
        else:
            parent[key] = at(other, taken)
    elif pick < 10 and isinstance(old, list):
        parent[key] = r.choice(
            (old * r.choice((0, 2, 30)), old[::-1], old[:1], [*old, odd.value(r)], r.sample(old, len(old)))
        )
    elif pick < 11:
        for _ in range(r.choice(DEPTHS)):
            old = [old] if r.random() < 0.5 else {"x": old}
        parent[key] = old
    elif isinstance(parent, dict):
        parent[r.choice((*odd.ODD, "value", "kind", "source", "unit", "name"))] = odd.value(r)
    else:
        parent.append(odd.value(r))
    return tree


def by_toml(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One changed value of a TOML file. Errors: ValueError where it is none."""
    tree = changed(r, toml(data), lambda: toml(r.choice(others or [data])))
    return encoded(toml_text(tree if isinstance(tree, dict) else {"x": tree}))


def toml(data: bytes) -> dict[str, Any]:
    return tomllib.loads(data.decode("utf-8-sig"))


def toml_text(tree: dict[str, Any]) -> str:
    """A tree as TOML: its tables one level deep, and inline below."""
    head = [f"{_key(k)} = {_toml(v)}" for k, v in tree.items() if not isinstance(v, dict)]
    for name, table in tree.items():
        if isinstance(table, dict):
            head += [f"[{_key(name)}]", *(f"{_key(k)} = {_toml(v)}" for k, v in table.items())]
    return "\n".join(head) + "\n"


def _key(key: Any) -> str:
    key = str(key)
    return key if key.isascii() and key.replace("_", "").replace("-", "").isalnum() else _string(key)


def _string(text: str) -> str:
    """A basic string, whose escapes are those of JSON but for half a surrogate pair."""
    return json.dumps(text.encode("utf-8", "replace").decode(), ensure_ascii=False).replace("\x7f", "\\u007f")


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(k)} = {_toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else {"nan": "nan", "inf": "inf", "-inf": "-inf"}[repr(value)]
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    return str(value) if isinstance(value, int) else _string(str(value))


def by_json(r: random.Random, data: bytes, others: Sequence[bytes]) -> bytes:
    """One changed value of a JSON file, or a key twice. Errors: ValueError where it is none."""
    tree = changed(r, json.loads(data), lambda: json.loads(r.choice(others or [data])))
    made = json.dumps(tree, ensure_ascii=r.random() < 0.5)
    if r.random() < 0.05 and isinstance(tree, dict) and tree:
        key = r.choice(list(tree))
        made = made[:-1] + f", {json.dumps(key)}: {json.dumps(odd.value(r))}}}"
    return made.encode("utf-8", "replace")
