"""The same block as PLCopen XML (TC6, version 2.01): types, functions, function block, and one configuration."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

from stillhook._version import __version__
from stillhook.export.plc.program import PREFIX, Block, Unit, Variable

AUTHORITY = "www.plcopen.org/xml"
SPACE, XHTML = f"http://{AUTHORITY}/tc6_0201", "http://www.w3.org/1999/xhtml"
"""Names of the two vocabularies, not places."""
WHEN = "2020-01-01T00:00:00"
"""Stands for the time of creation, so that one block gives one file."""


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
