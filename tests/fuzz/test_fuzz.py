"""Every reader and text parser gives a value or one line: on the corpus, on what once escaped, and on changed inputs."""

import contextlib
import gzip
import inspect
import json
import random
import time
import tomllib
from pathlib import Path

import pytest

pytest.importorskip("resource", reason="bounds of time and memory are those of POSIX")

from fuzz.__main__ import main
from fuzz.engine import pool
from fuzz.engine.feedback import Lines, Sentences
from fuzz.engine.guard import SLOWEST, Guard, Kind, Outcome
from fuzz.engine.loop import Campaign
from fuzz.mutators.choose import mutated
from fuzz.mutators.repair import by_gzip, by_sealed, by_state
from fuzz.mutators.values import by_toml, toml, toml_text
from fuzz.targets.registry import Form, Target, targets

from stillhook.base.kept.sealed import read_sealed, sealed
from stillhook.cli.runs.inspect import READERS
from stillhook.engine.saved import seal, unseal
from stillhook.errors import SpecError, StillhookError
from stillhook.library.toml.kinds import FileKind, kind_of
from stillhook.logs.formats import columnar

TARGETS = targets()
SEED = 44
SECONDS, INPUTS = 0.4, 400
"""Time [s] and inputs of one target at most; `make fuzz` takes hours."""
LARGEST_CORPUS = 1_000_000
"""Bytes of all that is committed."""

FORMS = {
    "motion": "motion-understood",
    "log": "log-understood",
    "weather": "weather-understood",
    "chart": "chart-understood",
    "map": "motor-map",
    "vessel": "vessel-text",
    "spectra": "waves-text",
}
"""What `stillhook inspect` reads a file as, and the target that does."""


def stored(folder: Path, target: Target) -> list[bytes]:
    return pool.inputs(pool.stored(folder, target.group, target.name))


@pytest.mark.long
@pytest.mark.parametrize("name", TARGETS)
def test_no_input_of_the_corpus_and_none_that_once_escaped_does(name: str, tmp_path: Path):
    target = TARGETS[name]
    with Guard(target, tmp_path / "room") as guard:
        for data in [*stored(pool.CRASHES, target), *stored(pool.CORPUS, target)]:
            outcome = guard.attempt(data)
            assert outcome.good, (outcome, data)
        assert guard.left() is None


@pytest.mark.long
@pytest.mark.parametrize("name", TARGETS)
def test_changed_inputs_give_a_value_or_one_line(name: str, tmp_path: Path):
    target, faults = TARGETS[name], []
    campaign = Campaign(target, tmp_path / "room", SEED, found=lambda data, outcome: faults.append((outcome, data)))
    start = [*target.seeds(), *stored(pool.CORPUS, target)]
    tally = campaign.run(start[:20], inputs=INPUTS, seconds=SECONDS)
    assert tally.read > 0  # changes begin with something that is right
    assert faults == []


def test_what_is_committed_is_small_and_of_a_target():
    files = [*pool.CORPUS.rglob("*.jsonl"), *pool.CRASHES.rglob("*.jsonl")]
    assert sum(file.stat().st_size for file in files) < LARGEST_CORPUS
    named = {f"{target.group}/{name}" for name, target in TARGETS.items()}
    assert {f"{file.parent.name}/{file.stem}" for file in files} <= named


def test_every_kind_of_toml_file_and_every_form_of_inspect_is_fuzzed():
    kinds = set()
    for target in TARGETS.values():
        if target.form is Form.TOML:
            for data in [*stored(pool.CORPUS, target), *target.seeds()]:
                try:
                    kinds.add(kind_of(toml(data)))
                except ValueError:
                    continue
    assert set(FileKind) - kinds == set()
    assert set(FORMS) == set(READERS)
    assert set(FORMS.values()) <= set(TARGETS)


class TestGuard:
    """What counts as an escape."""

    @staticmethod
    def outcome(tmp_path: Path, read) -> Outcome:
        with Guard(Target("planted", Form.WORDS, read), tmp_path / "room") as guard:
            return guard.attempt(b"x")

    def test_a_value_and_a_refusal_are_good(self, tmp_path):
        def refuses(data: bytes) -> None:
            raise SpecError("a line\nof two, \x1b[2J")

        assert self.outcome(tmp_path, len).kind == Kind.READ
        assert self.outcome(tmp_path, refuses) == Outcome(Kind.REFUSED, "a line\\nof two, \\x1b[2J")

    @pytest.mark.parametrize(
        "problem", [TypeError("x"), RecursionError(), SystemExit(3), KeyboardInterrupt(), MemoryError()]
    )
    def test_everything_else_is_an_escape(self, tmp_path, problem):
        def fails(data: bytes) -> None:
            raise problem

        assert self.outcome(tmp_path, fails).kind == Kind.ESCAPE

    def test_so_is_a_refusal_that_says_nothing(self, tmp_path):
        def refuses(data: bytes) -> None:
            raise SpecError("  ")

        assert self.outcome(tmp_path, refuses).kind == Kind.ESCAPE

    @pytest.mark.thorough
    def test_an_input_that_takes_too_long_is_stopped(self, tmp_path):
        def hangs(data: bytes) -> None:
            while True:
                with contextlib.suppress(Exception):  # as a reader does
                    sum(range(1000))

        begun = time.process_time()
        assert self.outcome(tmp_path, hangs).kind == Kind.HANG
        assert time.process_time() - begun < 2.0 * SLOWEST

    def test_files_that_are_left_behind_are_found_and_removed(self, tmp_path):
        def leaves(path: Path) -> None:
            path.with_name("left").write_text("x")

        with Guard(Target("planted", Form.WORDS, leaves, "in.txt"), tmp_path / "room") as guard:
            guard.attempt(b"x")
            assert guard.left() == Outcome(Kind.ESCAPE, "left behind: left", "left")
            assert guard.left() is None
        assert not (tmp_path / "room").exists()


class TestLoop:
    """What leads the loop on."""

    @pytest.mark.long
    def test_a_fault_behind_three_conditions_is_found_by_their_refusals_and_shortened(self, tmp_path):
        def read(data: bytes) -> None:
            for i, word in enumerate((b"12 m", b"sine")):
                if word not in data:
                    raise SpecError(f"no word {'abc'[i]}")
            raise TypeError("found")

        found = []
        target = Target("planted", Form.WORDS, read, seeds=lambda: iter((b"3 m + 12 s + sine",)))
        campaign = Campaign(
            target, tmp_path / "room", SEED, found=lambda data, outcome: found.append((data, outcome.kind))
        )
        campaign.run(list(target.seeds()), inputs=20_000, seconds=20.0)
        assert [kind for _, kind in found] == [Kind.ESCAPE]
        assert len(found[0][0]) <= len(b"12 m sine")

    def test_lines_of_the_package_count_once(self):
        lines = Lines()
        with lines:
            toml_kind = kind_of({"scenario": {}})
        first = lines.seen
        with lines:
            kind_of({"scenario": {}})
        assert (toml_kind, first > 0, lines.seen) == (FileKind.CASE, True, first)

    @pytest.mark.slow
    def test_lines_of_the_process_that_reads_count_too_and_its_refusals_stay(self, tmp_path):
        target, lines = TARGETS["log-hdf"], Lines()
        (data,) = target.seeds()
        with Guard(target, tmp_path / "room") as guard, lines:
            kinds = [guard.attempt(each).kind for each in (data, data[:-200])]
        assert kinds == [Kind.READ, Kind.REFUSED]
        opening = inspect.getsourcelines(columnar.open_hdf)
        ran = lines.to_dict()[columnar.__file__]
        assert set(ran) & set(range(opening[1], opening[1] + len(opening[0])))

    def test_sentences_differ_by_words_and_not_by_values(self):
        seen = Sentences()
        lines = ('a = "x": no', 'a = "y": no', "a = 12: yes", "a = 1.5e3: yes")
        assert [seen.new(Outcome(Kind.REFUSED, line)) for line in lines] == [True, False, True, False]

    @pytest.mark.long
    def test_a_campaign_is_continued_and_a_process_that_dies_is_a_finding(self, tmp_path, capsys):
        arguments = ["--target", "zone", "--time", "2 s", "--store", str(tmp_path)]
        assert main(arguments) == 0
        first = json.loads((tmp_path / "words" / "zone" / "totals.json").read_text())
        assert main(arguments) == 0
        second = json.loads((tmp_path / "words" / "zone" / "totals.json").read_text())
        assert second["inputs"] > first["inputs"] > 100
        assert (second["rounds"], second["escape"], second["hang"]) == (2, 0, 0)
        assert "| zone |" in capsys.readouterr().out


class TestChanges:
    """Changed inputs reach what lies behind a checksum."""

    R = random.Random(SEED)

    def test_sealed_files_are_still_sealed(self, tmp_path):
        data = sealed({"format": "x 1", "a": 1.5, "b": ["12 m", {"c": None}]}).encode()
        path, intact, refused = tmp_path / "x.json", 0, set()
        for _ in range(100):
            path.write_bytes(by_sealed(self.R, data, [data]))
            try:
                read_sealed(path, "x 1", "x", "", SpecError, digits=10)
                intact += 1
            except StillhookError as problem:
                refused.add(str(problem))
        assert intact > 20
        assert [line for line in refused if "format" not in line and "not x" not in line and "digest" not in line] == []

    def test_states_are_still_whole(self):
        data = seal("session", 1, {"k": 3, "names": ["a"]}, [])
        intact = 0
        for _ in range(100):
            try:
                unseal("session", 1, by_state(self.R, data, [data]), "x")
                intact += 1
            except StillhookError:
                continue
        assert intact > 20

    def test_toml_written_is_read_back(self):
        tree = {"a": {"b": [1, 2.5, "x\n\u2028\x7f", True, {"c d": "\\"}]}, "x": [[]], "é": float("inf")}
        assert tomllib.loads(toml_text(tree)) == tree
        assert all(
            tomllib.loads(by_toml(self.R, toml_text(tree).encode(), []).decode()) is not None for _ in range(200)
        )

    @pytest.mark.parametrize("form", Form)
    def test_any_bytes_can_be_changed_in_any_form(self, form):
        for data in (b"", b"\0", b"a = 1\n", b'{"a": 1}', self.R.randbytes(50)):
            assert all(isinstance(mutated(self.R, form, data, [data]), bytes) for _ in range(30))

    def test_a_compressed_text_stays_one(self):
        assert gzip.decompress(by_gzip(self.R, gzip.compress(b"time;Hs\n1;2\n"), []))
