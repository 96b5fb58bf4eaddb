"""The XML of an FMU from the ports of an export: modelDescription of FMI 2 and FMI 3, terminals of FMI 3, and the
interface file of the Open Simulation Platform."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

from stillhook._version import __version__
from stillhook.export.twin import Export, Port
from stillhook.export.twin.ports import ANY

FOLDER = Path(__file__).parent
BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
DERIVED: Mapping[str, Mapping[str, int]] = {
    **{name: {name: 1} for name in BASE},
    "1": {},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
}
"""Units by their exponents of base units."""
OSP = "http://opensimulationplatform.com/osp-is/OSPModelDescription"
"""Name of the format, not an address: OSP Interface Specification 1.0."""
FACTOR = re.compile(r"(/?)\s*\(?([A-Za-z]+|1)(?:\^(-?\d+))?\)?")
TOOL = f"Stillhook {__version__}"
END = 60.0
"""Time at which a host ends an experiment that names none [s]."""
TYPES_2 = {"real": "Real", "integer": "Integer", "boolean": "Boolean", "text": "String"}
TYPES_3 = {"real": "Float64", "integer": "Int32", "boolean": "Boolean", "text": "String"}


def exponents(unit: str) -> dict[str, int]:
    """Exponents of base units of an SI unit such as "m^3/s" or "s^2/m": what follows a stroke divides."""
    found: dict[str, int] = {}
    for stroke, name, power in FACTOR.findall(unit):
        sign = (-1 if stroke else 1) * int(power or 1)
        for base, exponent in DERIVED[name].items():
            found[base] = found.get(base, 0) + sign * exponent
    return {base: found[base] for base in BASE if found.get(base)}


def xml_text(root: Element) -> str:
    """An XML file."""
    indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root, encoding="unicode") + "\n"


def title(export: Export) -> str:
    """What the model is, in a line."""
    what = {"plant": "winch without its PLC", "controller": "PLC alone"}.get(export.contents, "winch with its PLC")
    at = "" if export.contents == "controller" else f", coupled at the {export.coupling}"
    return f"{export.crane.title}: {what}{at}"


def number(x: float) -> str:
    return repr(float(x))


def type_facts(port: Port) -> dict[str, str]:
    """Start value and unit of a port as XML has them."""
    facts = {}
    if port.causality != "output":
        exact = number(port.start) if port.kind == "real" else str(round(port.start))
        facts["start"] = str(bool(port.start)).lower() if port.kind == "boolean" else exact
    return facts | ({"unit": port.unit} if port.kind == "real" else {})


def range_of(port: Port) -> dict[str, str]:
    """min and max, where there are ends."""
    if port.causality == "output" or port.kind not in ("real", "integer"):
        return {}
    ends = {"min": port.least, "max": port.most}
    return {k: number(x) if port.kind == "real" else str(round(x)) for k, x in ends.items() if abs(x) < ANY}


def units(root: Element, ports: Iterable[Port]) -> None:
    made = SubElement(root, "UnitDefinitions")
    for unit in sorted({p.unit for p in ports if p.unit} | {"s"}):
        base = {name: str(power) for name, power in exponents(unit).items()}
        SubElement(SubElement(made, "Unit", name=unit), "BaseUnit", base)


def facts_of(i: int, port: Port, **types: str) -> dict[str, str]:
    """Name, causality and variability of the i-th port, facts of its type, and where its first value is from."""
    facts = {"name": port.name, "valueReference": str(i), "description": port.description}
    if port.causality in ("fixed", "tunable"):
        return facts | {"causality": "parameter", "variability": port.causality, **types, "initial": "exact"}
    facts |= {"causality": port.causality, "variability": "continuous" if port.kind == "real" else "discrete", **types}
    return facts | ({"initial": "calculated"} if port.causality == "output" else {})


def _begun(export: Export, file: str, token: str) -> tuple[Element, Element]:
    """Description with all but variables and structure, from what is the same for every model; and the element for
    variables."""
    root = fromstring(FOLDER.joinpath(file).read_text(encoding="utf-8"))
    facts = {"modelName": export.crane.name, token: export.identity, "description": title(export)}
    root.attrib.update(facts | {"version": __version__, "generationTool": TOOL})
    root[0].set("modelIdentifier", export.identifier)
    units(root, export.ports)
    categories = SubElement(root, "LogCategories")
    SubElement(categories, "Category", name="logStatusError", description="what was refused, and what is allowed")
    SubElement(categories, "Category", name="logStatusWarning", description="inputs that contradict each other")
    SubElement(root, "DefaultExperiment", startTime="0.0", stopTime=number(END), stepSize=number(export.t_cycle))
    return root, SubElement(root, "ModelVariables")


def fmi2(export: Export) -> str:
    """modelDescription.xml of FMI 2."""
    root, variables = _begun(export, "fmi2.xml", "guid")
    for i, port in enumerate(export.ports):
        row = SubElement(variables, "ScalarVariable", facts_of(i, port))
        SubElement(row, TYPES_2[port.kind], range_of(port) | type_facts(port))
    structure = SubElement(root, "ModelStructure")
    for group in ("Outputs", "InitialUnknowns"):
        listed = SubElement(structure, group)
        for i, port in enumerate(export.ports):
            if port.causality == "output":
                SubElement(listed, "Unknown", index=str(i + 1))
    return xml_text(root)


SOURCE = "model.c"
"""Name of the only source file."""


def fmi3(export: Export) -> str:
    """modelDescription.xml of FMI 3; the time has the value reference behind those of the ports."""
    root, variables = _begun(export, "fmi3.xml", "instantiationToken")
    root[0].set("fixedInternalStepSize", number(export.t_cycle))
    for i, port in enumerate(export.ports):
        SubElement(variables, TYPES_3[port.kind], facts_of(i, port, **range_of(port)) | type_facts(port))
    time = {"name": "time", "valueReference": str(len(export.ports)), "causality": "independent"}
    time |= {"variability": "continuous", "unit": "s", "description": "simulation time"}
    SubElement(variables, "Float64", time)
    structure = SubElement(root, "ModelStructure")
    for group in ("Output", "InitialUnknown"):
        for i, port in enumerate(export.ports):
            if port.causality == "output":
                SubElement(structure, group, valueReference=str(i))
    return xml_text(root)


def build_description(export: Export) -> str:
    """sources/buildDescription.xml of FMI 3."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=export.identifier)
    SubElement(SubElement(configuration, "SourceFileSet", language="C99"), "SourceFile", name=SOURCE)
    SubElement(configuration, "Library", name="m")
    return xml_text(root)


class Group(NamedTuple):
    """Variables that are connected together: member -> variable."""

    name: str
    description: str
    members: dict[str, str]


def groups(export: Export) -> Iterator[Group]:
    """The groups that an export has."""
    names = {p.name for p in export.ports}
    found = [
        Group("crane_tip", "motion of the crane tip, up positive", {"s": "s_tip", "v": "v_tip", "a": "a_tip"}),
        Group("operator", "what the operator chooses", {"v_op": "v_op", "mode": "mode"}),
        Group("wire", "tension in; wire paid out and its speed out", {"F": "F_w", "s": "s_w", "v": "v_w"}),
        Group("load", "motion of the load", {"s": "s_load", "v": "v_load"}),
        Group(
            "sensed",
            "what the PLC reads of the winch",
            {p.name.removeprefix("sensed_"): p.name for p in export.ports if p.name.startswith("sensed_")},
        ),
        Group("commands", "what the PLC commands", {"u_p": "u_p", "u_m": "u_m", "brake": "brake"}),
    ]
    for group in found:
        members = {member: name for member, name in group.members.items() if name in names}
        if len(members) > 1:
            yield group._replace(members=members)


def terminals(export: Export) -> str:
    """terminalsAndIcons/terminalsAndIcons.xml: what a winch alone and a PLC alone have in common matches by name."""
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    listed = SubElement(root, "Terminals")
    kinds = {p.name: p.causality for p in export.ports}
    for group in groups(export):
        made = SubElement(listed, "Terminal", name=group.name, matchingRule="plug", description=group.description)
        for member, name in group.members.items():
            kind = "signal" if kinds[name] in ("input", "output") else "parameter"
            SubElement(made, "TerminalMemberVariable", variableName=name, memberName=member, variableKind=kind)
    return xml_text(root)


def osp(export: Export) -> str:
    """Interface file of the Open Simulation Platform, which is next to the FMU as NAME_OspModelDescription.xml. With
    the coupling "wire" tension and wire speed are a mechanical port."""
    root = Element("OspModelDescription", xmlns=OSP, version="1.0")
    listed = SubElement(root, "VariableGroups")
    if export.coupling == "wire":
        port = SubElement(listed, "LinearMechanicalPort", name="wire_port")
        SubElement(SubElement(port, "Force", name="wire_force"), "Variable", ref="F_w")
        SubElement(SubElement(port, "LinearVelocity", name="wire_speed"), "Variable", ref="v_w")
    for group in groups(export):
        causes: dict[str, list[str]] = {}
        for name in group.members.values():
            causes.setdefault(export.port(name).causality, []).append(name)
        for cause, names in causes.items():
            made = SubElement(listed, "Generic", name=group.name if len(causes) == 1 else f"{group.name}_{cause}")
            for name in names:
                SubElement(made, "Variable", ref=name)
    return xml_text(root)
