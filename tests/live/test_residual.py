"""What adaptation leaves over is learned, judged on what was held out, and kept from wherever it may not be trusted."""

from __future__ import annotations

import ast
import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.live.residuals import CRANE, NOISE, TORQUE, law, learned, logs, samples

import stillhook
from stillhook.base.kept.sealed import EXACT, sealed
from stillhook.errors import LiveError, StillhookError
from stillhook.live.residual import LearningLog, Sea, read_model, test_model, train, write_model
from stillhook.live.residual.fit import FEWEST_CAMPAIGNS, HeldOut, applied, folds, hold_out, interval, learn
from stillhook.live.residual.proof import FEWEST, Proof, proven
from stillhook.live.residual.samples import BIN, NONE, Samples
from stillhook.live.residual.terms import CONDITIONS, Scales, conditions, terms
from stillhook.live.residual.trees import NONE as NO_TREES
from stillhook.live.residual.trees import boosted, checked, values

SCALES = Scales.of(CRANE)
SOURCE = Path(stillhook.__file__).parent


@pytest.mark.long
def test_a_curve_over_speed_is_learned_on_campaigns_and_seas_that_were_not_seen():
    model = learned()
    assert model.pays
    fresh = samples(9999)
    off = fresh.left - model.fitted.torque(fresh)
    assert np.sqrt(np.mean(off**2)) < 1.3 * NOISE
    assert np.sqrt(np.mean((law(fresh.omega) - model.fitted.torque(fresh)) ** 2)) < 0.2 * TORQUE


def test_the_trees_take_what_the_terms_leave():
    model = learned()
    assert len(model.fitted.trees)
    assert model.ratio.value < model.linear.value < 1.0


@pytest.mark.long
def test_noise_alone_is_not_learned_and_the_model_stays_off():
    model, held = train(CRANE, logs(6, size=0.0))
    assert not model.pays
    assert "does not pay" in model.verdict
    assert all(one.learned == one.adapted for one in held)  # nothing was ever applied


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5), st.floats(0.5, 5.0), st.floats(5.0, 15.0)), min_size=4, max_size=20))
def test_no_campaign_and_no_sea_is_learned_from_and_held_out(places):
    of = [LearningLog(str(i), f"c{c}", Sea(h, T), str(i), NONE) for i, (c, h, T) in enumerate(places)]
    for rest, test in folds(of, 10):
        assert test
        assert not {log.campaign for log in rest} & {log.campaign for log in test}
        assert not any(a.sea.alike(b.sea) for a in rest for b in test)


def test_too_few_campaigns_and_seas_that_are_all_alike_are_refused():
    with pytest.raises(LiveError, match=f"3 campaigns with usable logs: {FEWEST_CAMPAIGNS} are the fewest"):
        hold_out(logs(3), SCALES)
    same = [log._replace(sea=Sea(2.0, 9.0)) for log in logs(5)]
    with pytest.raises(LiveError, match="all seas are alike"):
        hold_out(same, SCALES)


def test_trees_are_calculated_as_by_lightgbm_to_the_bit():
    lightgbm = pytest.importorskip("lightgbm")
    rng = np.random.default_rng(3)
    x, y = rng.normal(size=(3000, len(CONDITIONS))), rng.normal(size=3000)
    captured = []
    train_of = lightgbm.train
    lightgbm.train = lambda *given: captured.append(train_of(*given)) or captured[-1]
    try:
        nodes = boosted(x, y, np.ones(3000), 20)
    finally:
        lightgbm.train = train_of
    assert np.array_equal(values(nodes, x).sum(axis=0), captured[0].predict(x))
    assert np.array_equal(boosted(x, y, np.ones(3000), 20), nodes)


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda n: n.__setitem__((0, 0, 2), 0.0), "lead nowhere"),  # a way back: would never end
        (lambda n: n.__setitem__((0, 0, 3), 99.0), "lead nowhere"),
        (lambda n: n.__setitem__((0, 0, 0), 7.0), "lead nowhere"),
        (lambda n: n.__setitem__((0, 0, 0), 0.5), "lead nowhere"),
        (lambda n: n.__setitem__((0, 0, 1), np.nan), "numbers"),
    ],
)
def test_trees_that_are_none_are_refused(spoil, reason):
    nodes = np.array([[[0, 0.0, 1, 2, 0.0], [0, 0.0, 1, 1, -1.0], [0, 0.0, 2, 2, 1.0]]], dtype=float)
    assert checked(nodes.copy(), 7).shape == (1, 3, 5)
    spoil(nodes)
    with pytest.raises(ValueError, match=reason):
        checked(nodes, 7)


def test_what_was_not_seen_is_named_and_gets_no_correction():
    fitted = learned().fitted
    fast = samples(7, fastest=250.0)
    torque, inside, used = applied(fitted, fast)
    beyond = np.abs(fast.omega) > 130.0
    assert not inside[beyond].any()
    assert not used[beyond].any()
    assert "speed not seen" in fitted.outside(fast)
    assert np.isfinite(torque).all()


def test_conditions_that_were_seen_alone_but_never_together_are_outside():
    x = samples(1)
    x = x._replace(alpha_m=np.full(len(x.t), 0.8), alpha_pm=np.full(len(x.t), 0.3), rate=0.0 * x.rate)
    slow_and_light = x._replace(F=np.where(np.abs(x.omega) > 60.0, 0.7e6, 1.3e6))
    fitted = learn([slow_and_light, slow_and_light], SCALES, 1e-2, 0)
    swapped = slow_and_light._replace(F=2.0e6 - slow_and_light.F)
    clear = np.abs(np.abs(x.omega) - 60.0) > 30.0
    assert np.mean(fitted.outside(swapped)["combination of conditions not seen"][clear]) > 0.9
    known = fitted.outside(slow_and_light).get("combination of conditions not seen", np.zeros(1))
    assert np.mean(known) < 0.05


def test_a_crane_on_which_the_correction_is_wrong_loses_it():
    """Its friction has another form: all conditions are as they were, and the sign is not."""
    fitted = learned().fitted
    _, inside, used = applied(fitted, samples(8, size=-1.0))
    assert inside.mean() > 0.9
    assert not used.any()


def test_a_correction_is_used_only_after_samples_before_it_have_proven_it():
    left = np.full(1000, 10.0)
    use = proven(left, left, np.ones(1000, dtype=bool))
    first = int(use.argmax())
    assert first == round(FEWEST / BIN)
    assert use[first:].all()
    proof = Proof()
    for _ in range(round(FEWEST / BIN) + 1):
        proof.add(10.0, -10.0)
    assert not proof.holds


def test_the_correction_opposes_itself_where_the_winch_turns_round():
    x = samples(5)
    mirrored = x._replace(omega=-x.omega, rate=-x.rate)
    assert np.allclose(learned().fitted.torque(mirrored), -learned().fitted.torque(x))
    assert np.allclose(conditions(mirrored, SCALES), conditions(x, SCALES))


def test_no_term_and_no_condition_holds_the_torque_of_the_moment():
    x = samples(5)
    other = x._replace(left=-x.left, modelled=2.0 * x.modelled)
    assert np.array_equal(terms(other, SCALES), terms(x, SCALES))
    assert np.array_equal(conditions(other, SCALES), conditions(x, SCALES))


def test_standard_errors_of_the_terms_are_those_between_logs():
    """An error that is the same all through a log counts once, however many samples it has."""
    off = np.random.default_rng(2).normal(size=12)

    def spread(n: int) -> float:
        of = [samples(k, size=0.0, noise=0.01, n=n) for k in range(12)]
        of = [x._replace(left=x.left + 20.0 * o * np.sign(x.omega)) for x, o in zip(of, off, strict=True)]
        return float(learn(of, SCALES, 1e-3, 0).errors[0])

    assert spread(1600) > 0.5 * spread(400)


def test_the_interval_holds_campaigns_that_were_not_seen_though_their_errors_are_correlated():
    """Errors of a campaign share a size that is drawn once. Coverage over many draws, less three standard errors."""
    rng = np.random.default_rng(5)
    held = []
    for _ in range(300):
        sizes = np.exp(rng.normal(size=40))
        of = [HeldOut(str(k), str(k), 1.0, 1.0, 1.0, 0.0, 0.0, s * rng.normal(size=50)) for k, s in enumerate(sizes)]
        confidence, half = interval(of)
        assert confidence == 0.95
        held.append(np.mean(np.abs(np.exp(rng.normal()) * rng.normal(size=50)) <= half))
    assert np.mean(held) > 0.95 - 3.0 * np.std(held) / np.sqrt(len(held))


def test_few_campaigns_state_less_than_95_percent():
    held = [HeldOut(str(k), str(k), 1.0, 1.0, 1.0, 0.0, 0.0, np.arange(10.0)) for k in range(4)]
    confidence, half = interval(held)
    assert confidence == pytest.approx(0.6)
    assert half == 7.0


@pytest.mark.long
def test_a_file_gives_the_same_corrections_to_the_bit(tmp_path):
    write_model(tmp_path / "m.json", learned())
    read, x = read_model(tmp_path / "m.json", CRANE), samples(77)
    assert np.array_equal(read.fitted.torque(x), learned().fitted.torque(x))
    assert read.ratio == learned().ratio
    assert read.half == learned().half
    assert {name: of.tolist() for name, of in read.fitted.outside(x).items()} == {
        name: of.tolist() for name, of in learned().fitted.outside(x).items()
    }


def test_a_model_without_trees_is_read_as_well(tmp_path):
    linear = learned()._replace(fitted=learned().fitted._replace(trees=NO_TREES))
    write_model(tmp_path / "m.json", linear)
    x = samples(77)
    assert np.array_equal(read_model(tmp_path / "m.json", CRANE).fitted.torque(x), linear.fitted.linear(x))


def _changed(data: dict, **new: object) -> str:
    return json.dumps({**data, **new})


@pytest.mark.parametrize(
    ("spoil", "line"),
    [
        (lambda d: "no json", "not a residual model"),
        (lambda d: "[" * 100000, "not a residual model"),
        (lambda d: json.dumps([1]), "JSON, but not a residual model"),
        (lambda d: _changed(d, held_out=[[0.1, 0.1, 0.1, 9.0]] * 2), "was changed after it was written"),
        (
            lambda d: _changed(d, format="stillhook residual model 2"),
            'this Stillhook reads "stillhook residual model 1"',
        ),
    ],
)
def test_a_file_that_is_none_or_was_changed_is_one_line(tmp_path, spoil, line):
    file = tmp_path / "m.json"
    write_model(file, learned())
    file.write_text(spoil(json.loads(file.read_text())))
    with pytest.raises(LiveError, match=line) as refused:
        read_model(file, CRANE)
    assert "\n" not in str(refused.value)


@pytest.mark.long
@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("code", "0123", "learned with other code"),
        ("trees", [[[0, 0.0, 0, 0]]], "not a complete model"),
        ("trees", [[[0, 0.0, 0, 0, float("nan")]]], "not a complete model"),
        ("terms", {}, "not a complete model"),
        ("seen", {}, "not a complete model"),
        ("interval", [0.95, float("inf")], "not a complete model"),
    ],
)
def test_a_forged_file_with_a_right_checksum_is_still_one_line(tmp_path, key, value, line):
    file = tmp_path / "m.json"
    write_model(file, learned())
    data = {**json.loads(file.read_text()), key: value}
    file.write_text(sealed(data, EXACT))
    with pytest.raises(LiveError, match=line) as refused:
        read_model(file, CRANE)
    assert "\n" not in str(refused.value)


def test_a_pickle_is_not_opened(tmp_path):
    class Bomb:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "opened",))

    (tmp_path / "m.json").write_bytes(pickle.dumps(Bomb()))
    with pytest.raises(LiveError, match="not a residual model"):
        read_model(tmp_path / "m.json", CRANE)
    assert not (tmp_path / "opened").exists()


def test_a_model_is_of_one_crane_as_it_was(tmp_path):
    write_model(tmp_path / "m.json", learned())
    heavier = CRANE.model_copy(update={"hook_mass": CRANE.hook_mass + 1.0})
    with pytest.raises(LiveError, match='learned for "nov-250t" as its file was then'):
        read_model(tmp_path / "m.json", heavier)


def test_a_log_that_was_learned_from_tests_nothing():
    with pytest.raises(LiveError, match="was learned from this log"):
        test_model(learned(), logs(6)[:1])
    assert test_model(learned(), logs(2, first=20))[0].learned > 0.0


@pytest.mark.long
def test_no_certificate_can_rest_on_a_model(tmp_path):
    """Nothing that validates, plans, identifies or simulates can reach it: by an import, by a name in a crane file, or by
    a column of a log."""
    users = set()
    for file in SOURCE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            if any(name.startswith("stillhook.live.residual") for name in names):
                users.add(file.relative_to(SOURCE).parts[:2])
    assert users == {("live", "residual"), ("live", "observer"), ("cli", "live")}  # the observer shows it
    file = tmp_path / "crane.toml"
    file.write_text('base = "nov-250t"\nresidual = "model.json"\n')
    with pytest.raises(StillhookError, match="residual"):
        stillhook.load_crane(file)
    from stillhook.variables import PHYSICAL

    assert not [name for name in PHYSICAL if "residual" in name or "correction" in name]


def test_every_answer_says_level_4():
    from stillhook.live.residual import ResidualModel

    stream = ResidualModel(CRANE, learned())
    assert stream.predict().level == 4
    assert stream.predict().applied == 0.0
    assert "level 4" in learned().verdict


def _of(x: Samples, part: slice) -> Samples:
    return Samples(*(column[part] for column in x))


def test_on_the_stream_a_reason_is_counted_for_every_sample_without_a_correction():
    """The model is given samples in place of rows."""
    from stillhook.live.residual import ResidualModel

    class Given:
        left_out: dict = __import__("collections").Counter()
        reached = 0.0

        def take(self, rows, state):
            return rows["samples"]

    def through(model, x, bounds=()):
        stream = ResidualModel(CRANE, model)
        stream._sampler = Given()
        state = type("State", (), {"bounds": bounds, "reasons": ()})()
        return stream, [stream.update({"samples": _of(x, slice(i, i + 1))}, state) for i in range(len(x.t))]

    x = samples(31)
    stream, out = through(learned(), x)
    torque, inside, used = applied(learned().fitted, x)
    assert [c.applied for c in out] == pytest.approx((used * torque).tolist())
    assert used.any()
    assert sum(c.applied == 0.0 for c in out) == (~used).sum()
    before = np.cumsum(inside) - inside
    assert stream.vetoes["not proven on this crane yet"] == (before < round(FEWEST / BIN)).sum()
    stream, bound = through(learned(), x, ("no certificate",))
    assert {c.applied for c in bound} == {0.0}
    assert stream.vetoes["no certificate"] == len(x.t)
    off = learned()._replace(ratio=replace(learned().ratio, high=0.9))
    stream, out = through(off, x)
    assert {c.applied for c in out} == {0.0}
    assert stream.vetoes["the model does not pay on what was held out"] == len(x.t)
