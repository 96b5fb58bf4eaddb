"""The information model: objects of a crane after OPC 40020-1 "Cranes & Hoists" 1.00, with the twin's numbers below.

The objects carry the browse names of that specification and of those that it builds on (Devices, Machinery, Robotics);
its types are not loaded, so that a client finds its way by names and not by type definitions. Numbers have the names of
`stillhook.variables`, which are also their node identifiers: ns=<urn:stillhook:live>;s=s_w.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from stillhook.live.runtime.board import IMAGE, STATUS
from stillhook.live.servers.served import MEASURED, Served, about
from stillhook.sea.vessel.vessel_tip import VESSEL

if TYPE_CHECKING:
    from asyncua import Node, Server, ua

NAMESPACE = "urn:stillhook:live"
DI, MACHINERY = "http://opcfoundation.org/UA/DI/", "http://opcfoundation.org/UA/Machinery/"
ROBOTICS, CRANES = "http://opcfoundation.org/UA/Robotics/", "http://opcfoundation.org/UA/CranesHoists/"
UNECE = "http://www.opcfoundation.org/UA/units/un/cefact"
CODES: Mapping[str, str] = {
    "1": "C62",
    "m": "MTR",
    "m/s": "MTS",
    "m/s^2": "MSK",
    "s": "SEC",
    "N": "NEW",
    "Pa": "PAL",
    "rad": "C81",
    "rad/s": "2A",
    "rad/s^2": "2B",
    "W": "WTT",
    "m^3": "MTQ",
    "m^3/s": "MQS",
    "N m": "NU",
    "K": "KEL",
    "J": "JOU",
}
"""Common codes of UNECE recommendation 20 by unit; a unit without one is given by its name alone."""
BOOM = ("slew", "main", "knuckle")
COMPONENTS: Mapping[str, tuple[str, ...]] = {
    "CraneTip": ("s_tip", "v_tip", "a_tip"),
    "Wire": ("s_w", "v_w", "F_w", "layer", "s_load", "v_load"),
    "Vessel": tuple(name for name in VESSEL if not name.endswith(BOOM)),
    "Boom": tuple(name for name in VESSEL if name.endswith(BOOM)),
    "Plc": ("e_c", "e_c_measured", "u_p", "u_m", "u_ff", "u_raw", "mode", "v_op", "s_op", "f_pump"),
}
"""Numbers by the component that they are of."""
DRIVE, COMPARISON = "Drive", "Comparison"
"""Where all others are, and those of the measured crane beside the twin's, such as deviation.s_w."""
AXIS: Mapping[str, str] = {"ActualPosition": "s_w", "ActualSpeed": "v_w"}
"""Numbers of an axis of OPC 40010-1 and what they are here."""
LOAD = "F_w"
IMAGE_NODE = "Plc.image"


class Model(NamedTuple):
    """Nodes: read-only ones by name (a name may have several), and those that are written."""

    values: list[tuple[str, Node]]
    inputs: dict[str, Node]


def component_of(name: str) -> str:
    """The component that a number is of."""
    if "." in name:
        return COMPARISON
    return next((part for part, names in COMPONENTS.items() if name in names), DRIVE)


def engineering_units(unit: str) -> ua.EUInformation:
    """A unit as OPC UA has it: the common code's characters as a number."""
    from asyncua import ua

    code = CODES.get(unit)
    number = -1 if code is None else int.from_bytes(code.encode(), "big")
    text = ua.LocalizedText("" if unit == "1" else unit)
    return ua.EUInformation(NamespaceUri=UNECE, UnitId=number, DisplayName=text, Description=text)


async def build(
    server: Server, crane: str, version: str, names: Sequence[str], inputs: Sequence[str], streamed: int
) -> Model:
    """Add the crane's objects and their variables to a server."""
    ours, di, machinery, robotics, cranes = [
        await server.register_namespace(uri) for uri in (NAMESPACE, DI, MACHINERY, ROBOTICS, CRANES)
    ]
    maker = _Maker(ours)
    machines = await maker.folder(server.nodes.objects, machinery, "Machines")
    machine = await maker.object(machines, cranes, crane)
    identification = await maker.object(machine, di, "Identification", "machine")
    facts = {"Manufacturer": "Stillhook", "Model": f"digital twin of {crane}", "SoftwareRevision": version}
    facts |= {"ProductInstanceUri": f"urn:stillhook:{crane}", "SerialNumber": "0"}
    for name, text in facts.items():
        await maker.text(identification, di, name, text)
    operational = await maker.object(machine, di, "Operational", "machine")
    hoist = await maker.object(await maker.folder(machine, robotics, "MotionDevices"), cranes, "Hoist")
    values: list[tuple[str, Node]] = []
    axis = await maker.object(await maker.folder(hoist, robotics, "Axes"), cranes, "HoistAxis")
    parameters = await maker.object(axis, di, "ParameterSet", "axis")
    for name, number in AXIS.items():
        if number in names:
            values.append((number, await maker.number(parameters, robotics, name, f"HoistAxis.{name}", number)))
    if LOAD in names:
        load = await maker.object(axis, cranes, "ActualLoad")
        values.append((LOAD, await maker.number(load, ours, LOAD, "HoistAxis.ActualLoad", LOAD)))
    components = await maker.object(machine, machinery, "Components")
    absent = {"Vessel", "Boom"}.difference(map(component_of, names))
    parts = {
        part: await maker.object(components, ours, part)
        for part in (*COMPONENTS, DRIVE, COMPARISON)
        if part not in absent
    }
    for name in names:
        parent = operational if name in STATUS else parts[component_of(name)]
        values.append((name, await maker.number(parent, ours, name, name, name)))
    received = await maker.object(machine, ours, "Inputs")
    configuration = await maker.object(machine, di, "Configuration", "machine")
    written: dict[str, Node] = {}
    measured = await maker.object(machine, ours, "Measured")
    for i, name in enumerate(inputs):
        parent, place = (received, "Inputs") if i < streamed else (configuration, "Configuration")
        side, _, signal = name.rpartition(".")
        if side == MEASURED:
            parent, place = measured, "Measured"
        node = await maker.number(parent, ours, signal, f"{place}.{signal}", name)
        await node.set_writable()
        written[name] = node
    return Model(values, written)


async def image(server: Server, served: Served) -> None:
    """Add `IMAGE_NODE`: the numbers of `IMAGE` of the newest cycle, as they are when a client reads, for a PLC that
    reads faster than the other nodes change. There is no subscription to it."""
    from asyncua import ua

    def newest(nodeid: ua.NodeId, attribute: ua.AttributeIds) -> ua.DataValue:
        row = served.latest()
        good = row is not None and served.alive
        numbers = [math.nan if row is None else row.values[name] for name in IMAGE]
        status = ua.StatusCode(ua.StatusCodes.Good if good else ua.StatusCodes.UncertainLastUsableValue)
        return ua.DataValue(ua.Variant(numbers, ua.VariantType.Double), status)

    space = await server.get_namespace_index(NAMESPACE)
    node = await server.get_node(ua.NodeId("object.Plc", space)).add_variable(
        ua.NodeId(IMAGE_NODE, space), ua.QualifiedName("image", space), [0.0] * len(IMAGE), ua.VariantType.Double
    )
    names = ua.DataValue(ua.Variant(ua.LocalizedText(", ".join(IMAGE))))
    await node.write_attribute(ua.AttributeIds.Description, names)
    server.iserver.aspace.set_attribute_value_callback(node.nodeid, ua.AttributeIds.Value, newest)


class _Maker:
    """Makes nodes whose identifiers say where they are."""

    def __init__(self, ours: int) -> None:
        self._space = ours

    async def object(self, parent: Node, space: int, name: str, of: str = "") -> Node:
        return await parent.add_object(self._id(f"{of}.{name}" if of else name), self._name(space, name))

    async def folder(self, parent: Node, space: int, name: str) -> Node:
        return await parent.add_folder(self._id(name), self._name(space, name))

    async def text(self, parent: Node, space: int, name: str, text: str) -> None:
        await parent.add_property(self._id(f"Identification.{name}"), self._name(space, name), text)

    async def number(self, parent: Node, space: int, name: str, identifier: str, of: str) -> Node:
        """A variable of the type Double, with its unit and meaning."""
        from asyncua import ua

        unit, meaning = about(of)
        nodeid = ua.NodeId(identifier, self._space)
        node = await parent.add_variable(nodeid, self._name(space, name), 0.0, ua.VariantType.Double)
        described = ua.DataValue(ua.Variant(ua.LocalizedText(meaning)))
        await node.write_attribute(ua.AttributeIds.Description, described)
        eu = ua.QualifiedName("EngineeringUnits", 0)
        await node.add_property(ua.NodeId(f"{identifier}.unit", self._space), eu, engineering_units(unit))
        return node

    def _id(self, name: str) -> ua.NodeId:
        from asyncua import ua

        return ua.NodeId(f"object.{name}", self._space)

    def _name(self, space: int, name: str) -> ua.QualifiedName:
        from asyncua import ua

        return ua.QualifiedName(name, space)
