"""A controller has one colour, whatever it is shown with."""

from stillhook.library import cranes, load_crane
from stillhook.plan.definition.rules import usual_alternatives
from stillhook.plan.report.figures import COLOUR
from stillhook.report.plots.colours import COLOURS, CONTROLLERS, colours_of


def test_a_controller_has_the_same_colour_in_every_picture():
    for labels in (("ns", "hs", "ssc"), ("ssc",), ("SSC", "measured"), ("strong-ssc", "ssc-tuned")):
        for label, colour in colours_of(labels).items():
            name = label.lower().removesuffix("-tuned")
            assert colour == CONTROLLERS.get(name, colour)
    assert colours_of(["strong SSC"])["strong SSC"] == COLOUR["strong-ssc"] == CONTROLLERS["strong-ssc"]
    assert {name: COLOUR[name] for name in ("none", "cap-80", "ns", "hs", "ssc")} == {
        name: CONTROLLERS[name] for name in ("none", "cap-80", "ns", "hs", "ssc")
    }


def test_lines_side_by_side_are_told_apart():
    of_cranes = [[a.value for a in usual_alternatives(load_crane(name))] for name in cranes()]
    for labels in (("ssc", "ssc-tuned", "measured"), tuple(map(str, COLOURS)), *of_cranes):
        assert len(set(colours_of(labels).values())) == len(labels)
