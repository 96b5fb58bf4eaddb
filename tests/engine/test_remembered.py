"""What is remembered of a frozen object belongs to that object, and to no other that is equal to it."""

import gc

from stillhook.base.kept.identity import remembered


class Machine:
    def __init__(self, name: str) -> None:
        self.name = name

    def __eq__(self, other: object) -> bool:
        raise AssertionError("fields are compared")

    __hash__ = None  # type: ignore[assignment]


def test_an_object_is_asked_once_and_never_compared() -> None:
    asked: list[str] = []

    @remembered
    def named(machine: Machine, suffix: str = "") -> str:
        asked.append(machine.name)
        return machine.name + suffix

    a, b = Machine("a"), Machine("a")
    assert [named(a), named(a), named(a, "!"), named(b)] == ["a", "a", "a!", "a"]
    assert asked == ["a", "a", "a"]


def test_an_object_that_is_gone_lends_its_place_to_no_other() -> None:
    """The identity of an object is free for another once it is collected."""

    @remembered
    def name(machine: Machine) -> str:
        return machine.name

    for i in range(1000):
        assert name(Machine(str(i))) == str(i)
        gc.collect(0)
