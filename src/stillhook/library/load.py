"""A crane by its name in the library, or from a file of your own that may build on one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from stillhook.crane import Crane, Plant, Source, SourceKind
from stillhook.errors import SpecError
from stillhook.library.explain import explain
from stillhook.library.files import Leaf, Tree, file_tree, lay_over, library_tree, nearest, shelf, sources, tree, values
from stillhook.library.tables import without_title
from stillhook.units import came


def cranes() -> tuple[str, ...]:
    """Names of the library's cranes."""
    return shelf("cranes")


def load_crane(name_or_path: str | Path, *, changes: Mapping[str, Any] | None = None) -> Crane:
    """A crane of the library by name, or one described in a TOML file.

    A file may start with ``base = "nov-250t"`` (or the path of another file, seen from its own folder) and then gives
    only what differs. Motors and system friction are filled in from the library by their names; what the file says on
    top wins.

    Parameters: name_or_path a name of ``cranes()`` or a path; changes nested fields laid over the file, as in a file of
    one's own: ``{"active": {"line": {"V": "100 L"}}}``.
    Errors: SpecError, UnitError of one line that names file, field, what came and what is allowed.
    """
    label, fields = _fields(name_or_path, ())
    if changes is not None:
        own = tree(changes, "changes", user=True)
        fields = lay_over(_without_stale_circuit(fields, own), own, "changes")
        label = f"{label} with changes"
    fields = _with_library(fields, label)
    try:
        return Crane.model_validate(values(fields) | {"sources": dict(sources(fields))})
    except ValidationError as error:
        raise explain(error, Crane, label) from None


def _fields(name_or_path: str | Path, above: tuple[Path, ...]) -> tuple[str, Tree]:
    """Label for errors, and the merged tree of a crane and all that it builds on."""
    if isinstance(name_or_path, str) and name_or_path in cranes():
        return f"{name_or_path}.toml", library_tree("cranes", name_or_path, "crane")
    if not isinstance(name_or_path, (str, Path)):
        raise SpecError(f"Crane = {came(name_or_path)}: give a name ({', '.join(cranes())}) or the path of a file.")
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and path.name == name_or_path and path.suffix != ".toml" and not path.is_file():
        have = ", ".join(cranes())
        hint = nearest(name_or_path, cranes())
        raise SpecError(f"No crane {came(name_or_path)}: the library has {have}{hint} A file's name ends in .toml.")
    own = file_tree(path)
    base = own.pop("base", None)
    if base is None:
        return path.name, own
    return path.name, _on_base(own, base, path, above)


def _on_base(own: Tree, base: Leaf | Tree, path: Path, above: tuple[Path, ...]) -> Tree:
    name = base.value if isinstance(base, Leaf) else None
    if not isinstance(name, str):
        raise SpecError(f"{path.name}: base = {came(name)}: not the name of a crane ({', '.join(cranes())}).")
    if name not in cranes():
        if not name.endswith(".toml"):
            hint = nearest(name, cranes())
            raise SpecError(
                f"{path.name}: base = {came(name)}: no such crane; the library has {', '.join(cranes())}{hint}"
            )
        if path.resolve() in above:
            raise SpecError(f"{path.name}: base = {came(name)}: the files build on each other in a circle.")
    below_path: str | Path = name if name in cranes() else path.parent / name
    _, below = _fields(below_path, (*above, path.resolve()))
    given = Source(text=f"name of the file {path.name}", kind=SourceKind.USER)
    own.setdefault("name", Leaf(path.stem, given))
    return lay_over(_without_stale_circuit(below, own), own, path.name)


def _without_stale_circuit(below: Tree, own: Tree) -> Tree:
    """A file that turns its base into a pure active winch drops the passive circuit of that base."""
    plant = own.get("plant")
    if isinstance(plant, Leaf) and plant.value == Plant.PURE_ACTIVE.value:
        return {key: item for key, item in below.items() if key != "passive"}
    return below


def _with_library(fields: Tree, label: str) -> Tree:
    """Motors and system friction filled in by name, under what the file says itself."""
    out = dict(fields)
    for circuit in ("active", "passive"):
        part = out.get(circuit)
        motor = part.get("motor") if isinstance(part, dict) else None
        if isinstance(part, dict) and isinstance(motor, dict):
            filled = _filled(motor, "type", "motors", f"{label}: {circuit}.motor.type")
            out[circuit] = {**part, "motor": filled}
    friction = out.get("friction")
    name = friction.get("library") if isinstance(friction, dict) else None
    if isinstance(friction, dict) and isinstance(name, Leaf) and isinstance(name.value, str):
        system = without_title(library_tree("friction", name.value, f"{label}: friction.library"))
        out["friction"] = lay_over({"system": system}, friction, label, "friction")
    for circuit in ("active", "passive"):
        _check_leak_table(out.get(circuit), f"{label}: {circuit}.pump.leak")
    return out


def _filled(part: Tree, key: str, shelf_name: str, where: str) -> Tree:
    name = part.get(key)
    if not (isinstance(name, Leaf) and isinstance(name.value, str)):
        return part
    return lay_over(without_title(library_tree(shelf_name, name.value, where)), part, where.split(":")[0])


def _check_leak_table(circuit: Leaf | Tree | None, where: str) -> None:
    pump = circuit.get("pump") if isinstance(circuit, dict) else None
    leak = pump.get("leak") if isinstance(pump, dict) else None
    if isinstance(leak, Leaf) and isinstance(leak.value, str):
        library_tree("pumps", leak.value, where)
