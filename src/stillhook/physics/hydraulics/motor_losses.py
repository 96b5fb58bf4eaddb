"""Torque loss of hydraulic motors: the models that paper A compares, from Wilson to MJ6; the twin takes them from
`stillhook.physics.hydraulics.motor_laws`.

One function an equation, with the letters of Moslatt 2020 paper A. Floats or numpy arrays in, the same out; SI. Every
loss is even in the speed and in the pressure drop: print has bars on the speed alone. MJ4 is
`stillhook.physics.hydraulics.motor.torque_loss`.

Paper A fits all of them to 400-2500 rev/min and 50-350 bar of one motor; none is tested outside. `rho` and `mu` only
scale parameters: oil that is warmer than the map's is another map.
"""

import math
from typing import Any, NamedTuple

from stillhook.physics.hydraulics.motor import TorqueLossFit, torque_loss, torque_loss_dry
from stillhook.physics.records import define
from stillhook.physics.scalar import cube, maximum, power, scalar, sqrt

RHO_OIL = 870.0
"""Density of a mineral hydraulic oil HLP 46 at 40 degC [kg/m^3]. Assumed (typical of the class; the map's own oil is
rarely stated)."""
MU_OIL = 46.0e-6 * RHO_OIL
"""Its dynamic viscosity [Pa s]: 46 mm^2/s at 40 degC is what class 46 of ISO 3448 means. Assumed."""
ALPHA_MAX = math.radians(25.0)
"""Swivel angle of a bent-axis motor of the A6VM type at full displacement [rad]. Assumed; only Pacey's model asks for
it."""
OMEGA_LOW = 400.0 * math.pi / 30.0
"""Lowest speed of paper A's maps [rad/s]."""


class LossMotor(NamedTuple):
    """What some models know of the motor: D_max full displacement [m^3/rad], oil rho [kg/m^3] and mu [Pa s], sine and
    tangent of its full swivel angle [-], omega_low lowest speed of the fit, below which a term that grows without
    bound, and a model that interpolates, keep their value [rad/s]."""

    D_max: float
    rho: float = RHO_OIL
    mu: float = MU_OIL
    sin_alpha: float = math.sin(ALPHA_MAX)
    tan_alpha: float = math.tan(ALPHA_MAX)
    omega_low: float = OMEGA_LOW


def parameters(name: str, fields: str, meanings: str) -> Any:
    """Class of the parameters of a model, in the order in which they are written; meanings: with their units."""
    made: Any = NamedTuple(name, [(field, float) for field in fields.split()])  # type: ignore[misc]
    made.__module__, made.__doc__ = __name__, meanings
    return made


Wilson = parameters("Wilson", "C_a C_b C_c", "C_a [-] dry, C_b [-] viscous, C_c [Pa] constant loss.")
Schlosser = parameters("Schlosser", "C_a C_b C_d", "C_a [-] dry, C_b [-] viscous, C_d [-] acceleration of the oil.")
Thoma = parameters("Thoma", "C_a C_b C_e", "C_a [-] dry, C_b [-] viscous, C_e [-] acceleration of the oil.")
Pacey = parameters("Pacey", "C_a C_b C_e", "C_a [-] dry, C_b [-] viscous, C_e [N m] constant loss.")
Ortwig = parameters(
    "Ortwig",
    "C_e C_f C_g C_h C_i C_j C_k C_l",
    "C_e [N m], C_f [m^3], C_g [N m s], C_h [m^3 s], C_i [N m s^2]; C_j, C_k, C_l as C_e, C_f, C_g per relative"
    " displacement.",
)
Jeong = parameters(
    "Jeong",
    "C_e C_f C_g C_i C_k C_m",
    "C_e [N m], C_f [m^3], C_g [m^3], C_i [m^5], C_k [m^2], C_m [m^5/N].",
)
MJ1 = parameters(
    "MJ1",
    "C_e C_f C_g C_m C_i C_k",
    "C_e [N m], C_f [m^3], C_g [m^3], C_m [m^5/N], C_i [1/m^4], C_k [m^2].",
)
MJ2 = parameters("MJ2", "C_e C_f C_g C_i C_m", "C_e [N m], C_f [m^3], C_g [m^3], C_i [1/m^4], C_m [m^5/N].")
MJ3 = parameters("MJ3", "C_e C_f C_g C_i", "C_e [N m], C_f [m^3], C_g [m^3], C_i [1/m^4].")
MJ5 = parameters(
    "MJ5",
    "C_e C_f C_g C_i C_n C_m",
    "C_e [N m], C_f [-], C_g [m^3], C_i [m^(2 - 3 C_n) s^(C_n - 2)], C_n [-] exponent, C_m [m^5/N].",
)
MJ6 = parameters(
    "MJ6",
    "C_e C_f C_g C_m C_i C_k",
    "C_e [N m], C_f [-], C_g [m^3], C_m [m^5/N], C_i [1/m^4], C_k [m^2].",
)
Huhtala14 = parameters(
    "Huhtala14",
    "a_0 a_1 a_2 a_3 b_0 b_1 b_2 b_3 c_0 c_1 c_2 p_0 p_1 p_2",
    "Four polynomials in |omega_m|: a_0..a_3 loss at no pressure [N m (s/rad)^i], b_0..b_3 slope of the first line and"
    " c_0..c_2 of the second [m^3 (s/rad)^i], p_0..p_2 pressure of the break [Pa (s/rad)^i].",
)
Huhtala28 = parameters(
    "Huhtala28",
    " ".join(f"{name}{of_D}" for of_D in ("", "D") for name in Huhtala14._fields),
    "Coefficients of `Huhtala14` as x + x_D D_m/D_max: first all x, then all x_D in the same units.",
)


@scalar
def wilson(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after Wilson (1948) [N m]: dry, viscous and constant; knows the full displacement only.

    .. math:: T_f = C_a D_{max}|\Delta p| + C_b \mu D_{max}|\omega| + C_c D_{max}

    Source: Moslatt 2020 paper A eq. 1. Differs from print: bars on dp_m.
    """
    return motor.D_max * (fit.C_a * abs(dp_m) + fit.C_b * motor.mu * abs(omega_m) + fit.C_c)


@scalar
def schlosser(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after Schlosser (1961) [N m]: Wilson's constant gives way to the acceleration of the oil.

    .. math:: T_f = C_a D_{max}|\Delta p| + C_b \mu D_{max}|\omega| + C_d D_{max}^{5/3}\rho\omega^2

    Source: Moslatt 2020 paper A eq. 2. Differs from print: bars on dp_m.
    """
    steady = motor.D_max * (fit.C_a * abs(dp_m) + fit.C_b * motor.mu * abs(omega_m))
    return steady + fit.C_d * power(motor.D_max, 5.0 / 3.0) * motor.rho * omega_m * omega_m


@scalar
def thoma(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after Thoma (1969) [N m]: Schlosser with the displacement in the acceleration of the oil.

    .. math:: T_f = C_a D_{max}|\Delta p| + C_b \mu D_{max}|\omega| + C_e \alpha_m^3 D_{max}^{5/3}\rho\omega^2

    Source: Moslatt 2020 paper A eq. 3; alpha_m = D_m / D_max. Differs from print: bars on dp_m.
    """
    steady = motor.D_max * (fit.C_a * abs(dp_m) + fit.C_b * motor.mu * abs(omega_m))
    size = power(motor.D_max, 5.0 / 3.0)
    return steady + fit.C_e * cube(D_m / motor.D_max) * size * motor.rho * omega_m * omega_m


@scalar
def swivel_factor(D_m, motor):
    r"""Pacey's :math:`(1 - \tan\alpha_{max}) / (1 - \tan\alpha)` with :math:`\sin\alpha =
    (D_m/D_{max})\sin\alpha_{max}` [-].

    Differs from print: paper A writes alpha for the relative displacement elsewhere. With it the factor has a pole at
    0.785 (tan = 1), inside the working range, so alpha is read as the swivel angle of a bent-axis motor, whose stroke
    goes as its sine.
    """
    s = D_m / motor.D_max * motor.sin_alpha
    return (1.0 - motor.tan_alpha) / (1.0 - s / sqrt(1.0 - s * s))


@scalar
def pacey(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after Pacey (1979) [N m]: Wilson with a factor of the swivel angle in the dry and viscous terms.

    .. math:: T_f = \left(C_a D_{max}|\Delta p| + C_b \mu|\omega| D_m\right)\frac{1 - \tan\alpha_{max}}{1 - \tan\alpha}
    + C_e

    Source: Moslatt 2020 paper A eq. 4. Differs from print: bars on dp_m; alpha is an angle, see `swivel_factor`.
    """
    moving = fit.C_a * motor.D_max * abs(dp_m) + fit.C_b * motor.mu * abs(omega_m) * D_m
    return moving * swivel_factor(D_m, motor) + fit.C_e


@scalar
def ortwig(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after Ortwig (2002) [N m]: an interpolation in speed, pressure and displacement; parameters may have
    either sign.

    .. math:: T_f = C_e + C_f\Delta p + C_g|\omega| + C_h|\omega|\Delta p + C_i\omega^2
              + C_j\alpha_m + C_k\alpha_m\Delta p + C_l\alpha_m|\omega|

    Source: Moslatt 2020 paper A eq. 5; alpha_m = D_m / D_max. Differs from print: bars on dp_m; the bare alpha of the
    last term is read as alpha_m.
    """
    n, p, alpha_m = abs(omega_m), abs(dp_m), D_m / motor.D_max
    fixed = fit.C_e + fit.C_f * p + fit.C_g * n + fit.C_h * n * p + fit.C_i * n * n
    return fixed + alpha_m * (fit.C_j + fit.C_k * p + fit.C_l * n)


@scalar
def notch_loss(omega_m, dp_m, C_k, motor):
    r"""Loss at the notches of the port plate [N m], :math:`C_k(|\Delta p|/|\omega|)\sqrt{|\Delta p|/\rho}`.

    It grows without bound towards standstill: below omega_low of the motor, where no map has data, it is held.
    """
    p = abs(dp_m)
    return C_k * p / maximum(abs(omega_m), motor.omega_low) * sqrt(p / motor.rho)


@scalar
def jeong(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after Jeong (2007) [N m], of a motor with fixed displacement.

    .. math:: T_f = C_e + C_f\Delta p + C_g\mu|\omega| + C_i\rho\omega^2 + C_k\frac{\Delta p}{|\omega|}\sqrt{\Delta
    p/\rho} + C_m\Delta p^2

    Source: Moslatt 2020 paper A eq. 6. Differs from print: the C_k term is held below omega_low; bars on dp_m.
    """
    smooth = fit.C_e + fit.C_f * abs(dp_m) + fit.C_g * motor.mu * abs(omega_m) + fit.C_i * motor.rho * omega_m * omega_m
    return smooth + notch_loss(omega_m, dp_m, fit.C_k, motor) + fit.C_m * dp_m * dp_m


@scalar
def mj3(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after modified Jeong 3 [N m]: MJ2 without friction at high pressure.

    .. math:: T_f = C_e + C_f\Delta p + C_g\mu|\omega| + C_i\rho\omega^2 D_m^3

    Source: Moslatt 2020 paper A eq. 9. Differs from print: bars on dp_m.
    """
    turbulent = fit.C_i * motor.rho * omega_m * omega_m * cube(D_m)
    return fit.C_e + fit.C_f * abs(dp_m) + fit.C_g * motor.mu * abs(omega_m) + turbulent


@scalar
def mj2(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after modified Jeong 2 [N m]: MJ1 without the notches of the port plate, so MJ3 and friction at high
    pressure.

    .. math:: T_f = C_e + C_f\Delta p + C_g\mu|\omega| + C_i\rho\omega^2 D_m^3 + C_m\Delta p^2

    Source: Moslatt 2020 paper A eq. 8. Differs from print: bars on dp_m.
    """
    return mj3(omega_m, D_m, dp_m, fit, motor) + fit.C_m * dp_m * dp_m


@scalar
def mj1(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after modified Jeong 1 [N m]: Jeong with the displacement in the turbulent term.

    .. math:: T_f = C_e + C_f\Delta p + C_g\mu|\omega| + C_m\Delta p^2 + C_i\rho\omega^2 D_m^3
              + C_k\frac{\Delta p}{|\omega|}\sqrt{\Delta p/\rho}

    Source: Moslatt 2020 paper A eq. 7. Differs from print: the C_k term is held below omega_low; bars on dp_m.
    """
    return mj2(omega_m, D_m, dp_m, fit, motor) + notch_loss(omega_m, dp_m, fit.C_k, motor)


@scalar
def mj4(omega_m, D_m, dp_m, fit, motor):
    """Torque loss after modified Jeong 4 [N m]: `stillhook.physics.hydraulics.motor.torque_loss` with the arguments of
    the others.

    Source: Moslatt 2020 paper A eq. 10, in the letters of eq. 2.12: X_1 = C_g mu, X_2 = C_i rho, X_3 = C_f, X_4 = C_e,
    X_5 = C_m.
    """
    return torque_loss(omega_m, D_m, dp_m, fit)


@scalar
def mj5(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after modified Jeong 5 [N m]: MJ4 with a free exponent, 2 for turbulent and 1 for laminar flow into
    the chambers.

    .. math:: T_f = C_e + C_f\Delta p D_m + C_g\mu|\omega| + C_i\rho|\omega|^{C_n}D_m^{C_n+1} + C_m\Delta p^2

    Source: Moslatt 2020 paper A eq. 11. Differs from print: bars on dp_m. The exponent of D_m is C_n + 1 (eq. 11; eq.
    14 prints C_n + 2): a pressure lost as the power C_n of the flow omega D costs D times as much torque, and C_n = 2
    is then MJ4. The text calls MJ3 its base, yet eq. 11 carries the terms of MJ4; its "C_o" is C_n.
    """
    dry = torque_loss_dry(D_m, dp_m, TorqueLossFit(X_1=0.0, X_2=0.0, X_3=fit.C_f, X_4=fit.C_e, X_5=fit.C_m))
    flow = fit.C_i * motor.rho * power(abs(omega_m), fit.C_n) * power(D_m, fit.C_n + 1.0)
    return dry + fit.C_g * motor.mu * abs(omega_m) + flow


@scalar
def mj6(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss after modified Jeong 6 [N m]: MJ4 and the notches of the port plate in proportion to the
    displacement.

    .. math:: T_f = C_e + C_f\Delta p D_m + C_g\mu|\omega| + C_m\Delta p^2 + C_i\rho\omega^2 D_m^3
              + C_k\frac{D_m\Delta p}{D_{max}|\omega|}\sqrt{\Delta p/\rho}

    Source: Moslatt 2020 paper A eq. 12. Differs from print: the C_k term is held below omega_low; bars on dp_m; it has
    six parameters, where table 1 prints five.
    """
    smooth = torque_loss(
        omega_m,
        D_m,
        dp_m,
        TorqueLossFit(X_1=fit.C_g * motor.mu, X_2=fit.C_i * motor.rho, X_3=fit.C_f, X_4=fit.C_e, X_5=fit.C_m),
    )
    return smooth + D_m / motor.D_max * notch_loss(omega_m, dp_m, fit.C_k, motor)


@scalar
def huhtala_14(omega_m, D_m, dp_m, fit, motor):
    r"""Torque loss as two straight lines over the pressure that meet at a break [N m]; fixed displacement.

    .. math:: T_f = a(n) + b(n)\min(|\Delta p|, p_x(n)) + c(n)\max(|\Delta p| - p_x(n), 0)

    Four polynomials in n = |omega_m|: a and b cubic, c and p_x quadratic, 4 + 4 + 3 + 3 = 14 parameters, of either
    sign.
    Source: our reading of Huhtala and Vilenius (1997). Moslatt 2020 paper A section 3.5 gives no equation, only "two
    line model" and "14 parameters distributed over four different curve fitted polynomials".
    """
    n, p = abs(omega_m), abs(dp_m)
    p_x = fit.p_0 + n * (fit.p_1 + n * fit.p_2)
    over = 0.5 * (p - p_x + abs(p - p_x))
    a = fit.a_0 + n * (fit.a_1 + n * (fit.a_2 + n * fit.a_3))
    b = fit.b_0 + n * (fit.b_1 + n * (fit.b_2 + n * fit.b_3))
    c = fit.c_0 + n * (fit.c_1 + n * fit.c_2)
    return a + b * (p - over) + c * over


_made: dict[str, Any] = {"Huhtala14": Huhtala14}
define(
    "def at_displacement(fit, alpha_m):\n    return Huhtala14("
    + ", ".join(f"fit.{x} + alpha_m * fit.{x}D" for x in Huhtala14._fields)
    + ")\n",
    _made,
    f"<Huhtala14 at a displacement of {__name__}>",
)
_at_displacement = scalar(_made["at_displacement"])


@scalar
def huhtala_28(omega_m, D_m, dp_m, fit, motor):
    """`huhtala_14` with every coefficient linear in D_m / D_max, so 28 parameters [N m].

    Source: our reading. Moslatt 2020 paper A table 1 prints 28 parameters for variable displacement; section 3.5 says
    how to adapt the model "is unclear".
    """
    return huhtala_14(omega_m, D_m, dp_m, _at_displacement(fit, D_m / motor.D_max), motor)
