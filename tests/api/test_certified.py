"""A crane that carries a certificate: runs say where they leave what was validated, and that a certificate no longer holds."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from tests.signers import KEY, NAME
from tests.validate.staged_certificate import staged, write

from stillhook import Scenario, load_crane, load_run, save_run, simulate
from stillhook.cli import run as command
from stillhook.engine import certificate as standing_of
from stillhook.engine.certificate import NO_CERTIFICATE, doubts, twin_line
from stillhook.engine.simulate import run_cases
from stillhook.errors import SpecError
from stillhook.formats.results import rerun
from stillhook.library import changed, crane_from_toml, crane_toml, load_friction, set_toml
from stillhook.library.draws import crane_with
from stillhook.sea.motion.recorded import wave_periods, window_spans
from stillhook.spec.crane import content
from stillhook.spec.scenario import PowerLoss
from stillhook.spec.validity import CAP, EDGE
from stillhook.validate import certificate_of

INSIDE = {
    "load": "100 t",
    "s_w": "1000 m",
    "tip": "sine 0.8 m 9 s",
    "mode": "ssc",
    "duration": "60 s",
    "warm_up": "20 s",
}
"""Of the staged campaign: 82 t to 164 t, 486 m to 2314 m, 0.8 m to 2 m (0.797 m to 1.99 m as step 0 meets the crests), 8 s to 11 s, ns and ssc."""
SHORT = {"duration": "2 s", "warm_up": "0.5 s"}
UNCERTIFIED_NOTES = "the wire of 1000 m weighs 36 t in air, 35% of the hook load, and is left out of tension and pressures; stillhook lower has it"
"""What any crane says of this run: 1 km of wire at 36 kg/m on a hook of 104 t."""


def stored(made, folder: Path) -> Path:
    """A crane file with its certificate in a folder."""
    (folder / "certificate.json").write_text(made.text(), encoding="utf-8")
    (folder / "crane.toml").write_text(made.crane_toml(), encoding="utf-8")
    return folder / "crane.toml"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory):
    """A certificate of logs that are not synthetic, signed by a key that is trusted."""
    return certificate_of(staged(write(tmp_path_factory.mktemp("campaign"), synthetic=False))).signed(KEY)


@pytest.fixture
def file(made, tmp_path: Path) -> Path:
    return stored(made, tmp_path)


@pytest.fixture
def crane(file):
    return load_crane(file)


def case(**other) -> Scenario:
    return Scenario(**{**INSIDE, **other})


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.mark.slow
def test_inside_the_envelope_nothing_is_said_and_the_run_is_validated(crane):
    run = simulate(crane, case())
    assert float(run.validated) == 1.0
    assert str(run.notes.values) == UNCERTIFIED_NOTES
    assert doubts(crane, case()) == ()
    assert re.fullmatch(
        r"twin: level 2, variant 2: certificate [0-9a-f]{12} of 2026-11-21 by paper-f version 3 holds, signed by "
        rf"{NAME} \(key {KEY.public.id[:16]}\), trusted by the user's list",
        run.attrs["twin"],
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("other", "reason"),
    [
        ({"load": "200 t"}, "load 200 t (validated 82 t to 164 t)"),
        ({"load": "60 t"}, "load 60 t (validated 82 t to 164 t)"),
        ({"s_w": "300 m"}, "wire out 299.2 m to 300.8 m (validated 486 m to 2314 m)"),
        ({"tip": "sine 1.5 m 9 s"}, "tip motion over 30 s 3 m (validated 0.797 m to 1.99 m)"),
        ({"tip": "sine 0.1 m 9 s"}, "tip motion over 30 s 0.2 m (validated 0.797 m to 1.99 m)"),
        ({"tip": "sine 0.8 m 6 s"}, "period of the tip 6 s (validated 8 s to 11 s)"),
        ({"tip": "sine 0.8 m 16 s"}, "period of the tip 16 s (validated 8 s to 11 s)"),
        ({"mode": "hs"}, "mode hs (validated ns, ssc)"),
        ({"modes": (("30 s", "level-1"),)}, "mode level-1 (validated ns, ssc)"),
        ({"mode": "manual", "tip": "still"}, "mode manual (validated ns, ssc)"),
        ({"power_loss": PowerLoss(time="30 s")}, "loss of a hydraulic power unit (not validated)"),
        ({"friction": "regularised"}, "regularised friction (not validated)"),
    ],
)
def test_outside_the_envelope_the_run_says_what_was_validated(crane, other, reason):
    asked = case(**other)
    found = run_cases(crane, asked)[0]
    assert f"outside the validated envelope: {reason}" in found["notes"]
    assert found["validated"] == 0.0
    assert doubts(crane, asked) == (f"outside the validated envelope: {reason}",)


@pytest.mark.slow
def test_several_reasons_stand_in_one_line(crane):
    (note,) = doubts(crane, case(load="200 t", mode="hs"))
    assert note == "outside the validated envelope: load 200 t (validated 82 t to 164 t), mode hs (validated ns, ssc)"


@pytest.mark.slow
@pytest.mark.parametrize(("load", "inside"), [(1.0 + 0.5 * EDGE, True), (1.0 + 1.5 * EDGE, False)])
def test_a_test_repeated_within_what_sensors_can_tell_is_inside(crane, load, inside):
    assert (doubts(crane, case(load=f"{164.0 * load} t")) == ()) is inside


@pytest.mark.slow
def test_an_irregular_motion_is_judged_by_its_window_and_its_mean_period(crane):
    assert doubts(crane, case(tip="sine 0.4 m 8.5 s + sine 0.3 m 10.5 s", duration="300 s")) == ()
    (note,) = doubts(crane, case(tip="sine 0.4 m 8.5 s + sine 0.9 m 10.5 s", duration="300 s"))
    assert "tip motion over 30 s" in note


@pytest.mark.slow
def test_a_crane_that_was_changed_is_run_and_flagged(crane):
    other = changed(crane, {"control": {"K_p": "0.2 1/m"}})
    run = simulate(other, case(**SHORT))
    assert "; certificate does not hold: the crane was changed since in control;" in str(run.notes.values)
    assert float(run.validated) == 0.0
    assert "does not hold" in run.attrs["twin"]


@pytest.mark.slow
def test_a_crane_file_that_was_edited_is_flagged_and_one_that_was_renamed_is_not(file):
    edit(file, 'name = "nov-250t"', 'name = "crane 7"')
    assert doubts(load_crane(file), case()) == ()
    edit(file, 'value = "80 L"', 'value = "90 L"')
    (note,) = doubts(load_crane(file), case())
    assert note == "certificate does not hold: the crane was changed since in active"


@pytest.mark.slow
def test_what_is_built_on_a_certified_crane_holds_only_while_it_is_the_same(file, tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('base = "crane.toml"\nname = "ours"\n')
    assert doubts(load_crane(own), case()) == ()
    own.write_text('base = "crane.toml"\nSWL = "200 t"\n')
    assert doubts(load_crane(own), case()) == ("certificate does not hold: the crane was changed since in SWL",)


@pytest.mark.slow
def test_other_code_does_not_hold(crane, monkeypatch):
    monkeypatch.setattr(standing_of, "results_hash", lambda: "0123456789abcdef")
    (note,) = doubts(crane, case())
    assert note.startswith(
        "certificate does not hold: this Stillhook computes with other code (0123456789abcdef) than the validated one"
    )


@pytest.mark.slow
def test_a_validation_that_was_not_passed_certifies_nothing(tmp_path):
    made = certificate_of(staged(write(tmp_path), e_c_pp_deviation=0.3)).signed(KEY)
    (tmp_path / "not-passed.json").write_text(made.text(), encoding="utf-8")
    (tmp_path / "own.toml").write_text('base = "nov-250t"\nname = "nov-250t"\ncertificate = "not-passed.json"\n')
    found = load_crane(tmp_path / "own.toml")
    assert doubts(found, case()) == ("certificate does not hold: the validation was not passed",)
    assert "does not hold" in twin_line(found)


@pytest.mark.slow
def test_a_synthetic_certificate_says_so_in_every_run(tmp_path):
    found = load_crane(stored(certificate_of(staged(write(tmp_path))).signed(KEY), tmp_path))
    (note,) = doubts(found, case())
    assert note.endswith("is SYNTHETIC: the twin was validated on simulated logs, not on a crane")
    assert "SYNTHETIC" in twin_line(found)
    assert run_cases(found, case(**SHORT))[0]["validated"] == 0.0


def test_a_crane_without_a_certificate_is_not_validated_and_spoils_no_table():
    found = load_crane("nov-250t")
    run = simulate(found, case(**SHORT))
    assert float(run.validated) == 0.0
    assert "certificate" not in str(run.notes.values)
    assert run.attrs["twin"] == "twin: not validated (level 1: no certificate)"
    assert doubts(found, case()) == (NO_CERTIFICATE,)
    assert CAP == 0.80


# Files


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "text"),
    [
        ('certificate = "gone.json"', 'own.toml: certificate = "gone.json": .*no such file'),
        ('certificate = "own.toml"', "not a certificate"),
        ("certificate = 5", "give the path of a certificate"),
        ('certificate = "damaged.json"', "was changed after it was written"),
    ],
)
def test_a_certificate_that_cannot_be_read_is_refused_in_one_line(file, tmp_path, line, text):
    damaged = (tmp_path / "certificate.json").read_text(encoding="utf-8").replace("164000", "250000")
    (tmp_path / "damaged.json").write_text(damaged, encoding="utf-8")
    (tmp_path / "own.toml").write_text(f'base = "nov-250t"\n{line}\n')
    with pytest.raises(SpecError, match=text) as problem:
        load_crane(tmp_path / "own.toml")
    assert "\n" not in str(problem.value)


@pytest.mark.slow
def test_a_crane_with_its_certificate_reads_back_the_same(crane):
    assert crane.certified is not None
    assert crane_from_toml(crane_toml(crane), "stored crane") == crane


@pytest.mark.slow
def test_the_record_of_a_certificate_cannot_be_edited(crane):
    text = crane_toml(crane)
    assert '"164 t"' in text
    with pytest.raises(SpecError, match="certified: a record that was changed manually"):
        crane_from_toml(text.replace('"164 t"', '"250 t"'), "own.toml")


@pytest.mark.slow
def test_content_is_the_same_with_and_without_a_certificate(crane):
    assert content(crane) == content(load_crane("nov-250t"))


@pytest.mark.slow
def test_a_crane_with_a_friction_set_from_a_file_needs_no_file_but_its_certificate(tmp_path):
    trial = tmp_path / "trial"
    trial.mkdir()
    (trial / "ours.friction.toml").write_text(set_toml(load_friction("crane-1")), encoding="utf-8")
    (trial / "ours.toml").write_text('base = "nov-250t"\n[friction]\nlibrary = "ours.friction.toml"\n')
    made = certificate_of(staged(write(trial, crane="ours.toml", synthetic=False))).signed(KEY)
    alone = tmp_path / "alone"
    alone.mkdir()
    crane = load_crane(stored(made, alone))
    assert doubts(crane, case()) == ()
    drawn = crane_with(crane, load_friction("crane-2"))
    assert doubts(drawn, case())[0].endswith("changed since in friction")


# Results


@pytest.mark.thorough
def test_a_stored_run_says_the_same_when_it_is_run_again(crane, tmp_path):
    run = load_run(save_run(simulate(crane, case(load="200 t", **SHORT)), tmp_path / "run.nc"))
    again = rerun(run)
    assert str(again.notes.values) == str(run.notes.values) != ""
    assert again.attrs["twin"] == run.attrs["twin"]


@pytest.mark.slow
def test_results_that_are_kept_know_the_certificate_they_were_made_with(crane, tmp_path):
    bare = crane.model_copy(update={"certified": None})
    cases = [case(load="200 t", **SHORT), case(**SHORT)]
    with_it, without = (run_cases(c, cases, store=tmp_path / "kept") for c in (crane, bare))
    assert [s["validated"] for s in with_it] == [
        s["validated"] for s in run_cases(crane, cases, store=tmp_path / "kept")
    ]
    assert with_it[0]["notes"] != without[0]["notes"]
    assert with_it[0]["e_c_pp"] == without[0]["e_c_pp"]


# The command line

HEAVY = "--load '200 t' --s-w '1000 m' --motion 'sine 0.8 m 9 s' --duration '40 s'"


@pytest.mark.thorough
def test_commands_say_how_far_the_twin_is_validated(file, capsys):
    assert command(["crane", str(file), "--verbose"]) == 0
    out = capsys.readouterr().out
    assert "twin: level 2, variant 2: certificate" in out
    assert "validated for: payload on the hook 82 t to 164 t" in out
    assert command(["crane", "nov-250t", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["twin"] == "twin: not validated (level 1: no certificate)"
    asked = [str(file), *shlex.split(f"{HEAVY} --controllers ns,ssc")]
    command(["compare", *asked, "--verbose"])
    out = capsys.readouterr().out
    assert out.count("twin: ") == 1
    assert out.count("outside the validated envelope: load 200 t (validated 82 t to 164 t)") == 2
    command(["compare", *asked, "--json"])
    assert {s["validated"] for s in json.loads(capsys.readouterr().out).values()} == {0.0}


@pytest.mark.slow
def test_a_map_counts_the_cells_that_are_not_validated(file, capsys):
    cells = "--controllers ssc --loads '100 t, 200 t' --speeds '30 m/min' --periods '9 s' --s-w '1000 m'"
    command(["map", str(file), *shlex.split(cells), "--verbose"])
    assert "cells that are not validated: 1 of 2" in capsys.readouterr().out


@pytest.mark.thorough
def test_draws_and_envelope_and_tuning_say_it(file, capsys):
    command(["uncertainty", str(file), *shlex.split(f"{HEAVY} --controllers ssc --draws 4"), "--verbose"])
    assert "outside the validated envelope: load 200 t" in capsys.readouterr().out
    command(["envelope", str(file), "--loads", "100 t", "--verbose"])
    assert "validated for: payload on the hook 82 t to 164 t" in capsys.readouterr().out


# Waves


def test_periods_of_a_sine_in_noise_are_those_of_the_sine():
    t = np.arange(0.0, 200.0, 0.01)
    noisy = np.sin(2.0 * np.pi * t / 9.0) + 0.02 * np.random.default_rng(0).standard_normal(len(t))
    found = wave_periods(noisy, 0.01)
    assert len(found) == 21
    assert found.mean() == pytest.approx(9.0, abs=0.02)  # noise of 2 % moves a crossing by 0.03 s


def test_a_tip_that_stands_has_no_waves():
    assert len(wave_periods(np.zeros(100), 0.1)) == 0
    assert window_spans(np.zeros(5), 300).tolist() == [0.0]


def test_a_window_sees_the_largest_span_inside_it_and_no_more():
    s = np.zeros(1000)
    s[100], s[500], s[790] = 1.0, 1.0, -1.0
    assert window_spans(s, 300).max() == 2.0
    assert window_spans(s, 290).max() == 1.0
