"""One lowering: what hangs, from where, into which water, and what the winch is told to do."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, SerializeAsAny

from stillhook import units as u
from stillhook.control.registry import DEFAULT_MODE
from stillhook.sea.motion.kinematics import WaveField
from stillhook.sea.motion.motion import Motion, Still
from stillhook.spec.lift.payload import Payload
from stillhook.spec.lift.programme import Stage, WinchSettings
from stillhook.spec.scenario import RHO_SEA, FrictionModel, Mode, Number, Record, Sensors


class Rigging(Record):
    """Slings between hook and payload: they pull and cannot push."""

    height: u.Length = Field(default=10.0, ge=0, description="from the hook down to the payload's top")
    stiffness: u.Stiffness = Field(default=50e6, gt=0, description="of all slings together (assumed)")
    zeta: Number = Field(default=0.05, ge=0, description="damping ratio of payload on slings (assumed)")


class DeepWire(Record):
    """The wire as a rod of many nodes. Damping is that of the material: the crane's `wire.zeta` is the damping ratio at
    the load's first natural frequency on the wire that is out."""

    nodes: Annotated[int, Field(strict=True, ge=1, le=100)] = 20


class Lowering(Record):
    """A payload on a deep wire under a moving crane tip, through the surface, to the seabed. Frozen.

    At the start everything hangs at rest with the payload's underside at z_0 above still water (negative: below),
    static stretch included. `waves` is the water at the payload, coherent with `tip`; both grow from nothing over
    `ramp`.
    Raises LiftError, one line, for anything else.

    >>> import stillhook
    >>> lift = stillhook.Lowering(
    ...     payload=stillhook.read_payload("template-120t"), h_tip="36 m", depth="1500 m", z_0="-20 m",
    ...     programme=[{"mode": "ahc", "time": "2 min"}], duration="130 s",
    ... )
    >>> lift.depth, lift.programme[0].time
    (1500.0, 120.0)
    """

    name: str = ""
    payload: Payload
    rigging: Rigging = Field(default_factory=Rigging)
    wire: DeepWire = Field(default_factory=DeepWire)
    tip: SerializeAsAny[Motion] = Field(default_factory=Still)
    waves: WaveField | None = None
    h_tip: u.Length = Field(gt=0, description="mean height of the crane tip above still water")
    depth: u.Length = Field(gt=0, description="water depth")
    z_0: u.Length = Field(description="height of the payload's underside above still water at the start")
    programme: tuple[Stage, ...]
    winch: WinchSettings = Field(default_factory=WinchSettings)
    controller: Mode = DEFAULT_MODE
    duration: u.Time = Field(gt=0)
    ramp: u.Time = Field(default=10.0, ge=0)
    rho: u.Density = Field(default=RHO_SEA, gt=0)
    sensors: Sensors = Field(default_factory=Sensors)
    friction: FrictionModel = FrictionModel.LUGRE
