"""A crane by its name in the library, or from a file of your own that may build on one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from stillhook.base.choice import nearest
from stillhook.base.gateway.guard import reader
from stillhook.base.gateway.inputs import note_input
from stillhook.base.gateway.named_files import named_path
from stillhook.errors import SpecError, StillhookError
from stillhook.library.certificate import certified_of, read_certificate
from stillhook.library.condition import condition_of, state_file
from stillhook.library.leakage import leak_misfit
from stillhook.library.parameter_sets import is_path, known_losses, known_torques, set_values
from stillhook.library.toml.file import explain
from stillhook.library.toml.kinds import FileKind, unknown_name
from stillhook.library.toml.loss_map import with_map
from stillhook.library.toml.tree import (
    LABELS,
    Leaf,
    Tree,
    file_tree,
    library_tree,
    overlay,
    parsed,
    shelf,
    sources,
    tree,
    values,
)
from stillhook.library.write import crane_tree
from stillhook.spec.crane import Crane, Source, SourceKind, SystemFriction, has_pumps
from stillhook.tables.table import Spec
from stillhook.trust.trust_list import users_trust
from stillhook.units import quote
from stillhook.winches.circuits.tables import Motor
from stillhook.winches.registry import WINCH_TYPES

_PRODUCT = Source(text="product of gear_ratios", kind=SourceKind.DERIVED)


def cranes() -> tuple[str, ...]:
    """Names of the library's cranes.

    Returns
    -------
    tuple of str
        Names, for `load_crane`.

    Examples
    --------
    >>> import stillhook
    >>> stillhook.cranes()[:3]
    ('deep-250t', 'nov-100t-cylinder', 'nov-100t-electric')
    """
    return shelf("cranes")


@reader(SpecError)
def load_crane(name_or_path: str | Path) -> Crane:
    """A crane of the library by name, or one described in a TOML file.

    Parameters
    ----------
    name_or_path : str or Path
        Name in the library, such as "nov-250t", or path of a crane file.

    Returns
    -------
    Crane
        The machine, every number with its source.

    Raises
    ------
    SpecError, UnitError
        One line that names file, field, what came and what is allowed.

    Notes
    -----
    A file may start with ``base = "nov-250t"`` (or the path of another file, seen from its own folder) and then gives
    only what differs. A motor or system friction that it names is filled in from the library; what the file itself says
    on top wins. It may also name the path of a set's file, seen from its own folder (``library =
    "my-crane.friction.toml"``). A file that turns its base into a pure active winch drops the passive circuit of that
    base. ``certificate = "certificate.json"``, seen from the file, names the certificate of the crane's twin
    (`stillhook validate` writes both); the crane then carries it in short, and runs say where they leave what was
    validated, or that it no longer holds for this crane. The state that `stillhook condition` keeps next to the file
    (``my-crane.condition.json``) is read with it; ``condition = "my-crane.condition.json"`` refuses a crane without it.

    Examples
    --------
    >>> import stillhook
    >>> stillhook.load_crane("nov-250t").title
    '250 t active/passive AHC winch of paper E'
    """
    label, fields = _fields(name_or_path, ())
    crane = _crane(fields, label)
    misfit = leak_misfit(crane.active) if _states_leak(fields) else None
    if misfit:
        raise SpecError(f"{label}: active: {misfit}")
    return crane


def _states_leak(fields: Tree) -> bool:
    """Whether form or point of the active circuit's leak are a user's: then the total must be that of the parts. A file
    that takes them from the library and changes a part alone is read as before."""
    leak = _leak_sources(fields)
    return bool(leak) and all(leak != _leak_sources(_of_library(name)) for name in cranes())


def _leak_sources(fields: Tree) -> dict[str, Source]:
    active = fields.get("active")
    leak = active.get("leak") if isinstance(active, dict) else None
    return dict(sources(leak)) if isinstance(leak, dict) else {}


def crane_from_toml(text: str, label: str) -> Crane:
    """The crane that `crane_toml` wrote, from the text; label names it in errors (SpecError, UnitError)."""
    return _crane(tree(parsed(text, label, FileKind.CRANE), label, user=True), label)


def changed(crane: Crane, changes: Mapping[str, Any]) -> Crane:
    """A crane with some fields changed, as if by a file built on it; the crane itself is not changed.

    Parameters: changes nested tables of texts and numbers, or of leaves with value, kind and source:
    ``{"active": {"line": {"V": "100 L"}}}``.
    Errors: SpecError, UnitError of one line, as ``load_crane``.
    """
    if not isinstance(changes, Mapping):
        raise SpecError(f'Changes = {quote(changes)}: give nested tables, such as {{"wire": {{"L_0": "80 m"}}}}.')
    label = f"changes to {crane.name}"
    overrides = tree(changes, label, user=True)
    return _crane(_over_base(crane_tree(crane), overrides, label), label)


def _crane(fields: Tree, label: str) -> Crane:
    if "sources" in fields:
        raise SpecError(f"{label}: sources: unknown field; write the source next to its value.")
    fields, certified = _with_library(fields, label), fields.get("certified")
    fields.pop("certified", None)
    stated = {path: source for path, source in sources(fields) if path not in LABELS}
    data = values(fields)
    if certified is not None:
        data["certified"] = certified.value if isinstance(certified, Leaf) else {"envelope": None} | values(certified)
    try:
        crane = Crane.model_validate(data | {"sources": {"i_hD": _PRODUCT} | stated})
    except ValidationError as error:
        raise explain(error, Crane, label, data) from None
    if crane.certified is None or isinstance(certified, Leaf):
        return crane
    return crane.model_copy(update={"certified": crane.certified.judged(users_trust())})


def _of_library(name: str) -> Tree:
    """The merged tree of a crane of the library. One that names another as its base is another machine: what it takes
    over is assumed for it, whatever it is for the base."""
    fields = library_tree("cranes", name, "crane")
    base = fields.pop("base", None)
    if not isinstance(base, Leaf):
        return fields
    return _over_base(_assumed(_of_library(base.value), base.value), fields, f"{name}.toml")


def _assumed(node: Tree, base: str) -> Tree:
    """Fields of a base as those of a crane that is built on it."""
    out: Tree = {}
    for key, item in node.items():
        if isinstance(item, Leaf):
            text = f"as {base} ({item.source.text})"
            out[key] = Leaf(item.value, Source(text=text, kind=SourceKind.ASSUMED))
        else:
            out[key] = _assumed(item, base)
    return out


def _fields(name_or_path: str | Path, above: tuple[Path, ...]) -> tuple[str, Tree]:
    """Label for errors, and the merged tree of a crane and all that it builds on."""
    if isinstance(name_or_path, str) and name_or_path in cranes():
        return f"{name_or_path}.toml", _of_library(name_or_path)
    if not isinstance(name_or_path, (str, Path)):
        raise SpecError(f"Crane = {quote(name_or_path)}: give a name ({', '.join(cranes())}) or the path of a file.")
    path = Path(name_or_path)
    if isinstance(name_or_path, str) and path.name == name_or_path and path.suffix != ".toml":
        raise SpecError(unknown_name("crane", name_or_path, cranes(), FileKind.CRANE))
    fields = _with_library(file_tree(path), path.name, path.parent)
    base, certificate, condition = (fields.pop(name, None) for name in ("base", "certificate", "condition"))
    if certificate is not None:
        fields["certified"] = _certified(fields, certificate, condition, path)
    elif condition is not None:
        raise SpecError(f"{path.name}: condition: it belongs to a certificate. Remove it, or name the certificate.")
    return path.name, fields if base is None else _on_base(fields, base, path, above)


def _named_file(key: str, node: Leaf | Tree, path: Path, example: str) -> str:
    """The path of another file under a key of a crane file."""
    name = node.value if isinstance(node, Leaf) else None
    if not isinstance(name, str) or not name.strip():
        raise SpecError(f"{path.name}: {key} = {quote(name)}: give the path of {example}.")
    return name


def beside(path: Path, key: str, name: str) -> Path:
    """The file that a crane file names under a key. Errors: SpecError where it is not in the crane file's folder."""
    return named_path(path.parent, name, lambda why: SpecError(f"{path.name}: {key} = {quote(name)}: {why}"))


def _certified(fields: Tree, certificate: Leaf | Tree, condition: Leaf | Tree | None, path: Path) -> Leaf:
    """The certificate that a crane file names, in short, with the state of its condition beside the crane file, or
    where that names it."""
    name = _named_file("certificate", certificate, path, 'a certificate, such as "certificate.json"')
    if "certified" in fields:
        raise SpecError(f"{path.name}: certificate and [certified]: the second is the record of another. Remove it.")
    example, file = f'a condition\'s state, such as "{state_file(path).name}"', state_file(path)
    if condition is not None:
        file = beside(path, "condition", _named_file("condition", condition, path, example))
    of = beside(path, "certificate", name)
    try:
        data = read_certificate(of)
        record, trust = certified_of(data, Path(name).name), users_trust()
        if condition is not None or file.exists():
            note_input(file)
            record = record.followed(condition_of(file, data, trust))
        record = record.judged(trust, str(of))
    except StillhookError as problem:
        raise SpecError(f"{path.name}: certificate = {quote(name)}: {problem}") from None
    return Leaf(record, Source(text=f"certificate {record.short}", kind=SourceKind.USER))


def _on_base(fields: Tree, base: Leaf | Tree, path: Path, above: tuple[Path, ...]) -> Tree:
    name = base.value if isinstance(base, Leaf) else None
    have = ", ".join(cranes())
    if not isinstance(name, str):
        raise SpecError(f"{path.name}: base = {quote(name)}: not the name of a crane ({have}) nor the path of a file.")
    if name not in cranes() and not name.endswith(".toml"):
        hint = nearest(name, cranes())
        raise SpecError(f"{path.name}: base = {quote(name)}: no such crane; the library has {have}{hint}")
    if path.resolve() in above:
        raise SpecError(f"{path.name}: base = {quote(name)}: the files build on each other in a circle.")
    below_path: str | Path = name if name in cranes() else beside(path, "base", name)
    _, below = _fields(below_path, (*above, path.resolve()))
    fields.setdefault("name", Leaf(path.stem, Source(text=f"name of the file {path.name}", kind=SourceKind.USER)))
    return _over_base(below, fields, path.name)


def _over_base(below: Tree, fields: Tree, label: str) -> Tree:
    """``fields`` merged over its base, less the numbers of the base that ``fields`` replace."""
    base = dict(below)
    if "certified" in fields:
        base.pop("certified", None)
    plant = _text_at(fields, "plant")
    if plant is not None and plant in WINCH_TYPES:
        for table in {name for each in WINCH_TYPES.values() for name in each.tables} - set(WINCH_TYPES[plant].tables):
            base.pop(table, None)
        if not has_pumps(WINCH_TYPES[plant]):
            base.pop("hpu", None)
    for circuit in ("active", "passive"):
        part = base.get(circuit)
        motor = part.get("motor") if isinstance(part, dict) else None
        if isinstance(part, dict) and isinstance(motor, dict) and _text_at(fields, circuit, "motor", "type"):
            base[circuit] = {**part, "motor": {k: v for k, v in motor.items() if k not in Motor.model_fields}}
        pump, named = base.get(circuit), _text_at(fields, circuit, "pump", "leak")
        if isinstance(pump, dict) and named and named != _text_at(pump, "pump", "leak") and _has_table(pump):
            base[circuit] = {**pump, "pump": {k: v for k, v in _branch(pump, "pump").items() if k != "table"}}
    for table, name in MOTOR_TABLES.items():
        part = base.get(table)
        motor = part.get(name) if isinstance(part, dict) else None
        if isinstance(part, dict) and isinstance(motor, dict) and _text_at(fields, table, name, "loss_model", "law"):
            base[table] = {**part, name: {k: v for k, v in motor.items() if k != "loss_model"}}
    friction = base.get("friction")
    if isinstance(friction, dict) and _text_at(fields, "friction", "library"):
        base["friction"] = {k: v for k, v in friction.items() if k not in ("system", "T_d_min", "T_d_max")}
    return overlay(base, fields, label)


def _branch(node: Leaf | Tree | None, name: str) -> Tree:
    """A table within another, empty where there is none."""
    part = node.get(name) if isinstance(node, dict) else None
    return part if isinstance(part, dict) else {}


def _has_table(circuit: Leaf | Tree | None) -> bool:
    """Whether the pumps of a circuit have a leak table of their own."""
    return "table" in _branch(circuit, "pump")


def _text_at(node: Leaf | Tree | None, *path: str) -> str | None:
    """The text at the end of the path, None if there is none."""
    for part in path:
        node = node.get(part) if isinstance(node, dict) else None
    return node.value if isinstance(node, Leaf) and isinstance(node.value, str) else None


def _with_library(fields: Tree, label: str, folder: Path | None = None) -> Tree:
    """Motors and system friction filled in by name, overridden by the file's own fields; leak tables looked up.

    folder: that of the file, from which paths of sets are seen; None where all files have been read: a set that was
    read from a path is then part of the fields, and its file is no longer needed.
    """
    out = dict(fields)
    for table, name in MOTOR_TABLES.items():
        part = out.get(table)
        if isinstance(part, dict) and isinstance(set_ := part.get(name), dict) and "loss_model" in set_:
            out[table] = {**part, name: with_map(set_, f"{label}: {table}.{name}", folder)}
    for circuit in ("active", "passive"):
        part = out.get(circuit)
        type_, leak = _text_at(part, "motor", "type"), _text_at(part, "pump", "leak")
        if isinstance(part, dict) and type_ and _needs_reading(type_, part.get("motor"), Motor, folder):
            place = f"{label}: {circuit}.motor.type"
            motor = set_values("motors", type_, place, folder or Path()) | known_losses(type_, place, folder or Path())
            out[circuit] = overlay({"motor": motor}, part, label, circuit)
        if leak and folder is None and not _has_table(part):
            library_tree("pumps", leak, f"{label}: {circuit}.pump.leak")
    friction, library = out.get("friction"), _text_at(out, "friction", "library")
    if (
        isinstance(friction, dict)
        and library
        and _needs_reading(library, friction.get("system"), SystemFriction, folder)
    ):
        place = f"{label}: friction.library"
        system = set_values("friction", library, place, folder or Path())
        out["friction"] = overlay(
            {"system": system, **known_torques(library, place, folder or Path())}, friction, label, "friction"
        )
    return out


MOTOR_TABLES = {"active": "motor", "passive": "motor", "secondary": "unit", "open": "motor"}
"""Table of the motors in each table of a crane file that has some."""


def _needs_reading(name: str, part: Leaf | Tree | None, model: type[Spec], folder: Path | None) -> bool:
    """Whether a set is read now: of the library at the end, from a path with the file that names it."""
    if not is_path(name):
        return folder is None
    return not (isinstance(part, dict) and {n for n, f in model.model_fields.items() if f.is_required()} <= set(part))
