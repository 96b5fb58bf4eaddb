"""A lift file with a deck: what moves it, where the payload starts, what is printed, and what is refused."""

import json
import math

import numpy as np
import pytest

from stillhook.cli import run
from stillhook.errors import StillhookError
from stillhook.formats.lift_file import load_lift, place_in
from stillhook.sea.vessel.realisation import realise, tip_motion
from stillhook.sea.vessel.relative import RelativeMotion

HEAD = 'crane = "nov-250t"\npayload = "manifold-60t"\n[water]\ndepth = "300 m"\n'
SINE = HEAD + '[tip]\nheight = "36 m"\nmotion = "sine 0.2 m 11 s"\n'
SEA = (
    'crane = "nov-250t"\npayload = "manifold-60t"\nvessel = "construction-vessel-130m"\nduration = "70 s"\n'
    '[water]\ndepth = "300 m"\n[sea]\nwave = "jonswap Hs=1.5 m Tp=8 s"\nheading = "150 deg"\nseed = 2\n'
    '[tip]\nat = "x=-15 m, y=-24 m, z=36 m"\n[rigging]\ncarrier = "another-vessel"\n'
    '[other_vessel]\nvessel = "supply-vessel-82m"\nat = "x=-20 m, y=0 m"\n'
)
DECK = '[deck]\nheight = "4 m"\nslack = "2 m"\n'
PHASES = (
    '[[phase]]\nname = "wait"\nmode = "manual"\ntime = "12 s"\n'
    '[[phase]]\nname = "hoist"\nmode = "manual"\nspeed = "-24 m/min"\ndepth = "-9 m"\n'
)


def written(folder, *parts):
    path = folder / "lift.toml"
    path.write_text("".join(parts), encoding="utf-8")
    return path


def test_a_deck_moves_with_the_other_vessel_in_the_waves_of_the_tip(tmp_path):
    file = load_lift(written(tmp_path, SEA, DECK, PHASES))
    lift = file.lift
    assert lift.waves is None
    assert lift.start_depth == -4.0
    assert not [note for note in file.notes if "a run has not" in note]
    assert lift.deck.motion.duration == 70.0
    from_rest = np.linspace(0.0, 60.0, 100)
    waves = realise(file.sea, 70.0, 2, depth=300.0)
    other = place_in(tmp_path / "lift.toml").against
    assert isinstance(other, RelativeMotion)
    over = lift.tip.sample(from_rest)[0] - lift.deck.motion.sample(from_rest)[0]
    assert np.allclose(over, tip_motion(waves, other, -15.0, -24.0).sample(from_rest)[0], atol=1e-8)
    assert over.std() > 0.1


def test_the_answer_of_a_lift_off_says_when_and_whether_the_deck_hit_again(tmp_path, capsys):
    path = str(written(tmp_path, SINE, DECK + 'motion = "sine 0.5 m 8 s"\n', PHASES))
    run(["lower", path])
    text = " ".join(capsys.readouterr().out.split())
    run(["lower", path, "--json"])
    answer = json.loads(capsys.readouterr().out)
    assert f"Lift-off after {answer['t_lift_off']:.4g} s; no second hit." in text
    assert 15.0 < answer["t_lift_off"] < 35.0
    assert answer["second_hits"] == 0
    assert answer["F_deck_max"] > 60e3 * 9.8
    assert "deck 4 m above still water, sine 0.5 m 8 s" in answer["place"]


def test_hoisting_speeds_are_printed_with_the_lowest_that_avoids_a_second_hit(tmp_path, capsys):
    path = str(written(tmp_path, SINE, DECK + 'motion = "sine 0.5 m 8 s"\n', PHASES))
    assert run(["lower", path, "--hoisting-speeds", "12 to 30 m/min by 18 m/min", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["v"] for row in answer["speeds"]] == pytest.approx([0.2, 0.5])
    assert (answer["lowest"], answer["starts"], answer["span"]) == (pytest.approx(0.5), 64, 8.0)
    slow, fast = answer["speeds"]
    assert 0.0 < slow["share"] < 0.5
    assert 0.05 < slow["v_hit"] < 0.5 * 2.0 * math.pi / 8.0
    assert fast["share"] == 0.0


REFUSED = [
    (SEA + DECK + 'motion = "still"\n' + PHASES, "deck.motion: given together with other_vessel, whose deck moves."),
    ('deck = "high"\n' + SINE + PHASES, "give a table [deck] with height"),
    (SINE + DECK + "colour = 3\n" + PHASES, "deck.colour: unknown field. Allowed: height, motion"),
    (SINE + '[deck]\nheight = "4"\n' + PHASES, 'deck.height = "4": no unit; write "4 m"'),
    (SINE + DECK + 'motion = "sine 1 m"\n' + PHASES, 'deck: motion: "sine 1 m": a sine has an amplitude'),
]


@pytest.mark.parametrize(("text", "line"), REFUSED)
def test_what_cannot_be_is_refused_in_one_line(tmp_path, text, line):
    with pytest.raises(StillhookError) as problem:
        load_lift(written(tmp_path, text))
    assert line in str(problem.value)
    assert "\n" not in str(problem.value)


@pytest.mark.parametrize(
    ("more", "line"),
    [
        (["--hoisting-speeds", "fast"], '--hoisting-speeds = "fast": not a number'),
        (["--hoisting-speeds", "12 m/min", "--out", "x"], "--out: --hoisting-speeds writes no files."),
        (["--hoisting-speeds", "0 m/min"], "hoisting speeds: give one or more above 0 m/s."),
    ],
)
def test_hoisting_speeds_that_cannot_be_are_refused(tmp_path, capsys, more, line):
    assert run(["lower", str(written(tmp_path, SINE, DECK, PHASES)), *more]) == 2
    error = capsys.readouterr().err
    assert line in error
    assert len(error.strip().splitlines()) == 1
