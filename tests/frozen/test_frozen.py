"""Numbers of every capability are those that were stored: to the bit on the same machine, within tolerances on another.

Intended changes: look at them with `python tests/frozen/freeze.py --check`, then store them with `python tests/frozen/freeze.py NAME ...`.
"""

import json

import pytest
from tests.frozen import record
from tests.frozen.cases import CASES, result

MOST_PRINTED = 10
THOROUGH = ("plan_with_the_twin", "response", "validate_dynamics", "certificate", "lower_many_lanes")
"""Cases of many seconds; `freeze.py --check` compares them all."""
LONG = (
    *("stability", "tune", "uncertainty", "envelope", "validate", "plan_quick", "weather"),
    *("identify_friction", "identify_motor", "printed_analysis", "printed_weather", "printed_export"),
    *("printed_thesis", "printed_library", "printed_parameters", "printed_plan", "printed_replay"),
    *("drawn_sea", "drawn_weather", "drawn_runs", "drawn_lowering", "drawn_analysis", "every_drive", "watched"),
    *("drawn_thesis", "drawn_papers", "drawn_paper_e", "plotted"),
    *("written_units", "printed_components", "vessel_and_session", "reports_of_plans"),
)
"""Cases of half a second to some seconds."""


def marks(name: str) -> pytest.MarkDecorator:
    return pytest.mark.thorough if name in THOROUGH else pytest.mark.long if name in LONG else pytest.mark.slow


def test_every_case_has_a_stored_result_and_every_stored_result_a_case():
    assert record.stored_names() == CASES.keys()
    assert record.path_of(record.MACHINE).exists()


@pytest.mark.parametrize("name", [pytest.param(name, marks=marks(name)) for name in CASES])
def test_results_are_those_that_were_stored(name):
    assert record.path_of(name).exists(), f"nothing stored for {name}: python tests/frozen/freeze.py {name}"
    exact = record.same_machine()
    new = json.loads(record.text_of(result(name)))
    found = list(record.differences(record.stored(name), new, exact=exact))
    lines = "\n".join(f"    {d}" for d in found[:MOST_PRINTED])
    rule = "to the bit" if exact else f"within {record.RELATIVE_TOLERANCE:g}"
    assert not found, f"{name}: {len(found)} leaves differ ({rule}), the first of them:\n{lines}"


class TestComparison:
    """The comparison itself finds what it should find."""

    OLD = {
        "a": 1.0,
        "n": 3,
        "text": "peak 2.5 m",
        "series": {"samples": [0.0, 5.0], "min": 0.0, "max": 5.0, "sha256": "x"},
    }

    def changed(self, exact, **new):
        return [d.path for d in record.differences(self.OLD, self.OLD | new, exact=exact)]

    def test_the_last_bit_counts_on_the_same_machine_only(self):
        assert self.changed(True, a=1.0 + 2.3e-16) == ["a"]
        assert self.changed(False, a=1.0 + 2.3e-16) == []
        assert self.changed(False, a=1.00001) == ["a"]

    def test_numbers_within_texts_are_compared_as_numbers_between_machines(self):
        assert self.changed(True, text="peak 2.5000001 m") == ["text"]
        assert self.changed(False, text="peak 2.5000001 m") == []
        assert self.changed(False, text="peak 2.6 m") == ["text"]
        assert self.changed(False, text="crest 2.5 m") == ["text"]

    def test_hashes_count_on_the_same_machine_only(self):
        other = {"series": self.OLD["series"] | {"sha256": "y"}}
        assert self.changed(True, **other) == ["series.sha256"]
        assert self.changed(False, **other) == []

    def test_samples_are_judged_by_the_size_of_their_array(self):
        assert self.changed(False, series=self.OLD["series"] | {"samples": [1e-6, 5.0]}) == []
        assert self.changed(False, series=self.OLD["series"] | {"samples": [1e-4, 5.0]}) == ["series.samples[0]"]

    def test_kinds_lengths_and_missing_keys_count(self):
        assert self.changed(False, n=True) == ["n"]
        assert self.changed(False, a="nan") == ["a"]
        assert list(record.differences([1], [1, 2], exact=False)) == [(".length", 1, 2)]
        assert list(record.differences({"a": 1}, {}, exact=False)) == [("a", 1, record.ABSENT)]
