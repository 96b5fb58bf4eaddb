"""What a number of a crane, payload or lift can be: a possible range, outside which it is refused, and within it what
was ever built.

A wrong unit is the mistake of a data sheet that is copied by hand: 90 MPa for 90 GPa, 380 MPa for 380 bar. Where the
result is impossible the file is refused in one line. Where it is only outside of what was ever built, it is read, and
every result carries the status ``implausible`` and a note that names the field. Nothing is clipped.

The ranges are engineering judgement, a factor of a few beyond the data sheets of marine cranes, wire ropes, subsea
structures and closed hydraulic circuits; each line says what it spans. They find slips of units, they do not certify a
design.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, get_args, get_origin

from pydantic import BaseModel, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from stillhook.units import Quantity, number, parse, show

IMPLAUSIBLE = "implausible"
"""Status of a result that follows from a number outside of what was ever built."""

ROUNDING = 1e-9
"""Relative; a mark and a value may be written in different units."""

Mark = str | float
Row = tuple[Mark, Mark, Mark, Mark, str]
"""Least that is possible, least and largest that was built, largest that is possible, and what these are."""

RANGES: Mapping[str, Row | tuple[Row, ...]] = MappingProxyType(
    {
        # crane
        "Crane.SWL": ("1 kg", "0.5 t", "5000 t", "50000 t", "deck winches to heavy-lift cranes"),
        "Crane.hook_mass": ("0 t", "0 t", "300 t", "5000 t", "none to the block of a heavy-lift crane"),
        "Crane.gear_ratios": (0.01, 0.1, 1000.0, 1e5, "gear stages"),
        "Crane.i_hD": (0.01, 1.0, 5000.0, 1e5, "direct drive to planetary gears with a ring gear"),
        "Motor.D_max": (
            "0.01 cc/rev",
            "5 cc/rev",
            "500000 cc/rev",
            "1e7 cc/rev",
            "small axial to large radial piston motors",
        ),
        "Motor.n_max_full": ("0.1 rpm", "5 rpm", "12000 rpm", "100000 rpm", "radial to small axial piston motors"),
        "Motor.n_max": ("0.1 rpm", "5 rpm", "15000 rpm", "100000 rpm", "radial to small axial piston motors"),
        "Motor.D_loss_min": (
            "0 cm^3/rev",
            "0 cm^3/rev",
            "2000 cm^3/rev",
            "1e6 cm^3/rev",
            "smallest displacement of a test",
        ),
        "Motor.n_loss_max": ("1e-3 rev/min", "50 rev/min", "10000 rev/min", "1e6 rev/min", "highest speed of a test"),
        "Motor.dp_loss_max": ("1e-3 bar", "50 bar", "600 bar", "2000 bar", "highest pressure of a test"),
        "Motor.J": (
            "1e-8 kg m^2",
            "1e-5 kg m^2",
            "500 kg m^2",
            "1e6 kg m^2",
            "small axial to large radial piston motors",
        ),
        "Motor.C_1": ("0 L/min/bar", "0 L/min/bar", "2 L/min/bar", "100 L/min/bar", "tight to worn motors"),
        "Motor.C_2": (
            "0 L/min/bar/rpm",
            "0 L/min/bar/rpm",
            "0.005 L/min/bar/rpm",
            "1 L/min/bar/rpm",
            "tight to worn motors",
        ),
        "MotorSet.count": (1, 1, 100, 1000, "motors of one winch"),
        "MotorSet.alpha_min": (0.0, 0.0, 1.0, 1.0, "motors that swing to zero to fixed ones"),
        "MotorSet.offset": (0.0, 0.0, 0.3, 1.0, "open-loop displacement controls"),
        "MotorSet.hysteresis": (0.0, 0.0, 0.3, 1.0, "open-loop displacement controls"),
        "TorqueLoss.X_1": ("0 N m s/rad", "0 N m s/rad", "5 N m s/rad", "1e4 N m s/rad", "a 100 cc to a 500 L motor"),
        "TorqueLoss.X_2": (
            *("0 N m s^2/rad^2/(m^3/rad)^3", "0 N m s^2/rad^2/(m^3/rad)^3"),
            *("1e13 N m s^2/rad^2/(m^3/rad)^3", "1e18 N m s^2/rad^2/(m^3/rad)^3"),
            "two decades about the motors that were fitted",
        ),
        "TorqueLoss.X_3": (0.0, 0.0, 0.3, 1.0, "none to a third of the torque"),
        "TorqueLoss.X_4": ("0 N m", "0 N m", "5 kN m", "1 MN m", "none to a large radial piston motor"),
        "TorqueLoss.X_5": ("0 m^5/N", "0 m^5/N", "1e-11 m^5/N", "1e-6 m^5/N", "none to a large radial piston motor"),
        "Servo.omega_n": ("0.001 rad/s", "0.5 rad/s", "1000 rad/s", "1e5 rad/s", "slow winch motors to servo pumps"),
        "Servo.rate_max": ("1e-4 1/s", "0.02 1/s", "200 1/s", "1e5 1/s", "slow winch motors to servo pumps"),
        "Servo.zeta": (1e-4, 0.1, 10.0, 1000.0, "ringing to sluggish controls"),
        "PumpSet.D": ("0.01 cc/rev", "5 cc/rev", "5000 cc/rev", "1e6 cc/rev", "axial piston pumps"),
        "PumpSet.omega_p": ("1 rpm", "300 rpm", "5000 rpm", "100000 rpm", "diesel and electric drives"),
        "PumpSet.leak_scale": (0.0, 0.0, 50.0, 1e6, "none to worn out"),
        "Line.V": ("1e-6 m^3", "0.1 L", "20 m^3", "1000 m^3", "a hose to the pipes of a drum on another deck"),
        "Line.bulk_modulus": (
            "1 bar",
            "1000 bar",
            "30000 bar",
            "1e6 bar",
            "aerated to stiff mineral oil in steel pipe",
        ),
        "Boost.p": ("0.01 bar", "3 bar", "80 bar", "1000 bar", "charge pressures of closed circuits"),
        "Boost.conductance": ("1e-6 L/min/bar", "0.1 L/min/bar", "1e5 L/min/bar", "1e9 L/min/bar", "charge circuits"),
        "Boost.Q_max": ("1e-6 L/min", "1 L/min", "20000 L/min", "1e7 L/min", "charge pumps of closed circuits"),
        "Relief.p": ("1 bar", "100 bar", "500 bar", "1000 bar", "relief valves of winch hydraulics"),
        "Relief.conductance": ("1e-6 L/min/bar", "0.1 L/min/bar", "1e5 L/min/bar", "1e9 L/min/bar", "relief valves"),
        "Flushing.dp_open": ("0 bar", "0 bar", "50 bar", "1000 bar", "flushing valves"),
        "Flushing.conductance": ("0 L/min/bar", "0 L/min/bar", "1e5 L/min/bar", "1e9 L/min/bar", "flushing valves"),
        "Flushing.dp_shuttle": ("0 bar", "0 bar", "50 bar", "1000 bar", "flushing shuttles"),
        "ActiveCircuit.C_leak": (
            "0 L/min/bar",
            "0 L/min/bar",
            "50 L/min/bar",
            "1e4 L/min/bar",
            "tight to worn circuits",
        ),
        "LeakPoint.p": ("0.01 bar", "10 bar", "500 bar", "1000 bar", "tests of closed circuits"),
        "LeakPoint.alpha_p": (0.0, 0.0, 1.0, 1.0, "settings of pumps"),
        "LeakPoint.n_m": ("0 rpm", "0 rpm", "12000 rpm", "100000 rpm", "standstill to small axial piston motors"),
        "Gas.p_0": ("0.1 bar", "20 bar", "500 bar", "1000 bar", "gas banks of winches"),
        "Gas.V_0": ("1e-6 m^3", "1 L", "100 m^3", "1e5 m^3", "one bottle to a bank of a large winch"),
        "Gas.n": (1.0, 1.0, 1.9, 2.0, "isothermal to adiabatic nitrogen under pressure"),
        "Gas.T_0": ("1 K", "-50 degC", "120 degC", "2000 K", "arctic deck to hot gas"),
        "Accumulator.V_stroke": ("1e-6 m^3", "1 L", "50 m^3", "1e4 m^3", "piston accumulators, one to many"),
        "Accumulator.R_piston": (
            "0 bar/(L/min)",
            "0 bar/(L/min)",
            "1 bar/(L/min)",
            "1000 bar/(L/min)",
            "piston seals and pipes",
        ),
        "Accumulator.C_leak": (
            "0 L/min/bar",
            "0 L/min/bar",
            "5 L/min/bar",
            "1000 L/min/bar",
            "piston seals, new to worn",
        ),
        "PassiveCircuit.p_lp": ("0.01 bar", "1 bar", "100 bar", "1000 bar", "low sides of passive circuits"),
        "Drum.d": ("1 mm", "0.1 m", "12 m", "100 m", "deck winches to traction drums"),
        "Drum.width": ("1 mm", "0.1 m", "20 m", "100 m", "winch drums"),
        "Drum.layers": (1, 1, 60, 1000, "winch drums"),
        "Drum.turns": (1, 2, 500, 1000, "winch drums"),
        "Drum.d_max": ("1 mm", "0.1 m", "15 m", "100 m", "winch drums"),
        "Wire.d": ("0.1 mm", "5 mm", "250 mm", "2 m", "winch wires to mooring ropes"),
        "Wire.E": ("0.1 MPa", "10 GPa", "250 GPa", "1000 GPa", "fibre ropes to steel"),
        "Wire.fill": (0.001, 0.3, 1.0, 1.0, "loose fibre core to solid steel"),
        "Wire.mass_per_length": (
            "1e-6 kg/m",
            "0.02 kg/m",
            "300 kg/m",
            "1e5 kg/m",
            "fibre ropes to the thickest steel wires",
        ),
        "Wire.zeta": (0.0, 0.0, 2.0, 10.0, "undamped to heavily damped"),
        "Wire.zeta_low": (0.0, 0.0, 2.0, 10.0, "undamped to heavily damped"),
        "Wire.zeta_high": (0.0, 0.0, 6.0, 100.0, "undamped to heavily damped"),
        "Wire.L_0": ("1 mm", "0.5 m", "500 m", "10 km", "drum beside the tip to a drum on another deck"),
        "PowerUnits.P_max": ("1 W", "1 kW", "50 MW", "1000 MW", "deck winches to the largest cranes"),
        "PowerUnits.T_max": ("1e-3 N m", "1 N m", "1 MN m", "1000 MN m", "all pump shafts of a winch"),
        "PowerUnits.P_back": ("0 W", "0 W", "50 MW", "1000 MW", "none to the largest cranes"),
        "HoldingBrake.T": ("1e-3 N m", "1 N m", "1 MN m", "1000 MN m", "brakes at the motors of winches"),
        "HoldingBrake.t_wait": ("0 s", "0 s", "10 min", "1 d", "brakes of winches"),
        "HoldingBrake.t_close": ("0 s", "0 s", "10 s", "10 min", "brakes of winches"),
        "HoldingBrake.t_open": ("0 s", "0 s", "10 s", "10 min", "brakes of winches"),
        "HoldingBrake.t_prove": ("0 s", "0 s", "60 s", "10 min", "brakes of winches"),
        "Inertia.J_m_eff": ("1e-8 kg m^2", "1e-4 kg m^2", "1e4 kg m^2", "1e8 kg m^2", "winches seen from the motor"),
        "Inertia.J_gear": ("0 kg m^2", "0 kg m^2", "1e4 kg m^2", "1e8 kg m^2", "gears and brakes seen from the motor"),
        "Inertia.J_drum": (
            "1e-6 kg m^2",
            "0.1 kg m^2",
            "1e8 kg m^2",
            "1e12 kg m^2",
            "deck winches to the largest drums",
        ),
        "SystemFriction.Y_1": (0.0, 0.0, 0.05, 1.0, "none to a dry winch, per motor"),
        "SystemFriction.Y_2": ("0 N m", "0 N m", "10 kN m", "10 MN m", "none to a dry winch, per motor"),
        "SystemFriction.Y_3": ("0 N m", "0 N m", "10 kN m", "10 MN m", "none to a dry winch, per motor"),
        "SystemFriction.Y_4": ("1e-4 rpm", "0.1 rpm", "5000 rpm", "100000 rpm", "bearings and seals"),
        "SystemFriction.Y_5": (
            "0 N m s/rad",
            "0 N m s/rad",
            "50 N m s/rad",
            "1e5 N m s/rad",
            "none to stiff grease, per motor",
        ),
        "SystemFriction.Y_6": (0.0, 0.0, 0.05, 1.0, "none to a dry winch, per motor"),
        "Friction.T_d_min": ("0 N m", "0 N m", "100 MN m", "10000 MN m", "drum torques"),
        "Friction.T_d_max": ("0 N m", "1 kN m", "100 MN m", "10000 MN m", "drum torques"),
        "Friction.sigma_0": ("1e-3 N m/rad", "10 N m/rad", "1e7 N m/rad", "1e12 N m/rad", "bristles of a winch"),
        "Friction.sigma_1_ratio": (0.0, 0.0, 5.0, 1000.0, "none to overdamped"),
        "Friction.omega_fade": ("1e-6 rpm", "0.01 rpm", "1000 rpm", "100000 rpm", "stick to slip"),
        "Friction.omega_reg": ("1e-6 rpm", "0.01 rpm", "1000 rpm", "100000 rpm", "stick to slip"),
        "Control.K_p": ("0 1/m", "0.005 1/m", "10 1/m", "1000 1/m", "position loops of winches"),
        "Control.K_1": ("1e-6 s/m", "0.05 s/m", "20 s/m", "1e6 s/m", "winches of 3 m/min to 1200 m/min"),
        "Control.K_2": ("0 s^2/m", "0 s^2/m", "20 s^2/m", "1e6 s^2/m", "none to slow pumps"),
        "Control.u_thr": (0.0, 0.0, 0.99, 1.0, "threshold of semi-secondary control"),
        "Control.alpha_ns": (1e-4, 0.02, 1.0, 1.0, "displacements of motors"),
        "Control.alpha_hs": (1e-4, 0.02, 1.0, 1.0, "displacements of motors"),
        "Control.alpha_swl": (1e-4, 0.02, 1.0, 1.0, "displacements of motors"),
        "Control.t_lead": ("0 s", "0 s", "1 s", "2 s", "delays of motion units"),
        "Control.t_cycle": ("0.1 ms", "0.1 ms", "200 ms", "1 s", "fast drives to slow PLCs"),
        "Control.compute_share": (0.0, 0.0, 1.0, 1.0, "written at once to written at the end of the cycle"),
        "Control.tau_F": ("0 s", "0 s", "60 s", "1 d", "filters of load cells"),
        "Control.t_bumpless": ("0 s", "0 s", "60 s", "1 d", "changes of mode"),
        "Control.tau_acc": ("0 s", "0 s", "1 h", "1 d", "means over many waves"),
        "Control.K_acc": ("0 1/bar", "0 1/bar", "10 1/bar", "1e4 1/bar", "make-up of passive circuits"),
        "Control.B_v": ("0 N m s/rad", "0 N m s/rad", "5000 N m s/rad", "1e7 N m s/rad", "linear friction of winches"),
        # what is done to it
        "Scenario.load": ("0 t", "0 t", "5000 t", "50000 t", "an empty hook to heavy lifts"),
        "Scenario.s_w": ("0 m", "0 m", "6 km", "20 km", "the deepest subsea lifts"),
        "Scenario.modes": (("-1 d", "0 s", "1 d", "1 d", "times of a run"),),
        "Scenario.duration": ("0.01 s", "0.01 s", "1 d", "1 d", "runs"),
        "Scenario.ramp": ("0 s", "0 s", "1 d", "1 d", "runs"),
        "Scenario.warm_up": ("0 s", "0 s", "1 d", "1 d", "runs"),
        "Water.volume": ("1e-6 m^3", "1e-3 m^3", "20000 m^3", "1e6 m^3", "tools to modules"),
        "Water.added_mass": ("0 t", "0 t", "20000 t", "1e6 t", "tools to modules"),
        "Water.C_D": (0.0, 0.0, 20.0, 1000.0, "streamlined to ventilated bodies in waves"),
        "Water.area": ("0 m^2", "0 m^2", "5000 m^2", "1e6 m^2", "tools to modules"),
        "Water.rho": ("1 kg/m^3", "980 kg/m^3", "1250 kg/m^3", "20000 kg/m^3", "warm fresh water to brine"),
        "Operator.profile": (
            ("-1 d", "0 s", "1 d", "1 d", "times of a run"),
            ("-20 m/s", "-8 m/s", "8 m/s", "20 m/s", "wire speeds of winches"),
        ),
        "Operator.steps": (
            ("-1 d", "0 s", "1 d", "1 d", "times of a run"),
            ("-20 km", "-6 km", "6 km", "20 km", "lengths of wire"),
        ),
        "Operator.alpha_m": (1e-4, 0.02, 1.0, 1.0, "displacements of motors"),
        "Sensors.delay": ("0 s", "0 s", "2 s", "10 s", "motion units and networks"),
        "Sensors.noise_s_tip": ("0 m", "0 m", "1 m", "50 m", "motion units"),
        "Sensors.noise_v_tip": ("0 m/s", "0 m/s", "1 m/s", "50 m/s", "motion units"),
        "Sensors.noise_a_tip": ("0 m/s^2", "0 m/s^2", "5 m/s^2", "500 m/s^2", "motion units"),
        "Sensors.noise_s_w": ("0 m", "0 m", "1 m", "50 m", "wire encoders"),
        "Sensors.noise_F": ("0 kN", "0 kN", "5 MN", "500 MN", "load cells"),
        "Sensors.step_s_tip": ("0 m", "0 m", "1 m", "50 m", "motion units"),
        "Sensors.step_v_tip": ("0 m/s", "0 m/s", "1 m/s", "50 m/s", "motion units"),
        "Sensors.step_s_w": ("0 m", "0 m", "1 m", "50 m", "wire encoders"),
        "Sensors.step_F": ("0 kN", "0 kN", "5 MN", "500 MN", "load cells"),
        "PowerLoss.time": ("-1 d", "0 s", "1 d", "1 d", "times of a run"),
        "PowerLoss.run_down": ("0 s", "0 s", "60 s", "1 d", "pumps that lose their drive"),
        "PowerLoss.detection": ("0 s", "0 s", "60 s", "1 d", "supervision of a PLC"),
        # payload
        "Payload.mass": ("1 kg", "10 kg", "5000 t", "50000 t", "tools to modules"),
        "Payload.height": ("1 mm", "1 cm", "150 m", "1 km", "mud-mats to piles"),
        "Payload.C_D": (0.0, 0.1, 20.0, 1000.0, "streamlined to ventilated bodies in waves"),
        "Payload.C_lin": ("0 kN s/m", "0 kN s/m", "5000 kN s/m", "1e6 kN s/m", "none to the largest ventilated roofs"),
        "Payload.volume": ("1e-6 m^3", "1e-3 m^3", "20000 m^3", "1e6 m^3", "tools to modules"),
        "Level.h": ("0 m", "0 m", "150 m", "10 km", "submergence of a payload"),
        "Level.V": ("0 m^3", "0 m^3", "20000 m^3", "1e6 m^3", "tools to modules"),
        "Level.A33": ("0 t", "0 t", "20000 t", "1e6 t", "tools to modules"),
        "Level.A_p": ("0 m^2", "0 m^2", "5000 m^2", "1e6 m^2", "tools to modules"),
        "Body.C_s": (0.01, 0.5, 20.0, 1000.0, "slamming coefficients, measured and computed"),
        "Rectangle.length": ("1 mm", "5 cm", "150 m", "1 km", "tools to modules"),
        "Rectangle.width": ("1 mm", "5 cm", "100 m", "1 km", "tools to modules"),
        "Rectangle.height": ("0.1 mm", "5 mm", "50 m", "1 km", "plates to modules"),
        "Rectangle.perforation": (0.0, 0.0, 0.5, 0.5, "solid to half open"),
        "Box.wall": ("0 mm", "0 mm", "2 m", "100 m", "sheet to concrete"),
        "Disc.diameter": ("1 mm", "5 cm", "100 m", "1 km", "tools to foundations"),
        "Disc.height": ("0.1 mm", "5 mm", "50 m", "1 km", "plates to foundations"),
        "Disc.perforation": (0.0, 0.0, 0.5, 0.5, "solid to half open"),
        "SuctionAnchor.diameter": ("1 cm", "0.5 m", "40 m", "1 km", "anchors to foundations of towers"),
        "SuctionAnchor.height": ("1 cm", "0.5 m", "60 m", "1 km", "anchors to foundations of towers"),
        "SuctionAnchor.wall": ("0.1 mm", "5 mm", "0.5 m", "100 m", "steel to concrete"),
        "SuctionAnchor.roof": ("0.1 mm", "5 mm", "3 m", "100 m", "steel to concrete"),
        "SuctionAnchor.hatch": (1e-5, 0.001, 0.5, 0.5, "nearly closed to half open"),
        "SuctionAnchor.engaged": ("1 mm", "1 cm", "60 m", "1 km", "depth under a roof"),
        "Round.diameter": ("1 mm", "1 cm", "10 m", "100 m", "tubes to caissons"),
        "Round.length": ("1 mm", "10 cm", "10 km", "1000 km", "one tube to all members of a jacket"),
        "Round.height": ("1 mm", "1 cm", "150 m", "1 km", "one tube to a jacket"),
        "Part.at": ("0 m", "0 m", "150 m", "1 km", "heights within a payload"),
        "Part.count": (1, 1, 100, 100, "parts of a payload"),
        "Part.mass": ("0.001 kg", "1 kg", "5000 t", "50000 t", "parts of a payload"),
        "Seabed.settlement": ("1e-6 m", "0.5 mm", "20 m", "1 km", "rock to soft clay"),
        "Seabed.zeta": (0.0, 0.0, 2.0, 100.0, "rock to soft clay"),
        "Seabed.gap": ("1 mm", "1 cm", "50 m", "1 km", "widths of an underside"),
        "Seabed.added_mass": (0.0, 0.0, 10.0, 1000.0, "growth near the bottom"),
        "Seabed.drag": (0.0, 0.0, 1e4, 1e8, "growth near the bottom, hatches included"),
        "LiftOff.friction": ("0 kN", "0 kN", "100 MN", "10000 MN", "none to long skirts"),
        "LiftOff.suction": ("0 kN", "0 kN", "100 MN", "10000 MN", "none to large bases"),
        # lift
        "Rigging.height": ("0 m", "0 m", "150 m", "1 km", "none to the slings of a jacket"),
        "Rigging.stiffness": ("1 N/m", "100 kN/m", "1e5 MN/m", "1e9 MN/m", "fibre slings to short steel ones"),
        "Rigging.zeta": (0.0, 0.0, 1.0, 100.0, "steel to fibre slings"),
        "DeepWire.nodes": (1, 1, 100, 100, "nodes of the wire"),
        "Lowering.h_tip": ("1 cm", "1 m", "250 m", "2 km", "crane tips above the sea"),
        "Lowering.depth": ("1 cm", "1 m", "6 km", "12 km", "a harbour to the deepest sea that was built in"),
        "Lowering.z_0": ("-12 km", "-6 km", "200 m", "2 km", "a seabed to a high hook"),
        "Lowering.duration": ("1 ms", "1 ms", "1 d", "1 d", "runs"),
        "Lowering.ramp": ("0 s", "0 s", "1 d", "1 d", "runs"),
        "Lowering.rho": ("1 kg/m^3", "980 kg/m^3", "1250 kg/m^3", "20000 kg/m^3", "warm fresh water to brine"),
        "Stage.lower": ("-10 m/s", "-8 m/s", "8 m/s", "10 m/s", "wire speeds of winches"),
        "Stage.hold": ("1 N", "0.1 kN", "50 MN", "500 MN", "an empty hook to heavy lifts"),
        "Stage.time": ("1 ms", "1 ms", "1 d", "10 d", "stages of a lowering"),
        "Stage.depth": ("-2 km", "-200 m", "6 km", "12 km", "a high hook to a seabed"),
        "Stage.wire": ("0 m", "0 m", "6 km", "20 km", "the deepest subsea lifts"),
        "Stage.tension": ("1 N", "0.1 kN", "50 MN", "500 MN", "an empty hook to heavy lifts"),
        "Stage.timeout": ("1 ms", "1 ms", "10 d", "100 d", "stages of a lowering"),
        "WinchSettings.ramp": ("1e-6 m/s^2", "0.001 m/s^2", "5 m/s^2", "1000 m/s^2", "joysticks of winches"),
        "WinchSettings.v_max": ("1e-6 m/s", "0.01 m/s", "8 m/s", "20 m/s", "wire speeds of winches"),
        "WinchSettings.v_enter": ("1e-6 m/s", "0.001 m/s", "5 m/s", "20 m/s", "speeds of crane tips"),
        "WinchSettings.omega_T": ("1e-6 rad/s", "0.01 rad/s", "2 rad/s", "2 rad/s", "tension controls"),
        "WinchSettings.v_soft": ("0 m/s", "0 m/s", "5 m/s", "5 m/s", "splash modes"),
        "WinchSettings.omega_soft": ("1e-3 rad/s", "0.5 rad/s", "100 rad/s", "1e4 rad/s", "splash modes"),
        "WinchSettings.omega_s": ("0 rad/s", "0 rad/s", "1 rad/s", "1 rad/s", "splash modes"),
        "WinchSettings.tau_slow": ("1 ms", "1 s", "10 min", "1 d", "means over some waves"),
        "WinchSettings.tau_suspended": ("1 ms", "1 s", "1 h", "1 d", "means over many waves"),
        "WinchSettings.landed": (1e-6, 0.01, 0.99, 1.0, "falls of the tension"),
        "WinchSettings.F_least": ("0 kN", "0 kN", "10 MN", "500 MN", "tensions of an empty hook"),
    }
)
"""Model and field to its row, or to a row for each number of a pair. A field that a model inherits stands under the
model that has it."""


class Range(NamedTuple):
    """A row in SI, and its kind of quantity ("": a pure number)."""

    least: float
    low: float
    high: float
    most: float
    kind: str
    built: str

    def text(self, value: float) -> str:
        """A value as a person reads it."""
        return show(value, self.kind) if self.kind else number(value)


class Ranged(BaseModel):
    """A model whose numbers are refused, as they are read, outside of what is possible."""

    @field_validator("*")
    @classmethod
    def _possible(cls, value: Any, info: ValidationInfo) -> Any:
        for x, bounds in _numbers(cls, str(info.field_name), value):
            if _outside(x, bounds.least, bounds.most):
                raise PydanticCustomError(
                    "impossible",
                    "it must be between {least} and {most} ({built}); check its unit",
                    {"least": bounds.text(bounds.least), "most": bounds.text(bounds.most), "built": bounds.built},
                )
        return value


def implausible_values(model: BaseModel, path: str = "") -> tuple[str, ...]:
    """A note for every number outside of what was ever built, with its place under `path`."""
    return _notes(_Identity(model), path)


class _Identity:
    """A frozen model, equal to nothing but itself: what is remembered of it is found without comparing its fields."""

    def __init__(self, model: BaseModel) -> None:
        self.model = model

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Identity) and self.model is other.model

    def __hash__(self) -> int:
        return id(self.model)


@functools.lru_cache(maxsize=256)
def _notes(one: _Identity, path: str) -> tuple[str, ...]:
    return tuple(_implausible(one.model, path))


def marked(status: str, notes: Sequence[str]) -> str:
    """The status of a result that follows from numbers with these notes: never "ok" where there are any."""
    if not notes or status == "diverged":
        return status
    return IMPLAUSIBLE if status == "ok" else f"{status}, {IMPLAUSIBLE}"


def _implausible(model: BaseModel, path: str) -> Iterator[str]:
    for name in type(model).model_fields:
        value, place = model.__dict__.get(name), f"{path}.{name}" if path else name
        for x, bounds in _numbers(type(model), name, value):
            if _outside(x, bounds.low, bounds.high):
                built = f"{bounds.text(bounds.low)} to {bounds.text(bounds.high)} ({bounds.built})"
                yield f"{place} {bounds.text(x)} is implausible, outside {built}: check its unit"
        rows = value if isinstance(value, tuple) else (value,)
        for i, row in enumerate(rows):
            if isinstance(row, BaseModel):
                yield from _implausible(row, f"{place}[{i}]" if isinstance(value, tuple) else place)


def _outside(x: float, low: float, high: float) -> bool:
    """Beyond a mark by more than the rounding of its unit."""
    return x < low - ROUNDING * abs(low) or x > high + ROUNDING * abs(high)


def _numbers(model: type[BaseModel], name: str, value: Any) -> Iterator[tuple[float, Range]]:
    """The numbers of a field, each with its range."""
    rows = ranges_of(model, name)
    if not rows:
        return
    for item in value if isinstance(value, tuple) else (value,):
        for x, bounds in zip(item if isinstance(item, tuple) else (item,), rows, strict=False):
            if isinstance(x, int | float) and not math.isnan(x):
                yield float(x), bounds


@functools.cache
def ranges_of(model: type[BaseModel], name: str) -> tuple[Range, ...]:
    """Ranges of a field in SI, one for each number of a pair; none where it has none."""
    row = next((RANGES[key] for key in (f"{cls.__name__}.{name}" for cls in model.__mro__) if key in RANGES), ())
    rows = row if row and isinstance(row[0], tuple) else (row,) if row else ()
    field = model.model_fields[name]
    kinds = [mark.kind for mark in (*field.metadata, *marks(field.annotation)) if isinstance(mark, Quantity)] or [""]
    return tuple(_range(each, kind) for each, kind in zip(rows, kinds, strict=False))  # type: ignore[arg-type]


def marks(annotation: Any) -> Iterator[Any]:
    """What stands in Annotated anywhere in a type."""
    if get_origin(annotation) is Annotated:
        yield from annotation.__metadata__
    for part in get_args(annotation):
        yield from marks(part)


def _range(row: Row, kind: str) -> Range:
    least, low, high, most = (float(mark) if isinstance(mark, int | float) else parse(mark, kind) for mark in row[:4])
    return Range(least, low, high, most, kind, row[4])
