"""A crane file that builds on another one: what it says replaces what that says, whole tables where parts make no sense."""

from stillhook.library.crane_file import _over_base
from stillhook.library.toml.tree import Leaf
from stillhook.spec.crane import Source, SourceKind

SOURCE = Source(text="a test", kind=SourceKind.USER)


def leaves(**values: object) -> dict[str, Leaf]:
    return {name: Leaf(value, SOURCE) for name, value in values.items()}


def test_a_certificate_replaces_that_of_the_base_as_a_whole_and_without_one_that_stays():
    """Half of one certificate with half of another would be signed by nobody."""
    base = {"SWL": Leaf("250 t", SOURCE), "certified": leaves(level=2, until="2027-01-01")}
    own = _over_base(base, {"certified": leaves(level=1)}, "own.toml")
    assert {name: leaf.value for name, leaf in own["certified"].items()} == {"level": 1}
    plain = _over_base(base, leaves(SWL="200 t"), "own.toml")
    assert plain["certified"] == base["certified"]
    assert plain["SWL"].value == "200 t"
