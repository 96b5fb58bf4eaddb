"""What a controller may know of the crane that it runs on: numbers of the crane file, none of them measured."""

from typing import NamedTuple


class Hydraulics(NamedTuple):
    """What a winch type has of hydraulics; 0 where it has no such part."""

    D_m: float = 0.0  # displacement of all active motors at full setting [m^3/rad]; of secondary units theirs
    Q_p: float = 0.0  # full flow of the active pumps [m^3/s]
    D_pm: float = 0.0  # displacement of all passive motors at full setting [m^3/rad]
    Q_pp: float = 0.0  # full flow of the passive pumps, of secondary control those of the rail [m^3/s]
    i_C_h: float = 0.0  # inverse capacitance of line A and of line B [Pa/m^3]; 0 where their volume changes
    G_leak: float = 0.0  # leakage of the active circuit per pressure difference [m^3/s/Pa]
    omega_np: float = 0.0  # natural frequency of the pumps' displacement controls [rad/s]
    zeta_p: float = 0.0  # their damping ratio [-]


class ShaftFriction(NamedTuple):
    """Friction at the motor shaft, against the motion: T_dry + T_stick exp(-|omega| i_omega_stick) + B |omega|."""

    T_dry: float = 0.0
    T_stick: float = 0.0
    i_omega_stick: float = 0.0
    B: float = 0.0


class PlantParameters(NamedTuple):
    """Parameters of the crane for controllers, SI: of the crane file, not measured; 0 where it has no such part."""

    D_m: float  # displacement of all active motors at full setting [m^3/rad]; of secondary units theirs
    Q_p: float  # full flow of the active pumps [m^3/s]
    D_pm: float  # displacement of all passive motors at full setting [m^3/rad]
    Q_pp: float  # full flow of the passive pumps, of secondary control those of the rail [m^3/s]
    i_C_h: float  # inverse capacitance of line A and of line B [Pa/m^3]; 0 where their volume changes
    G_leak: float  # leakage of the active circuit per pressure difference [m^3/s/Pa]
    omega_np: float  # natural frequency of the pumps' displacement controls [rad/s]
    zeta_p: float  # their damping ratio [-]
    i_hD: float  # motor speed over drum speed [-]
    r_drum: float  # radius of the bare drum [m]
    d_max: float  # diameter that K_wire is counted from: that of the layer in use is d_max / K_wire [m]
    d_wire: float  # diameter of the wire [m]
    layers: float  # layers of wire on the full drum [-]
    turns: float  # turns in a layer [-]
    m_wire: float  # mass of the wire per length [kg/m]
    EA: float  # stiffness of the wire times its length [N]
    L_0: float  # wire between drum and crane tip [m]
    SWL: float  # weight of the safe working load [N]
    m_hook: float  # mass of the hook [kg]
    J: float  # inertia at the motor shaft with a drum without wire [kg m^2]
    T_dry: float  # friction at the motor shaft with half of the SWL, see `ShaftFriction`: level [N m]
    T_stick: float  # what it is more at rest [N m]
    i_omega_stick: float  # inverse of the speed over which that falls off [s/rad]
    B: float  # rise with the speed [N m s/rad]
