"""Oil lines as hydraulic capacitances."""


def capacitance(V: float, beta: float) -> float:
    """Hydraulic capacitance C_h = V / beta [m^3/Pa] of a line of volume V [m^3] at effective bulk modulus beta [Pa].

    The pressure in the line rises with dp/dt = Q_net / C_h. Source: Moslatt 2020 eq. 2.14.
    """
    return V / beta
