"""Commands given as a record: the winch obeys them in place of its PLC."""

import numpy as np
import pytest

from stillhook import Scenario, load_crane, simulate
from stillhook.errors import ScenarioError
from stillhook.spec.scenario import Commands


def run(crane: str, **more: object):
    case = Scenario(load="100 t", s_w="487 m", tip="sine 1 m 10 s", duration="40 s", warm_up="10 s", mode="ssc", **more)
    return simulate(load_crane(crane), case, every="10 ms")


@pytest.mark.parametrize("crane", ["nov-250t", "nov-100t-pure-active"])
def test_a_run_driven_by_its_own_commands_is_the_same_run(crane: str) -> None:
    one = run(crane)
    commands = Commands(one["time"].values, one["u_p"].values, one["u_m"].values)
    two = run(crane, commands=commands)
    for name in ("p_a", "p_b", "omega_m", "s_w", "alpha_m", "F_w"):
        assert np.array_equal(one[name].values, two[name].values), name


def test_given_commands_hold_until_the_next_one() -> None:
    commands = Commands([0.0, 5.0], [0.3, -0.2], [1.0, 0.8])
    assert commands.at([0.0, 4.999, 5.0, 9.0])[0].tolist() == [0.3, 0.3, -0.2, -0.2]
    case = Scenario(load="100 t", s_w="487 m", commands=commands, mode="manual", warm_up="1 s")
    assert case.duration == 5.0
    out = simulate(load_crane("nov-250t"), case, every="10 ms")
    assert out["u_p"].values[:-1] == pytest.approx(0.3)
    assert out["v_w"].values[300:490].min() > 0.1


def test_commands_survive_the_way_into_a_result_and_back() -> None:
    case = Scenario(
        load="100 t",
        s_w="487 m",
        commands=Commands([0.0, 5.0, 50.0], [0.1, -0.1, 0.0], [1.0, 0.8, 1.0], source="log 7"),
    )
    assert Scenario.from_dict(case.to_dict()) == case


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (
            ([0.0, 1.0], [0.1, 1.2], [1.0, 1.0]),
            "Commands: u_p = 1.2 at 1 s: allowed is -1 to 1. Scale it, or hold it in its range.",
        ),
        (([0.0, 0.0], [0.1, 0.2], [1.0, 1.0]), "Commands: times do not increase. Sort them and remove doubles."),
        (([0.0, 1.0], [0.1], [1.0, 1.0]), "Commands: 2 times, 1 u_p and 2 u_m. Give one of each for every time."),
        (
            ([0.0, np.nan], [0.1, 0.2], [1.0, 1.0]),
            "Commands: times are not one finite number a sample. Leave the gaps out, or fill them.",
        ),
        (([0.0, 1.0], ["a", "b"], [1.0, 1.0]), "Commands: u_p are not numbers. Give one number a sample."),
    ],
)
def test_a_record_of_commands_that_cannot_be_obeyed_is_refused(
    columns: tuple[list[float | str], ...], said: str
) -> None:
    with pytest.raises(ScenarioError) as error:
        Commands(*columns)
    assert str(error.value) == said
