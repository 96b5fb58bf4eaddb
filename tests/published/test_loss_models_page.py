"""The table of docs/explanation/loss-models.md, computed again: one case by every model of the motors' loss."""

import functools
import re

import numpy as np
import pytest
from tests.engine.test_loss_models import model_of, with_model
from tests.scripts import DOCS

from stillhook import Scenario, load_crane, simulate
from stillhook.identify.motor.fit import LossModel, fit_loss
from stillhook.identify.motor.map import read_map
from stillhook.identify.motor.rank import rank_losses
from stillhook.library.examples import MOTOR_MAP
from stillhook.winches.circuits.losses import LossName, TorqueLoss

PAGE = (DOCS / "explanation" / "loss-models.md").read_text(encoding="utf-8")
ROWS = dict(re.findall(r"^\| ([\w ]+) \| ((?:-|[\d.]+) \| [\d.]+ \| -[\d.]+ \| [\d.]+) \|$", PAGE, re.MULTILINE))
CASE = Scenario(load="60 t", s_w="200 m", tip="sine 2 m 10 s", mode="ssc", duration="40 s")


@functools.cache
def pressures(law: str) -> np.ndarray:
    """Of the active circuit, with the model that is fitted to the example's map [bar]."""
    example, crane = read_map(MOTOR_MAP), load_crane("nov-150t")
    if law == "mj4":
        values = zip((f"X_{i}" for i in range(1, 6)), fit_loss(example, law).values.tolist(), strict=True)
        loss = TorqueLoss.model_construct(None, **dict(values))
        motors = {
            n: c.model_copy(update={"motor": c.motor.model_copy(update={"loss": loss})})
            for n, c in crane.circuits.items()
        }
        machine = crane.model_copy(update=motors)
    else:
        machine = with_model(crane, model_of(law, example))
    run = simulate(machine, CASE, series=True, every="50 ms")
    found: np.ndarray = (run.p_a - run.p_b).sel(time=slice(20.0, 40.0)).values / 1e5
    return found


def test_the_page_has_every_model_that_a_crane_file_takes():
    assert {name.lower().replace(" ", "-") for name in ROWS} == {str(law.value) for law in LossName}


@pytest.mark.long
@pytest.mark.parametrize(
    "name", [n if n in ("map", "MJ6") else pytest.param(n, marks=pytest.mark.thorough) for n in ROWS]
)
def test_a_row_of_the_page_is_what_the_twin_gives(name):
    law = name.lower().replace(" ", "-")
    dp = pressures(law)
    rms = float(np.sqrt(np.mean((dp - pressures("map")) ** 2)))
    found = [f"{dp.max():.1f}", f"{dp.min():.1f}", f"{rms:.1f}" if law != "map" else "0"]
    if law == "map":
        found.insert(0, "-")
    else:
        m = read_map(MOTOR_MAP)
        found.insert(0, f"{100.0 * rank_losses(m)[LossModel(law)].cv:.2f}")
    assert ROWS[name] == " | ".join(found)
