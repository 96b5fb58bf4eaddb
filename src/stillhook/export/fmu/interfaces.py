"""Groups of an FMU's variables: terminals of FMI 3, and the interface file of the Open Simulation Platform."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

from stillhook.export.fmu.description import xml_text
from stillhook.export.twin import Export

OSP = "http://opensimulationplatform.com/osp-is/OSPModelDescription"
"""Name of the format, not an address: OSP Interface Specification 1.0."""


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
    """Interface file of the Open Simulation Platform, which lies beside the FMU as NAME_OspModelDescription.xml. With
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
