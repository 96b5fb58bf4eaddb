"""The examples that the package holds are what the generators make, and what the commands of README need."""

import numpy as np
import pytest
from trials.campaigns import examples

from stillhook import library
from stillhook.cli import run as command
from stillhook.errors import SimulationError
from stillhook.identify.motor.map import read_map
from stillhook.library.examples import (
    DATA,
    FRICTION_TESTS,
    MARK,
    MOTOR_MAP,
    SEA_TRIALS,
    example_campaign,
    example_map,
    stored_logs,
)
from stillhook.validate import load_campaign

STEP = 1.5
"""Largest difference [steps of a sensor] from what another processor simulates; here there is none."""


@pytest.mark.thorough
def test_the_generators_make_the_examples_again(tmp_path):
    examples.main(tmp_path)
    for old in (path for path in DATA.rglob("*") if path.suffix in (".toml", ".csv", ".json")):
        assert (tmp_path / old.relative_to(DATA)).read_text(encoding="utf-8") == old.read_text(encoding="utf-8")
    for example in (SEA_TRIALS, FRICTION_TESTS):
        for (name, old), (again, new) in zip(stored_logs(example), stored_logs(tmp_path / example.name), strict=True):
            assert name == again
            for heading, values in old.items():
                step = min(np.diff(np.unique(values)), default=1.0)
                assert np.allclose(values, new[heading], rtol=0.0, atol=STEP * step), heading


@pytest.mark.slow
def test_an_example_campaign_reads_and_says_that_it_is_synthetic(tmp_path, capsys):
    assert command(["example", "sea-trials", str(tmp_path / "sea"), "--verbose"]) == 0
    assert capsys.readouterr().out.startswith(f"{MARK}\nwritten: {tmp_path / 'sea' / 'campaign.toml'}")
    campaign = load_campaign(tmp_path / "sea" / "campaign.toml")
    assert campaign.synthetic
    assert [test.name for test in campaign.tests] == ["1", "2", "3", "4", "limits", "dynamics"]
    assert campaign.tests[0].log.read_text(encoding="utf-8").startswith(f"# {MARK}\nTime,Tip pos,")
    with pytest.raises(SimulationError, match=r"there are logs already. Choose another folder."):
        example_campaign(SEA_TRIALS, tmp_path / "sea")


def test_an_example_map_reads_and_overwrites_nothing(tmp_path):
    file = example_map(tmp_path / "map.csv")
    assert read_map(file).synthetic
    with pytest.raises(SimulationError, match="is there already, and may be a real map"):
        example_map(file)
    assert file.read_bytes() == MOTOR_MAP.read_bytes()


def test_nothing_in_the_package_imports_the_trials():
    package = DATA.parents[2]
    assert package.name == "stillhook"
    assert library.__file__.startswith(str(package))
    lines = [line for path in package.rglob("*.py") for line in path.read_text(encoding="utf-8").splitlines()]
    assert not [line for line in lines if line.lstrip().startswith(("from trials", "import trials"))]
