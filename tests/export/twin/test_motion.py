"""Position, speed and acceleration of the tip that are not one motion are told; those that are never are."""

from collections.abc import Callable

import numpy as np
import pytest
from tests.export.twin.host import OK, Host

import stillhook
from stillhook.export.twin import CONTENTS, Export, export
from stillhook.export.twin.generate import CONTROLLER

SPEED = "position and speed of the tip are not one motion"
ACCELERATION = "speed and acceleration of the tip are not one motion"


@pytest.fixture(scope="module")
def made() -> Export:
    return exported("plant+controller")


def exported(contents: str) -> Export:
    case = stillhook.Scenario(load="100 t", s_w="100 m", mode="ssc", tip="still", duration="10 s", warm_up="0 s")
    return export(stillhook.load_crane("nov-250t"), case, contents)


def sine(period: float, amplitude: float) -> Callable[[np.ndarray], np.ndarray]:
    w = 2.0 * np.pi / period
    return lambda t: amplitude * np.array([np.sin(w * t), w * np.cos(w * t), -(w**2) * np.sin(w * t)])


def waves(t: np.ndarray) -> np.ndarray:
    """Many waves about 7 s, with a slow drift of the position that the speed has too."""
    rng = np.random.default_rng(7)
    parts = [(T, rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.02, 0.2)) for T in np.linspace(3.0, 16.0, 25)]
    rows = sum(
        a * np.array([np.sin(w * t + p), w * np.cos(w * t + p), -(w**2) * np.sin(w * t + p)])
        for T, p, a in parts
        for w in (2.0 * np.pi / T,)
    )
    return np.asarray(rows) + np.array([0.002 * t, np.full_like(t, 0.002), np.zeros_like(t)])


def told(made: Export, compiled, motion: np.ndarray, h: float, *, ahead: bool) -> list[str]:
    """What the host is told after each step."""
    host, alone = Host(made, compiled, "-O2"), made.contents == CONTROLLER
    names = [f"sensed_{name}" if alone else name for name in ("s_tip", "v_tip", "a_tip")]
    host.set(**({} if alone else {"input_time": 0 if ahead else 1}), **dict(zip(names, motion.T[0], strict=True)))
    assert host.start() == OK
    found = []
    for k in range(motion.shape[1] - 1):
        host.set(**dict(zip(names, motion.T[k + 1 if ahead else k], strict=True)))
        assert host.step(k * h, h) == OK
        found.append(host.text("contradiction"))
        assert host.get("one_motion") == (found[-1] == "")
    return found


@pytest.mark.long
@pytest.mark.parametrize("ahead", [True, False])
@pytest.mark.parametrize("h", [0.01, 0.1, 0.5])
def test_a_motion_that_is_one_is_never_doubted(made, compiled, h, ahead):
    t = np.arange(0.0, 60.0, h)
    for rows in (sine(4.0, 0.5)(t), sine(16.0, 3.0)(t), waves(t), 0.0 * waves(t), np.round(waves(t), 2)):
        assert not any(told(made, compiled, rows, h, ahead=ahead))


def only_position(rows: np.ndarray) -> np.ndarray:
    return rows * np.array([[1.0], [0.0], [0.0]])


def only_speed(rows: np.ndarray) -> np.ndarray:
    return rows * np.array([[0.0], [1.0], [1.0]])


def down(rows: np.ndarray) -> np.ndarray:
    return rows * np.array([[1.0], [-1.0], [-1.0]])


def centimetres(rows: np.ndarray) -> np.ndarray:
    return rows * np.array([[1.0], [100.0], [100.0]])


def late(rows: np.ndarray) -> np.ndarray:
    return np.array([rows[0], np.roll(rows[1], 15), np.roll(rows[2], 15)])  # 1.5 s of 0.1 s


@pytest.mark.long
@pytest.mark.parametrize("ahead", [True, False])
@pytest.mark.parametrize("wrong", [only_position, only_speed, down, centimetres, late])
def test_what_contradicts_is_told_within_twenty_seconds_and_until_it_ends(made, compiled, wrong, ahead):
    t = np.arange(0.0, 150.0, 0.1)
    rows = waves(t)
    rows[:, t < 60.0] = wrong(rows)[:, t < 60.0]
    found = told(made, compiled, rows, 0.1, ahead=ahead)
    assert all(text == SPEED for text in found[200:590])
    assert found[-1] == ""


def test_no_acceleration_is_told_of_the_speed(made, compiled):
    rows = waves(np.arange(0.0, 40.0, 0.1)) * np.array([[1.0], [1.0], [0.0]])
    assert told(made, compiled, rows, 0.1, ahead=True)[-1] == ACCELERATION


def test_a_datum_that_the_start_did_not_have_is_told(made, compiled):
    rows = waves(np.arange(0.0, 40.0, 0.1))
    rows[0, 1:] += 20.0
    assert SPEED in told(made, compiled, rows, 0.1, ahead=True)


@pytest.mark.long
@pytest.mark.parametrize("contents", [c for c in CONTENTS if c != "plant+controller"])
def test_winch_and_controller_alone_tell_it_too(contents, compiled):
    rows = waves(np.arange(0.0, 40.0, 0.1))
    alone = exported(contents)
    assert not any(told(alone, compiled, rows, 0.1, ahead=contents != CONTROLLER))
    assert told(alone, compiled, only_position(rows), 0.1, ahead=contents != CONTROLLER)[-1] == SPEED
