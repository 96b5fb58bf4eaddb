"""A block as Structured Text with a checksum in it, and as PLCopen XML (TC6, version 2.01): types, functions, function
block, and one configuration."""

from __future__ import annotations

import hashlib
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stillhook._version import __version__
from stillhook.base.gateway.access import read_text
from stillhook.base.gateway.budget import PROGRAM
from stillhook.export.plc.block import PlcError
from stillhook.export.plc.program import PREFIX, Block, Program, Structure, Unit, Variable, plain_text
from stillhook.export.plc.translate import comment
from stillhook.trust.manifest import NAME

HASHES = f"Hashes of all files of this export, and who signed them: {NAME} in the same folder."
MARK = "(* SHA-256 of this text without this line: "
LINE = re.compile(re.escape(MARK) + r"([0-9a-f]{64}) \*\)\n")
AUTHORITY = "www.plcopen.org/xml"
SPACE, XHTML = f"http://{AUTHORITY}/tc6_0201", "http://www.w3.org/1999/xhtml"
"""Names of the two vocabularies, not places."""
WHEN = "2020-01-01T00:00:00"
"""Stands for the time of creation, so that one block gives one file."""


def normalised(text: str) -> str:
    """The text with line ends of one character, without a mark of the order of bytes."""
    return text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\ufeff")


def checksum(text: str) -> str:
    """SHA-256 of a text, with any line ends, without the line that names it."""
    return hashlib.sha256(LINE.sub("", normalised(text), count=1).encode()).hexdigest()


def verify(file: Path) -> tuple[str, str]:
    """Checksum that a file names, and the one that it has. Errors: PlcError for a file that cannot be read or that
    names none."""
    text = read_text(file, "text that stillhook plc export wrote", PlcError, PROGRAM)
    found = LINE.search(normalised(text))
    if found is None:
        raise PlcError(f"{file}: names no checksum. Give a text that stillhook plc export wrote.")
    return found[1], checksum(text)


def structured_text(block: Block | Program) -> str:
    """The complete text: head, structures, functions, function block."""
    head, *more = comment("\n".join([*block.head, HASHES]))
    parts = [
        "\n".join([head, *more]),
        *("\n".join(structure(s)) for s in block.structures),
        *("\n".join(unit(f)) for f in (*block.functions, block.block)),
    ]
    text = "\n\n".join(parts) + "\n"
    end = text.index("\n") + 1 if not more else text.index("*)\n") + 3
    return f"{text[:end]}{MARK}{checksum(text)} *)\n{text[end:]}"


def structure(s: Structure) -> Iterator[str]:
    """A structured type, in a declaration of its own: TwinCAT takes one type at a time."""
    yield from comment(s.comment)
    yield "TYPE"
    yield f"    {s.name} : STRUCT"
    for member in s.members:
        yield f"        {declaration(member)}"
    yield "    END_STRUCT;"
    yield "END_TYPE"


def declaration(v: Variable) -> str:
    """One variable."""
    initial = f" := {v.initial}" if v.initial else ""
    return f"{v.name} : {v.type}{initial};" + (f" (* {plain_text(v.comment)} *)" if v.comment else "")


def interface(u: Unit) -> Iterator[str]:
    """Inputs, outputs and variables."""
    for word, group in (("VAR_INPUT", u.inputs), ("VAR_OUTPUT", u.outputs), ("VAR", u.variables)):
        if group:
            yield f"    {word}"
            for v in group:
                yield f"        {declaration(v)}"
            yield "    END_VAR"


def unit(u: Unit) -> Iterator[str]:
    """A function or the function block."""
    yield from comment(u.comment)
    yield f"FUNCTION {u.name} : {u.result}" if u.result else f"FUNCTION_BLOCK {u.name}"
    yield from interface(u)
    for line in u.body:
        yield f"    {line}" if line else ""
    yield "END_FUNCTION" if u.result else "END_FUNCTION_BLOCK"


def settings(block: Block, text: str) -> dict[str, Any]:
    """What the settings file says: crane, controller, cycle, checksum, and every setting by its path."""
    return {
        "crane": block.crane,
        "controller": block.controller,
        "function_block": block.block.name,
        "mode": block.code,
        "t_cycle": block.t_cycle,
        "sha256": checksum(text),
        "settings": {path: value for path, value, _ in block.settings},
    }


def plcopen_xml(block: Block) -> str:
    """The XML document."""
    ET.register_namespace("", SPACE)
    ET.register_namespace("xhtml", XHTML)
    root = ET.Element(f"{{{SPACE}}}project")
    _add(
        root, "fileHeader", companyName="Stillhook", productName="Stillhook", productVersion=__version__,
        creationDateTime=WHEN, contentDescription=block.head[0],
    )  # fmt: skip
    content = _add(root, "contentHeader", name=f"{block.crane} {block.controller}", modificationDateTime=WHEN)
    coordinates = _add(content, "coordinateInfo")
    for kind in ("fbd", "ld", "sfc"):
        _add(_add(coordinates, kind), "scaling", x="1", y="1")
    types = _add(root, "types")
    data = _add(types, "dataTypes")
    for s in block.structures:
        one = _add(data, "dataType", name=s.name)
        members = _add(_add(one, "baseType"), "struct")
        for v in s.members:
            _variable(members, v)
        _documentation(one, s.comment)
    pous = _add(types, "pous")
    for u in (*block.functions, block.block):
        _pou(pous, u, "function" if u.result else "functionBlock")
    instance = Variable("controller", block.block.name, "connect its inputs and outputs to the signals of the crane")
    main = Unit(f"{PREFIX}main", "Calls the controller.", "", (), (), (instance,), ("controller();",))
    _pou(pous, main, "program")
    configuration = _add(
        _add(_add(root, "instances"), "configurations"), "configuration", name=f"{PREFIX}configuration"
    )
    resource = _add(configuration, "resource", name=f"{PREFIX}resource")
    interval = f"T#{block.t_cycle * 1000.0:g}ms"
    task = _add(resource, "task", name=f"{PREFIX}task", interval=interval, priority="0")
    _add(task, "pouInstance", name=f"{PREFIX}instance", typeName=main.name)
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add(parent: ET.Element, tag: str, /, **attributes: str) -> ET.Element:
    return ET.SubElement(parent, f"{{{SPACE}}}{tag}", attributes)


def _documentation(parent: ET.Element, text: str) -> None:
    if text:
        ET.SubElement(_add(parent, "documentation"), f"{{{XHTML}}}p").text = text


def _type(parent: ET.Element, name: str) -> None:
    if name in ("LREAL", "BOOL"):
        _add(parent, name)
    else:
        _add(parent, "derived", name=name)


def _variable(parent: ET.Element, v: Variable) -> None:
    one = _add(parent, "variable", name=v.name)
    _type(_add(one, "type"), v.type)
    if v.initial:
        _add(_add(one, "initialValue"), "simpleValue", value=v.initial)
    _documentation(one, v.comment)


def _pou(parent: ET.Element, u: Unit, kind: str) -> None:
    pou = _add(parent, "pou", name=u.name, pouType=kind)
    interface: Any = _add(pou, "interface")
    if u.result:
        _type(_add(interface, "returnType"), u.result)
    for tag, group in (("inputVars", u.inputs), ("outputVars", u.outputs), ("localVars", u.variables)):
        if group:
            variables = _add(interface, tag)
            for v in group:
                _variable(variables, v)
    text = _add(_add(pou, "body"), "ST")
    ET.SubElement(text, f"{{{XHTML}}}p").text = "\n" + "\n".join(u.body) + "\n"
    _documentation(pou, u.comment)
