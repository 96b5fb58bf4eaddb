"""DC link of an electric winch: grid, store of supercapacitors, braking resistor.

The store is on the link. Grid and braking resistor go by its energy E, from its lowest voltage upwards:

- the grid keeps E at E_set, slowly, and droops to its full power either way in the second band from each end;
- the resistor comes in over the band below the highest voltage, and the store lets go over it as over the lowest;
- what the store cannot give or take at once is the grid's, then the resistor's; the winch is held to the rest.
"""

from typing import NamedTuple

from stillhook.physics.scalar import clip, fmax, fmin, scalar, sqrt

LEAST_SHARE = 0.25
"""Part of its lowest energy at which a store is no longer followed down [-]: half its lowest voltage."""
COOLING = 0.1
"""Part of a resistor's temperature rise over which its power falls to what it burns for ever [-]. Assumed."""
LEAST_R = 1.0e-9
"""Internal resistance below which a store has none [ohm]."""


class Store(NamedTuple):
    """i_C inverse capacitance [1/F]; R internal resistance [ohm]; E_low, E_high energies at the lowest and the highest
    voltage V_low, V_high [V], E_set what it is kept at [J]; i_band inverse of the energy over which limits come in at
    both ends [1/J]; i_tau rate at which the grid refills it [1/s]; P_max power [W] and I_max current [A] of the
    store, either way."""

    i_C: float
    R: float
    E_low: float
    E_high: float
    E_set: float
    V_low: float
    V_high: float
    i_band: float
    i_tau: float
    P_max: float
    I_max: float


class Grid(NamedTuple):
    """P_max largest power that the grid gives, P_back that it takes, P_resistor of the braking resistor for a while,
    P_rated for ever [W]; i_rated inverse of the latter [1/W], 0 without a resistor; i_tau inverse of its thermal time
    constant [1/s]."""

    P_max: float
    P_back: float
    P_resistor: float
    P_rated: float
    i_rated: float
    i_tau: float


def energy(C: float, V: float) -> float:
    """Energy of a capacitance C [F] at a voltage V [V]: C V^2 / 2 [J]."""
    return 0.5 * C * V * V


@scalar
def open_voltage(E, store):
    r"""Voltage of the store without current [V]: :math:`\sqrt{2 E/C}`."""
    return sqrt(2.0 * store.i_C * fmax(E, LEAST_SHARE * store.E_low))


@scalar
def above_low(E, store):
    """Share of the store's power that is left to discharge [-]: 1 from a band above its lowest energy, 0 at it."""
    return clip((E - store.E_low) * store.i_band, 0.0, 1.0)


@scalar
def below_high(E, store):
    """Share of the store's power that is left to charge [-]: 1 up to a band below its highest energy, 0 at it."""
    return clip((store.E_high - E) * store.i_band, 0.0, 1.0)


@scalar
def store_gives(E, store):
    """Largest power that the store gives the link [W]: by its power, its current, and the lowest voltage of the link,
    which is below that of the store by R I."""
    V, R = open_voltage(E, store), fmax(store.R, LEAST_R)
    I = fmin(store.I_max, fmin(fmax(V - store.V_low, 0.0) / R, 0.5 * V / R))
    return above_low(E, store) * fmin(store.P_max, (V - R * I) * I)


@scalar
def store_takes(E, store):
    """Largest power that the store takes from the link [W]: by its power, its current, and the highest voltage of the
    link, which is above that of the store by R I."""
    V, R = open_voltage(E, store), fmax(store.R, LEAST_R)
    I = fmin(store.I_max, fmax(store.V_high - V, 0.0) / R)
    return below_high(E, store) * fmin(store.P_max, (V + R * I) * I)


@scalar
def store_current(P, E, store):
    r"""Current into the store [A] at the power P into its terminals [W], either sign.

    .. math:: P = (V + R I) I,\quad I = \frac{2 P}{V + \sqrt{V^2 + 4 R P}}

    Its link is at V + R I and it loses R I^2.
    """
    V = open_voltage(E, store)
    return 2.0 * P / (V + sqrt(fmax(V * V + 4.0 * store.R * P, 0.0)))


@scalar
def resistor_most(heat, grid):
    """Largest power that the braking resistor burns now [W]; heat temperature rise over the highest that it may have
    [-]. Close to that its power falls to what it burns for ever."""
    return grid.P_rated + (grid.P_resistor - grid.P_rated) * clip((1.0 - heat) / COOLING, 0.0, 1.0)


@scalar
def chopped(E, store, grid):
    """Power that the resistor is to burn by the voltage of the store alone [W]: all at its highest energy, none a band
    below it."""
    return grid.P_resistor * clip(1.0 - (store.E_high - E) * store.i_band, 0.0, 1.0)


@scalar
def resistor_demand(P_dc, E, store, grid):
    """Power that is to be burnt [W]: by the voltage of the store, or what neither store nor grid take of P_dc, the
    power of the winch [W]."""
    return fmax(chopped(E, store, grid), -P_dc - grid.P_back - store_takes(E, store))


@scalar
def resistor_power(P_dc, E, heat, store, grid):
    """Power that the braking resistor burns [W]."""
    return fmin(resistor_demand(P_dc, E, store, grid), resistor_most(heat, grid))


@scalar
def resistor_heating_rate(heat, P, grid):
    r"""Rate of the resistor's temperature rise over the highest that it may have [1/s]; P burnt [W].

    .. math:: \tau\dot h = P/P_{rated} - h
    """
    return grid.i_tau * (P * grid.i_rated - heat)


def resistor_rate(grid: Grid) -> float:
    """Fastest rate of its temperature [1/s], where its power falls with it."""
    return grid.i_tau * (1.0 + (grid.P_resistor - grid.P_rated) * grid.i_rated / COOLING)


@scalar
def droop(E, store, grid):
    """Power that the grid gives by the store's energy alone [W]: slowly towards E_set, all it can from a band above the
    lowest energy down, all that it takes back from a band below the highest up."""
    low = clip(2.0 - (E - store.E_low) * store.i_band, 0.0, 1.0)
    high = clip(2.0 - (store.E_high - E) * store.i_band, 0.0, 1.0)
    return (store.E_set - E) * store.i_tau + low * grid.P_max - high * grid.P_back


@scalar
def grid_power(P_dc, P_resistor, E, store, grid):
    """Power from the grid [W], negative: fed back. It follows `droop`, and gives or takes what the store cannot of P_dc
    [W] of the winch and P_resistor [W]."""
    P = P_dc + P_resistor
    wanted = fmin(fmax(droop(E, store, grid), P - store_gives(E, store)), P + store_takes(E, store))
    return clip(wanted, -grid.P_back, grid.P_max)


@scalar
def supply_limit(E, heat, store, grid):
    """Power that the DC link can give the winch, never negative [W]: that of grid and store, less what is burnt."""
    burnt = fmin(chopped(E, store, grid), resistor_most(heat, grid))
    return fmax(grid.P_max + store_gives(E, store) - burnt, 0.0)


@scalar
def take_limit(E, heat, store, grid):
    """Power that the DC link can take back from the winch [W]."""
    return grid.P_back + resistor_most(heat, grid) + store_takes(E, store)
