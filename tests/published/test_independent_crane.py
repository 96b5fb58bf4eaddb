"""The independent crane stays independent, and validation still refutes what its page says that it refutes."""

import ast
from pathlib import Path

import pytest
from trials.independent_crane import crane, run

from stillhook.validate import validate
from stillhook.validate.criteria.results import StepNumber

PLANT = ("crane", "plant", "plc", "sea_trial")
NUMBERS = {
    "stillhook": {"Crane"},
    "stillhook.engine.pack.winch": {"drum_record", "gains", "inertia_record"},
    "stillhook.library": {"load_crane"},
}
"""All that it may take of the package: the crane file and numbers that follow from it."""


@pytest.mark.parametrize("name", PLANT)
def test_the_independent_crane_takes_numbers_and_no_law_of_the_package(name):
    for node in ast.walk(ast.parse(Path(crane.__file__).with_name(f"{name}.py").read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert not any(alias.name.partition(".")[0] == "stillhook" for alias in node.names)
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "stillhook":
            assert {alias.name for alias in node.names} <= NUMBERS.get(node.module, set())


@pytest.mark.thorough
def test_a_wrong_precharge_of_the_file_is_refuted_as_it_was_kept(tmp_path):
    case = run.BY_NAME["precharge"]
    found = validate(crane.write_campaign(tmp_path, case), steps=[StepNumber.PASSIVE])
    failed = [line.key for line in found.lines if line.failed]
    assert (
        failed
        == [key for key in run.kept()[case.name]["failed"] if key.startswith(f"{StepNumber.PASSIVE:d}-")]
        == ["6-precharge"]
    )
