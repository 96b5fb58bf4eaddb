"""DC link of an electric winch: grid, store of supercapacitors, braking resistor."""

from typing import NamedTuple

from stillhook.physics.scalar import clip, scalar

LEAST_SHARE = 0.25
"""Part of its lowest energy at which a store is no longer followed down [-]: half its lowest voltage."""


class Store(NamedTuple):
    """i_C inverse capacitance [1/F]; R internal resistance [ohm]; E_low, E_high energies at the lowest and the highest
    voltage of the DC link, E_set what it is kept at [J]; i_band inverse of the energy over which limits come in at
    both ends [1/J]; i_tau rate at which the grid refills it [1/s]; P_max power of the store [W]."""

    i_C: float
    R: float
    E_low: float
    E_high: float
    E_set: float
    i_band: float
    i_tau: float
    P_max: float


class Grid(NamedTuple):
    """P_max largest power that the grid gives, P_back that it takes, P_resistor of the braking resistor [W]."""

    P_max: float
    P_back: float
    P_resistor: float


def energy(C: float, V: float) -> float:
    """Energy of a capacitance C [F] at a voltage V [V]: C V^2 / 2 [J]."""
    return 0.5 * C * V * V


@scalar
def above_low(E, store):
    """Share of the store's power that is left to discharge [-]: 1 from a band above its lowest energy, 0 at it."""
    return clip((E - store.E_low) * store.i_band, 0.0, 1.0)


@scalar
def below_high(E, store):
    """Share of the store's power that is left to charge [-]: 1 up to its highest energy, 0 a band above it."""
    return clip(1.0 - (E - store.E_high) * store.i_band, 0.0, 1.0)


@scalar
def grid_power(P_dc, E, store, grid):
    """Power from the grid [W], negative: fed back. It refills the store slowly, and carries the winch's own power P_dc
    [W] in the second band above the store's lowest energy."""
    share = clip(2.0 - (E - store.E_low) * store.i_band, 0.0, 1.0)
    return clip((store.E_set - E) * store.i_tau + share * P_dc, -grid.P_back, grid.P_max)


@scalar
def resistor_power(E, store, grid):
    """Power that the braking resistor burns [W]: all of it at the store's highest energy, none a band below it."""
    return grid.P_resistor * clip(1.0 + (E - store.E_high) * store.i_band, 0.0, 1.0)


@scalar
def store_loss(P, E, store):
    r"""Loss inside the store [W] at the power P at its terminals [W].

    .. math:: P_R = R (P/V)^2 = R\,C P^2 / (2 E)

    Valid where it is small beside P.
    """
    least = LEAST_SHARE * store.E_low
    return 0.5 * store.R * P * P / (store.i_C * (E if E > least else least))


@scalar
def supply_limit(E, store, grid):
    """Power that the DC link can give the winch [W]."""
    return grid.P_max + above_low(E, store) * store.P_max


@scalar
def take_limit(E, store, grid):
    """Power that the DC link can take back from the winch [W]."""
    return grid.P_back + grid.P_resistor + below_high(E, store) * store.P_max
