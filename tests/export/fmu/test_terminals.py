"""Ports that belong together are one terminal, so that a host connects them by one line."""

from types import SimpleNamespace

import pytest

from stillhook.export.fmu.description import groups


def terminals(*ports: str) -> dict[str, list[str]]:
    export = SimpleNamespace(ports=[SimpleNamespace(name=name) for name in ports])
    return {group.name: list(group.members.values()) for group in groups(export)}


@pytest.mark.parametrize(
    ("name", "pair"),
    [("operator", ["v_op", "mode"]), ("load", ["s_load", "v_load"]), ("sensed", ["sensed_p_a", "sensed_F"])],
)
def test_two_ports_that_belong_together_are_a_terminal_and_one_alone_is_none(name, pair):
    assert terminals(*pair) == {name: pair}
    assert terminals(pair[0]) == {}
    assert terminals(pair[0], "s_w") == {}


def test_a_port_is_in_one_terminal_at_most_and_members_that_are_not_there_are_left_out():
    found = terminals("s_tip", "v_tip", "F_w", "s_w", "v_w", "u_p", "brake", "p_a")
    assert found == {"crane_tip": ["s_tip", "v_tip"], "wire": ["F_w", "s_w", "v_w"], "commands": ["u_p", "brake"]}
