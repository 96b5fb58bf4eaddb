"""The winch types that the engine knows. Whatever depends on the type asks here, so that an unknown one is refused
everywhere."""

from collections.abc import Mapping
from types import ModuleType

from stillhook.errors import SpecError
from stillhook.spec.crane import Crane, Plant
from stillhook.winches import active_passive, pure_active

PLANTS: Mapping[Plant, ModuleType] = {Plant.ACTIVE_PASSIVE: active_passive, Plant.PURE_ACTIVE: pure_active}
"""Plant module of each type."""


def plant_of(crane: Crane) -> ModuleType:
    """The plant of a crane's winch type. Errors: SpecError naming the types that there are."""
    if crane.plant not in PLANTS:
        known = " and ".join(PLANTS)
        raise SpecError(
            f'"{crane.name}": winch type "{crane.plant}" is unknown here. Known types: {known}. Choose another crane.'
        )
    return PLANTS[crane.plant]
