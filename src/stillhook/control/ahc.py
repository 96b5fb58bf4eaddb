"""Active heave compensation of the pumps: feedforward of the tip's motion and feedback of the wire's position."""

from typing import NamedTuple

from stillhook.physics.scalar import scalar


class AhcGains(NamedTuple):
    """K_1 [s/m], K_2 [s^2/m], K_p [1/m]."""

    K_1: float
    K_2: float
    K_p: float


@scalar
def feedforward(v_tip, a_tip, K_wire, alpha_m, gains):
    """u_ff = -(K_1 v_tip + K_2 a_tip) K_wire alpha_m [-]; tip up positive, so a rising tip pays wire out.

    Source: Moslatt 2020 C eq. 12, E eq. 4. Differs from print: paper E counts pay-out positive and prints the mirror
    image.
    """
    return -(gains.K_1 * v_tip + gains.K_2 * a_tip) * K_wire * alpha_m


@scalar
def feedback(e_c, gains):
    """-K_p e_c [-]; e_c = s_w_ref - s_w > 0: too little wire is out, so pay out. Source: Moslatt 2020 E eq. 6."""
    return -gains.K_p * e_c
