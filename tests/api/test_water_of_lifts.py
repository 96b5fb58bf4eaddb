"""Water that a lift may be in: fresh, of the sea, and brine; not oil, and nothing denser than any brine."""

import pytest
from pydantic import ValidationError

from stillhook.formats.lift.tables import WaterTable


@pytest.mark.parametrize("rho", [920.0, 1000.0, 1025.0, 1250.0])
def test_fresh_water_sea_and_brine_are_taken(rho):
    assert WaterTable(depth="300 m", rho=f"{rho} kg/m^3").rho == rho


@pytest.mark.parametrize("rho", [1.025, 850.0, 1350.0])
def test_oil_bitumen_and_tonnes_for_kilograms_are_refused(rho):
    with pytest.raises(ValidationError):
        WaterTable(depth="300 m", rho=f"{rho} kg/m^3")
