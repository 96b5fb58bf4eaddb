"""Signals, extremes and limits that several winch types have, each with its row."""

from typing import Annotated

from stillhook.base.variable import Row
from stillhook.winches.interface import Cause
from stillhook.winches.records import highest, largest, lowest

AlphaP = Annotated[float, Row("1", "", "hoisting positive", "pump displacement over its maximum", "paper E eq. 8")]
AlphaM = Annotated[float, Row("1", "", "", "motor displacement over its maximum", "paper E eq. 7")]
PressureA = Annotated[float, Row("Pa", "pressure", "gauge", "pressure of the hoisting side", "eq. 2.1")]
PressureB = Annotated[float, Row("Pa", "pressure", "gauge", "pressure of the lowering side", "eq. 2.1")]
OmegaM = Annotated[float, Row("rad/s", "rotation", "hoisting positive", "motor shaft speed", "eq. 2.12")]
VoidVolume = Annotated[
    float, Row("m^3", "volume", "", "vapour in the lines: oil that is missing at the vapour pressure", symbol="V_v")
]
ReliefFlow = Annotated[
    float,
    Row("m^3/s", "flow", "out of the circuit", "flow through the relief valves of the active circuit", symbol="Q_r"),
]
FrictionTorque = Annotated[
    float,
    Row(
        "N m",
        "torque",
        "against hoisting positive",
        "friction torque of the complete winch at the motor shaft",
        "eq. 2.5",
    ),
]
PumpShare = Annotated[float, Row("1", "", "", "share of the active pumps that run", symbol="f_p")]
HydraulicPower = Annotated[
    float,
    Row(
        "W",
        "power",
        "to the pumps positive",
        "hydraulic power of the power units: active and passive pumps; negative: taken back",
    ),
]

HighestPressureA = Annotated[
    float, Row("Pa", "pressure", "gauge", "highest pressure of the hoisting side", symbol="max p_a"), highest("p_a")
]
HighestPressureB = Annotated[
    float, Row("Pa", "pressure", "gauge", "highest pressure of the lowering side", symbol="max p_b"), highest("p_b")
]
HighestPressure = Annotated[
    float, Row("Pa", "pressure", "gauge", "highest pressure of both sides", symbol="max p"), highest("p_a", "p_b")
]
LowestPressure = Annotated[
    float, Row("Pa", "pressure", "gauge", "lowest pressure of both sides", symbol="min p"), lowest("p_a", "p_b")
]
MostVoid = Annotated[
    float, Row("m^3", "volume", "", "most vapour in the lines together", symbol="max V_v"), highest("V_void")
]
LargestAlphaP = Annotated[
    float, Row("1", "", "", "largest pump displacement used", symbol="max|alpha_p|"), largest("alpha_p")
]
LeastAlphaM = Annotated[
    float, Row("1", "", "", "smallest motor displacement used", symbol="min alpha_m"), lowest("alpha_m")
]
HighestSpeed = Annotated[
    float, Row("rad/s", "rotation", "", "highest motor speed", symbol="max|omega_m|"), largest("omega_m")
]
HighestPower = Annotated[
    float,
    Row("W", "power", "to the pumps positive", "highest hydraulic power of the power units", symbol="max P_hpu"),
    highest("P_hpu"),
]
LowestPower = Annotated[
    float,
    Row(
        "W",
        "power",
        "to the pumps positive",
        "lowest hydraulic power of the power units; negative: most that was fed back",
        symbol="min P_hpu",
    ),
    lowest("P_hpu"),
]

ReliefLimit = Annotated[
    float, Cause("relief", "time with a relief valve of the active or passive circuit open", symbol="t_relief")
]
OverspeedLimit = Annotated[
    float, Cause("overspeed", "time with the active or passive motors above their speed limit", symbol="t_over")
]
CavitationLimit = Annotated[
    float, Cause("cavitation", "time with a hydraulic line at or below zero gauge", symbol="t_cav")
]
PowerLimit = Annotated[
    float,
    Cause(
        "power",
        "time with the hydraulic power units at their limit, or with more power fed back than they take",
        symbol="t_P",
    ),
]
BoostLimit = Annotated[float, Cause("boost", "time with the boost pump at its limit", symbol="t_boost")]
