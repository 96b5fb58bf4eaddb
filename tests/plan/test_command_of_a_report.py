"""The command that a report prints, by which its numbers come again on another machine."""

import pytest

from stillhook.plan.report.basis import _file


@pytest.mark.parametrize(
    ("file", "shown"),
    [
        ("plan.toml", "plan.toml"),
        ("lifts/plan.toml", "lifts/plan.toml"),
        ("/srv/lifts/plan.toml", "plan.toml"),
        (r"C:\lifts\plan.toml", "plan.toml"),
        ("D:/lifts/plan.toml", "plan.toml"),
        (r"lifts\plan.toml", "lifts/plan.toml"),
        ("template-to-1500m, of the library", "template-to-1500m"),
        ("a lift (of crane, and ship), of the library", "a lift (of crane, and ship)"),
    ],
)
def test_folders_of_this_machine_are_not_in_it(file: str, shown: str):
    """Of a path from the root its last part stays, on Windows as well; of a sentence its beginning."""
    assert _file(file) == shown
