"""A winch and its PLC as two FMUs in one system: SSP of the Modelica Association, version 1.0."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

from stillhook.base.atomic import atomic_file
from stillhook.export.fmu.description import END, TOOL, number, xml_text
from stillhook.export.fmu.package import fmu_members, with_manifest, write_zip
from stillhook.export.twin import Export, ExportError, Port

COMMON = "http://ssp-standard.org/SSP1/SystemStructureCommon"
DESCRIPTION = "http://ssp-standard.org/SSP1/SystemStructureDescription"
"""Names of the formats, not addresses."""
TYPES = {"real": "ssc:Real", "integer": "ssc:Integer", "boolean": "ssc:Boolean", "text": "ssc:String"}


def write_ssp(
    plant: Export, controller: Export, file: str | Path, *, fmi: str = "2", platforms: Sequence[str] = ()
) -> Path:
    """Write a system of a winch without its PLC and the PLC alone, connected. At a communication point the PLC is to
    read before the winch takes its commands: set inputs, read `sensed_...` of the winch, set them in the PLC, read its
    commands, set them in the winch, then let both step.

    Errors: as of `write_fmu`; ExportError where both are not of one crane.
    """
    target = Path(file)
    if target.suffix != ".ssp":
        raise ExportError(f"{target.name}: the name of a system ends in .ssp.")
    if plant.crane != controller.crane or (plant.contents, controller.contents) != ("plant", "controller"):
        raise ExportError("A system is a plant and a controller of one crane.")
    members = {"SystemStructure.ssd": structure(plant, controller).encode()}
    with atomic_file(target) as part:
        scratch = part.with_suffix(".fmu")
        try:
            for name, export in (("plant", plant), ("controller", controller)):
                write_zip(scratch, fmu_members(export, fmi=fmi, platforms=platforms))
                members[f"resources/{name}.fmu"] = scratch.read_bytes()
        finally:
            scratch.unlink(missing_ok=True)
        write_zip(part, with_manifest(members, "system of FMUs", plant))
    return target


def structure(plant: Export, controller: Export) -> str:
    """SystemStructure.ssd: inputs of the winch that the PLC does not give, and of the PLC that the winch does not give,
    are those of the system."""
    root = Element(
        "ssd:SystemStructureDescription",
        {"xmlns:ssc": COMMON, "xmlns:ssd": DESCRIPTION},
        version="1.0",
        name=plant.crane.name,
        generationTool=TOOL,
    )
    system = SubElement(root, "ssd:System", name=plant.crane.name)
    given = {p.name for p in controller.ports if p.causality == "output"}
    own = [p for p in plant.ports if p.causality == "input" and p.name not in given]
    shown = [p for p in plant.ports if p.causality == "output" and not p.name.startswith("sensed_")]
    sensed = {p.name for p in plant.ports if p.causality == "output"}
    asked = [p for p in controller.ports if p.causality == "input" and p.name not in sensed]
    said = [p for p in controller.ports if p.causality == "output" and p.name.startswith("guard_")]
    connectors(system, [*own, *asked, *shown, *said])
    elements = SubElement(system, "ssd:Elements")
    for name, export in (("plant", plant), ("controller", controller)):
        made = SubElement(
            elements, "ssd:Component", name=name, type="application/x-fmu-sharedlibrary", source=f"resources/{name}.fmu"
        )
        connectors(made, [p for p in export.ports if p.causality in ("input", "output")])
    wires = SubElement(system, "ssd:Connections")
    for p in own:
        SubElement(wires, "ssd:Connection", startConnector=p.name, endElement="plant", endConnector=p.name)
    for p in controller.ports:
        if p.causality == "input" and p.name in sensed:
            connection(wires, "plant", "controller", p.name)
    for p in asked:
        SubElement(wires, "ssd:Connection", startConnector=p.name, endElement="controller", endConnector=p.name)
    for p in plant.ports:
        if p.causality == "input" and p.name in given:
            connection(wires, "controller", "plant", p.name)
    for name, ports in (("plant", shown), ("controller", said)):
        for p in ports:
            SubElement(wires, "ssd:Connection", startElement=name, startConnector=p.name, endConnector=p.name)
    SubElement(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=number(END))
    return xml_text(root)


def connectors(parent: Element, ports: Sequence[Port]) -> None:
    listed = SubElement(parent, "ssd:Connectors")
    for p in ports:
        made = SubElement(listed, "ssd:Connector", name=p.name, kind=p.causality)
        SubElement(made, TYPES[p.kind], {"unit": p.unit} if p.kind == "real" else {})


def connection(parent: Element, start: str, end: str, name: str) -> None:
    SubElement(parent, "ssd:Connection", startElement=start, startConnector=name, endElement=end, endConnector=name)
