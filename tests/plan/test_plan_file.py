"""Plan files: what a file says comes out in SI, what it leaves out follows from the rest, and what cannot be is refused in one line."""

from __future__ import annotations

import math
import shutil
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

from stillhook.errors import StillhookError
from stillhook.plan.definition.rules import ALTERNATIVES, Alternative, usual_alternatives
from stillhook.plan.file import copy_plan, load_plan, plans
from stillhook.plan.limits import limited
from stillhook.winches.registry import WINCH_TYPES

pytestmark = pytest.mark.slow

PLAN = """\
name = "Manifold to 300 m"
crane = "nov-250t"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
start_depth = "-4 m"
alternatives = ["none", "ssc"]

[tip]
at = "x=-15 m, y=-24 m, z=36 m"

[water]
depth = "300 m"

[environment]
Hs = ["1 m", "2 m"]
Tp = ["6 s", "9 s"]
headings = ["180 deg"]

[operation]
T_POP = "4 h"

[[phase]]
name = "lift-off"
kind = "lift-off"

[[phase]]
name = "over the side"
kind = "in-air"

[[phase]]
name = "splash"
kind = "splash-zone"

[[phase]]
name = "down"
kind = "lowering"

[[phase]]
name = "deep"
kind = "deep"

[[phase]]
name = "landing"
kind = "landing"
"""


def written(folder: Path, *changes: tuple[str, str]) -> Path:
    """A plan file with texts exchanged; each must be there."""
    text = PLAN
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "plan.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_every_plan_of_the_library_can_be_read() -> None:
    assert "template-to-1500m" in plans()
    for name in plans():
        assert load_plan(name).phases


def test_the_example_is_the_lift_that_it_says() -> None:
    plan = load_plan("template-to-1500m")
    assert (plan.crane.name, plan.payload.mass, plan.depth) == ("nov-250t", 120e3, 1500.0)
    assert len(plan.environment.table()) == 12 * 10 * 3
    assert plan.alternatives == ALTERNATIVES


def test_strong_ssc_is_no_alternative_by_default_where_there_is_no_closed_circuit():
    crane = SimpleNamespace(circuits={}, plant=SimpleNamespace(type=WINCH_TYPES["pure-active"]))
    by_default = usual_alternatives(crane)
    assert set(ALTERNATIVES) - set(by_default) == {Alternative.STRONG_SSC}


def test_phases_join_and_reach_the_seabed_without_a_height_given_but_the_deck(tmp_path: Path) -> None:
    phases = [phase for phase in load_plan(written(tmp_path)).phases if not phase.name.endswith(", held")]
    assert all(a.z_end == b.z_start for a, b in pairwise(phases))
    assert phases[0].z_start == 4.0
    assert phases[-1].z_end == -300.0
    assert all(phase.duration is not None and phase.duration > 0.0 for phase in phases)


def test_durations_are_way_over_speed_where_the_payload_moves(tmp_path: Path) -> None:
    plan = load_plan(
        written(tmp_path, ('kind = "splash-zone"', 'kind = "splash-zone"\ndepth = "29 m"\nspeed = "18 m/min"'))
    )
    splash = plan.phase("splash")
    assert splash.duration == pytest.approx(36.0 / 0.3)


def test_a_duration_beyond_the_way_is_taken_as_given(tmp_path: Path) -> None:
    assert (
        load_plan(written(tmp_path, ('kind = "landing"', 'kind = "landing"\nplanned = "20 min"')))
        .phase("landing")
        .duration
        == 1200.0
    )


def test_a_recovery_joins_upwards_to_the_deck(tmp_path: Path) -> None:
    rows = PLAN[: PLAN.index("[[phase]]")] + "".join(
        f'[[phase]]\nname = "{name}"\nkind = "{kind}"\n{more}\n'
        for name, kind, more in (
            ("off", "seabed-lift-off", ""),
            ("up", "lowering", ""),
            ("out", "splash-zone", ""),
            ("in", "in-air", 'depth = "-7 m"'),
            ("down", "set-down", 'depth = "-4 m"'),
        )
    )
    path = tmp_path / "up.toml"
    path.write_text(rows.replace('start_depth = "-4 m"\n', ""))
    plan = load_plan(path)
    assert [
        phase.z_start is not None and phase.z_end is not None and phase.z_end > phase.z_start for phase in plan.phases
    ] == [
        True,
        True,
        True,
        True,  # out of the water, held
        True,
        False,
    ]
    assert (plan.phases[0].z_start, plan.phases[-1].z_end) == (-300.0, 4.0)


def test_a_payload_is_also_held_half_an_hour_on_its_way_through_the_surface(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path))
    passage, held = plan.phase("splash"), plan.phase("splash, held")
    assert plan.phases.index(held) == plan.phases.index(passage) + 1
    assert (held.z_start, held.z_end, held.mode, held.kind) == (
        passage.z_start,
        passage.z_end,
        passage.mode,
        passage.kind,
    )
    assert (held.duration, held.speed, held.held) == (1800.0, None, True)
    assert [phase.name for phase in plan.phases if phase.held] == ["splash, held"]


def test_rules_and_limits_of_a_passage_are_those_of_its_hold(tmp_path: Path) -> None:
    own = 'kind = "splash-zone"\nlimits = { slack-sling = "0.2", snap-load = "off" }'
    plan = load_plan(written(tmp_path, ('kind = "splash-zone"', own)))
    passage, held = (
        {each.rule.key: each.limit for each in limited(plan, plan.phase(name), Alternative.NONE)}
        for name in ("splash", "splash, held")
    )
    share = held.pop("relief-time")  # of a passage of minutes one opening of a valve would be more
    assert (share, passage) == (0.001, held)
    assert held["slack-sling"] == 0.2
    assert "snap-load" not in held


@pytest.mark.parametrize(("text", "time"), [("off", None), ("0 min", None), ("12 min", 720.0)])
def test_a_plan_says_how_long_the_payload_is_held(tmp_path: Path, text: str, time: float | None) -> None:
    plan = load_plan(written(tmp_path, ('kind = "splash-zone"', f'kind = "splash-zone"\nhold = "{text}"')))
    assert [phase.duration for phase in plan.phases if phase.held] == ([] if time is None else [time])


def test_a_set_of_rules_says_how_long_the_payload_is_held(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('base = "offshore-lift"\nversion = "1"\n[simplified]\nhold = "10 min"\n')
    plan = load_plan(written(tmp_path, ('payload = "', 'rules = "mine.toml"\npayload = "')))
    assert plan.phase("splash, held").duration == 600.0


def test_a_range_holds_both_ends_and_equals_its_list(tmp_path: Path) -> None:
    ranged = load_plan(written(tmp_path, ('["1 m", "2 m"]', '"1 m to 2 m by 25 cm"'))).environment.Hs
    listed = load_plan(
        written(tmp_path, ('["1 m", "2 m"]', '["2 m", "1 m", "1.25 m", "1.5 m", "1.75 m"]'))
    ).environment.Hs
    assert ranged == pytest.approx(listed)
    assert ranged == pytest.approx((1.0, 1.25, 1.5, 1.75, 2.0))


def test_the_time_of_the_operation_is_that_of_the_phases_where_none_is_given(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path, ('[operation]\nT_POP = "4 h"\n', "")))
    assert plan.T_POP == pytest.approx(sum(phase.duration or 0.0 for phase in plan.phases if not phase.held))
    assert "T_POP" in plan.notes[0]


def test_ideal_sensors_are_told_until_the_file_says_what_they_are(tmp_path: Path) -> None:
    assert any("sensors are taken as ideal" in note for note in load_plan(written(tmp_path)).notes)
    times = 'lead = "2 h"\nT_C = "8 h"'
    said = load_plan(written(tmp_path, ("[operation]", f'[sensors]\ndelay = "50 ms"\n[operation]\n{times}')))
    assert said.sensors.delay == 0.05
    assert not said.notes


def test_motions_for_deep_water_are_doubted_in_shallow_water(tmp_path: Path) -> None:
    assert not any("shallow" in note for note in load_plan(written(tmp_path)).notes)
    shallow = load_plan(written(tmp_path, ('"300 m"', '"60 m"'), ('"9 s"]', '"14 s"]')))
    assert any("shallow to waves of 14 s" in note for note in shallow.notes)


def test_a_boom_gives_the_tip_that_its_angles_say(tmp_path: Path) -> None:
    boom = '[boom]\npedestal = ["-15 m", "-9 m", "19 m"]\nslew = "270 deg"\nmain = ["30 m", "45 deg"]\n'
    plan = load_plan(written(tmp_path, ('[tip]\nat = "x=-15 m, y=-24 m, z=36 m"\n', boom)))
    reach = 30.0 * math.sqrt(0.5)
    assert (plan.at.x, plan.at.y, plan.h_tip) == pytest.approx((-15.0, -9.0 - reach, 19.0 + reach))


def test_a_phase_may_have_a_tip_of_its_own_at_the_height_of_the_plan(tmp_path: Path) -> None:
    plan = load_plan(written(tmp_path, ('kind = "lift-off"', 'kind = "lift-off"\ntip = "x=-30 m, y=0 m"')))
    assert plan.tip_of(plan.phase("lift-off")) == type(plan.at)(-30.0, 0.0, 36.0)
    assert plan.tip_of(plan.phase("deep")) == plan.at


def test_files_are_seen_from_the_folder_of_the_plan(tmp_path: Path) -> None:
    copied = copy_plan("template-to-1500m", tmp_path / "mine")
    plan, original = load_plan(copied[0]), load_plan("template-to-1500m")
    assert plan.digest == original.digest
    text = copied[1].read_text()
    copied[1].write_text(text.replace('"120 t"', '"110 t"').replace('"68 t"', '"58 t"'))
    assert load_plan(copied[0]).weight.payload.mass == 110e3
    with pytest.raises(StillhookError, match="is there already"):
        copy_plan("template-to-1500m", tmp_path / "mine")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('depth = "300 m"', 'depth = "301 m"'),
        ("y=-24 m", "y=-23 m"),
        ('T_POP = "4 h"', 'T_POP = "5 h"'),
        ('["6 s", "9 s"]', '["6 s", "10 s"]'),
        ('kind = "landing"', 'kind = "landing"\nspeed = "7 m/min"'),
        ('"manifold-60t"', '"spool-20t"'),
    ],
)
def test_the_digest_changes_with_what_numbers_follow_from(tmp_path: Path, old: str, new: str) -> None:
    assert load_plan(written(tmp_path, (old, new))).digest != load_plan(written(tmp_path)).digest


def test_the_digest_does_not_change_with_names(tmp_path: Path) -> None:
    assert load_plan(written(tmp_path, ("Manifold to 300 m", "Other"))).digest == load_plan(written(tmp_path)).digest


BAD = [
    # old, new, what the line must say
    (
        '"manifold-60t"',
        '{ name = "x", mass = "260 t", shape = "plate", length = "9 m", width = "9 m", height = "1 m" }',
        ["260 t", "SWL", "250 t"],
    ),
    ('depth = "300 m"', 'depth = "3000 m"', ["landing", "wire", "nov-250t"]),
    ('payload = "manifold-60t"', 'payload = { name = "x", mass = "60" }', ["levels", "shape"]),
    ('["none", "ssc"]', '["ssc", "ssc"]', ["ssc", "twice"]),
    ('at = "x=-15 m, y=-24 m, z=36 m"', 'at = "x=-15 m, y=-24 m"', ["height", "missing"]),
    ('at = "x=-15 m, y=-24 m, z=36 m"', 'height = "36 m"', ["place is missing"]),
    ('at = "x=-15 m, y=-24 m, z=36 m"', 'motion = "sine 1 m 9 s"', ["motion", "tip.at"]),
    ('z=36 m"', 'z=20 m"', ["lift-off", "crane tip"]),
    ('Hs = ["1 m", "2 m"]', 'Hs = "1 to 2 m"', ["environment.Hs"]),
    ('Hs = ["1 m", "2 m"]', 'Hs = "1 m to 2 m by 0.3 m"', ["environment.Hs", "do not meet"]),
    ('Hs = ["1 m", "2 m"]', 'Hs = "1 m to 2 m by 1 mm"', ["environment.Hs", "larger steps"]),
    ('Hs = ["1 m", "2 m"]', 'Hs = "2 m to 1 m by 0.5 m"', ["environment.Hs", "must increase"]),
    ('Hs = ["1 m", "2 m"]', 'Hs = ["1 m", "1 m"]', ["environment.Hs", "twice"]),
    ('Hs = ["1 m", "2 m"]', 'Hs = ["0 m", "1 m"]', ["environment.Hs", "0.05 m"]),
    ('Hs = ["1 m", "2 m"]', 'Hs = ["200 m"]', ["environment.Hs", "20 m"]),
    ('Tp = ["6 s", "9 s"]', 'Tp = ["6 min"]', ["environment.Tp", "30 s"]),
    ('headings = ["180 deg"]', 'headings = ["0 deg", "360 deg"]', ["environment.headings", "twice"]),
    ('headings = ["180 deg"]', 'headings = ["-30 deg"]', ["environment.headings", "-30 deg"]),
    ('T_POP = "4 h"', 'T_POP = "10 min"', ["T_POP", "phases alone take"]),
    ('T_POP = "4 h"', 'T_POP = "4 h"\n[weather]\nfile = "north-sea"', ["weather.file", "north-sea", "SYNTHETIC"]),
    (
        'T_POP = "4 h"',
        'T_POP = "4 h"\n[weather]\nfile = "SYNTHETIC-norwegian-sea"\nsense = "from"',
        ["weather.sense", "coming-from"],
    ),
    ('start_depth = "-4 m"\n', "", ["start_depth", "missing", "deck"]),
    ('"-4 m"', '"4 m"', ["lift-off", "above the water"]),
    ('kind = "lift-off"', 'kind = "lift-off"\ndepth = "-3 m"', ["lift-off", "goes up"]),
    ('kind = "lift-off"', 'kind = "lift-off"\nmode = "ahc"', ["lift-off", "ahc", "manual"]),
    ('kind = "lift-off"', 'kind = "lift-off"\ntip = "x=-15 m, y=-2 m, z=12 m"', ["lift-off", "crane tip"]),
    ('kind = "lift-off"', 'kind = "lift-off"\nlimits = { landing-speed = "0.3 m/s" }', ["lift-off", "landing-speed"]),
    ('kind = "lift-off"', 'kind = "lift-off"\nlimits = { dynamic-load = "20 m" }', ["lift-off", "dynamic-load"]),
    (
        'kind = "in-air"',
        'kind = "in-air"\nspeed = "6 m/min"',
        ["over the side", "speed is given, and it does not move"],
    ),
    ('kind = "in-air"', 'kind = "in-air"\ndepth = "2 m"', ["over the side", "splash-zone"]),
    ('kind = "splash-zone"', 'kind = "splash-zone"\ndepth = "2 m"', ["splash", "covered"]),
    ('kind = "splash-zone"', 'kind = "splash-zone"\ndepth = "310 m"', ["splash", "below the seabed"]),
    ('kind = "splash-zone"', 'kind = "splash-zone"\ndepth = "-25 m"', ["splash", "covered"]),
    ('kind = "splash-zone"', 'kind = "splash-zone"\nspeed = "-15 m/min"', ["splash", "speed"]),
    ('kind = "splash-zone"', 'kind = "splash-zone"\nplanned = "5 s"', ["splash", "planned", "take"]),
    ('name = "splash"', 'name = "deep"', ["deep", "twice"]),
    ('name = "splash"', 'name = "through\\nthe surface"', ['phase "through\\nthe surface"', "name", "one line"]),
    ('kind = "lowering"', 'kind = "lowering"\ndepth = "2 m"', ["down", "covered"]),
    ('kind = "lowering"', 'kind = "lowering"\nmode = "landing"', ["down", "landing", "ahc"]),
    ('kind = "deep"', 'kind = "deep"\ndepth = "290 m"', ["deep", "from 280 m to 290 m, and it does not move"]),
    ('kind = "landing"', 'kind = "landing"\ndepth = "299 m"', ["landing", "seabed", "300 m"]),
    ('kind = "landing"', 'kind = "landing"\nlanded = true', ["landing", "landed ends it", "Give depth"]),
    ('kind = "lowering"', 'kind = "lowering"\ntime = "5 min"', ["down", "is planned"]),
    ('kind = "lowering"', 'mode = "ahc"\ntime = "5 min"', ["down", "kind: missing"]),
    ('kind = "lowering"', 'kind = "lowering"\nstart_depth = "5 m"', ["down", "start_depth", "Leave it out"]),
    ('kind = "lowering"', 'kind = "lowering"\nend = "-30 m"', ["down", "end", "start_depth", "old form"]),
    (
        'kind = "landing"',
        'kind = "landing"\nspeed = "400 m/min"',
        ["landing", "speed 400 m/min: give more than 0, and at most 300 m/min"],
    ),
    (PLAN[PLAN.index("[[phase]]") :], "", ["one [[phase]] table"]),
    (
        'kind = "landing"',
        'kind = "landing"\nlimits = { landing-speed = 0.3 }',
        ["limits.landing-speed = 0.3: a bare number; write it as text with its unit,", '"0.3 m/s"'],
    ),
    (
        'kind = "landing"',
        'kind = "landing"\nlimits = { landing-speed = true }',
        ['limits.landing-speed = true: give a text, such as "0.3 m/s" or "off"'],
    ),
    (
        'kind = "splash-zone"',
        'kind = "splash-zone"\nlimits = { slack-sling = 0.2 }',
        ['a bare number; write it as text, "0.2"'],
    ),
    (
        '"manifold-60t"',
        '{ name = "tank", mass = "30 t", volume = "30 m^3", shape = "plate", length = "9 m", width = "9 m", height = "1 m" }',
        ['payload "tank": it floats, or nearly: it weighs 30 t', "displace 30.75 t of water. Check mass and volume."],
    ),
    (
        'T_POP = "4 h"',
        'T_POP = "4 h"\n[weather]\nfile = "SYNTHETIC-norwegian-sea"',
        [
            "environment.headings 180 deg: none can be kept within 15 deg (heading_tolerance)",
            "165, 180 and 195 deg, a smaller heading_tolerance, or weather.ship",
        ],
    ),
    (
        'kind = "deep"',
        'kind = "deep"\nmode = "ssc"',
        ['"deep"', "deep has one of ahc, manual; controllers are set by alternatives"],
    ),
    (
        'kind = "deep"',
        'kind = "deep"\nhold = "30 min"',
        ["deep has no hold of its own; only splash-zone and landing have"],
    ),
    ('kind = "splash-zone"', 'kind = "splash-zone"\nhold = "-30 min"', ["hold"]),
    ('name = "deep"', 'name = "splash, held"', ["is the name of the hold of"]),
]


@pytest.mark.thorough
@pytest.mark.parametrize(("old", "new", "said"), BAD, ids=[f"{i}-{new[-30:]}" for i, (_, new, _) in enumerate(BAD)])
def test_what_cannot_be_is_refused_in_one_line_that_names_file_and_place(
    tmp_path: Path, old: str, new: str, said: list[str]
) -> None:
    path = written(tmp_path, (old, new))
    with pytest.raises(StillhookError) as caught:
        load_plan(path)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith("plan.toml"), line
    assert all(part in line for part in said), line


def test_a_name_that_is_none_is_answered_with_those_there_are(tmp_path: Path) -> None:
    with pytest.raises(StillhookError, match=r"template-to-1500m.*did you mean"):
        load_plan("template-to-1500")
    with pytest.raises(StillhookError, match="no such file"):
        load_plan(tmp_path / "mine.toml")
    empty = tmp_path / "empty.toml"
    empty.write_text("  \n")
    with pytest.raises(StillhookError, match="empty"):
        load_plan(empty)


def test_phases_that_are_no_tables_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.toml"
    path.write_text('phase = ["down"]\n' + PLAN[: PLAN.index("[[phase]]")])
    with pytest.raises(StillhookError, match=r'phase\[0\] = "down": it must be a table'):
        load_plan(path)


def test_a_tip_out_of_the_boom_s_reach_is_refused(tmp_path: Path) -> None:
    copied = copy_plan("template-to-1500m", tmp_path)
    copied[0].write_text(copied[0].read_text().replace("x=-30 m, y=-2 m, z=36 m", "x=-60 m, y=-2 m, z=36 m"))
    with pytest.raises(StillhookError, match=r"lift-off.*boom reaches"):
        load_plan(copied[0])


def test_a_folder_s_vessel_goes_by_its_path(tmp_path: Path) -> None:
    from stillhook.library.catalogue import vessel_file

    shutil.copy(vessel_file("supply-vessel-82m"), tmp_path / "ours.csv")
    path = written(tmp_path, ('"construction-vessel-130m"', '"ours.csv"'))
    assert load_plan(path).vessel.digest != load_plan("template-to-1500m").vessel.digest


def with_own_ff(folder: Path, *changes: tuple[str, str]) -> Path:
    """A plan with FF as an alternative, whose settings are in a file beside it."""
    (folder / "own.toml").write_text('mode = "ff"\n[control]\nK_p = "0.145 1/m"\n', encoding="utf-8")
    table = 'alternatives = ["none", "ssc", "ff"]\ncontrollers = { ff = "own.toml" }'
    return written(folder, ('alternatives = ["none", "ssc"]', table), *changes)


def test_a_controller_s_file_sets_its_alternative_and_no_other(tmp_path: Path) -> None:
    plan = load_plan(with_own_ff(tmp_path))
    crane, mode = plan.machine(Alternative("ff"))
    assert (crane.control.K_p, mode.value) == (0.145, "ff")
    assert plan.machine(Alternative("ssc")) == (plan.crane, "ssc")
    assert plan.digest != load_plan(written(tmp_path, ('["none", "ssc"]', '["none", "ssc", "ff"]'))).digest


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('{ ff = "own.toml" }', '{ ff = "none.toml" }', 'none.toml": no such file. Check the path.'),
        ('{ ff = "own.toml" }', '{ ssc = "own.toml" }', 'the file has mode "ff", and ssc needs "ssc".'),
        (
            '{ ff = "own.toml" }',
            '{ hs = "own.toml" }',
            'controllers.hs = "own.toml": not a controller among the plan\'s alternatives. Choose among ssc, ff.',
        ),
        ('{ ff = "own.toml" }', '{ none = "own.toml" }', "not a controller among the plan's alternatives."),
    ],
)
def test_a_controller_s_file_that_does_not_fit_is_refused(tmp_path: Path, old: str, new: str, told: str) -> None:
    with pytest.raises(StillhookError) as refused:
        load_plan(with_own_ff(tmp_path, (old, new)))
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)
