"""The independent crane stays independent, and validation still refutes what its page says that it refutes."""

import ast

import pytest
from tests.scripts import PAGES, script

from stillhook.validate import validate
from stillhook.validate.criteria.results import StepNumber

PLANT = ("independent_crane", "independent_plant", "independent_plc", "independent_sea_trial")
NUMBERS = {
    "stillhook": {"Crane"},
    "stillhook.engine.pack.winch": {"drum_record", "gains", "inertia_record"},
    "stillhook.library": {"load_crane"},
}
"""All that it may take of the package: the crane file and numbers that follow from it."""


@pytest.fixture
def scripts():
    """The scripts of the cases and of the trials."""
    return script(PAGES / "independent_crane.py"), script(PAGES / "independent_crane_trials.py")


@pytest.mark.parametrize("name", PLANT)
def test_the_independent_crane_takes_numbers_and_no_law_of_the_package(name):
    for node in ast.walk(ast.parse((PAGES / f"{name}.py").read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert not any(alias.name.partition(".")[0] == "stillhook" for alias in node.names)
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "stillhook":
            assert {alias.name for alias in node.names} <= NUMBERS.get(node.module, set())


@pytest.mark.thorough
def test_a_wrong_precharge_of_the_file_is_refuted_as_it_was_kept(scripts, tmp_path):
    crane, trials = scripts
    case = trials.BY_NAME["precharge"]
    found = validate(crane.write_campaign(tmp_path, case), steps=[StepNumber.PASSIVE])
    failed = [line.key for line in found.lines if line.failed]
    assert (
        failed
        == [key for key in trials.kept()[case.name]["failed"] if key.startswith(f"{StepNumber.PASSIVE:d}-")]
        == ["6-precharge"]
    )
