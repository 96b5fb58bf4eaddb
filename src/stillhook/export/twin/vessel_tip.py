"""The crane tip's motion of a vessel's and a boom's, for hosts that have these: as numbers in and out."""

from typing import NamedTuple

from stillhook.kernels.lanes import Array, access, size
from stillhook.physics.tip_kinematics import Attitude, BoomLengths, BoomPose, Jet, tip_motion


class VesselInputs(NamedTuple):
    """What a host gives: attitude of the vessel, angles of the boom, and heave as the motion unit gives it."""

    attitude: Attitude
    pose: BoomPose
    unit_heave: Jet


GIVEN, BOOM = size(VesselInputs), size(BoomLengths)
given_at, boom_at, put = access(VesselInputs, 1).load, access(BoomLengths, 1).load, access(Jet, 1).store


def tip_of_vessel(I: Array, B: Array, out: Array):  # type: ignore[no-untyped-def]
    """A `VesselInputs` in I, in B the `BoomLengths` from the point of the motion and those of the PLC from its motion
    unit; out s, v, a of the tip, true and as the PLC calculates them."""
    given = given_at(I, 0)
    put(out, 0, tip_motion(given.attitude, given.pose, boom_at(B, 0)))
    measured = Attitude(given.unit_heave, given.attitude.roll, given.attitude.pitch)
    put(out, 3, tip_motion(measured, given.pose, boom_at(B, BOOM)))
