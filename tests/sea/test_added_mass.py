"""Added mass, areas and volumes of shapes over submergence, against other published values, limits and symmetries."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stillhook.engine.pack.payload import COLUMNS, pack_payload
from stillhook.errors import LiftError
from stillhook.physics.load_path.payload import LEVELS
from stillhook.spec.lift import shapes as formula
from stillhook.spec.lift.payload import Payload

RHO = 1025.0
READ_OFF = 0.015
"""Straight between the kept ratios against coefficients that tables print between them, with three digits."""
TALL = 0.06
"""The height factor is a fit to prisms."""
EXACT = 1e-12

KINDS = {
    "plate": {"length": "6 m", "width": "4 m", "height": "0.4 m", "perforation": 0.1},
    "box": {"length": "6 m", "width": "4 m", "height": "3 m", "wall": "0.1 m", "perforation": 0.1},
    "disc": {"diameter": "5 m", "height": "0.4 m"},
    "suction-anchor": {"diameter": "5 m", "height": "10 m", "wall": "30 mm", "roof": "0.3 m", "hatch": 0.03},
    "spool": {"diameter": "0.4 m", "length": "50 m"},
    "frame": {"diameter": "0.8 m", "length": "100 m", "height": "5 m"},
}
kinds = pytest.mark.parametrize("kind", sorted(KINDS))


def column(rows, name):
    return rows[:, COLUMNS.index(name)]


def slopes(rows):
    """Slopes of the added mass at both ends of every piece."""
    return rows[:, [COLUMNS.index("dA33"), COLUMNS.index("dA33_next")]]


def payload(kind: str, **more) -> Payload:
    return Payload(**{"name": kind, "mass": "60 t", "shape": kind, **KINDS[kind], **more})


# Formulas


@pytest.mark.parametrize(
    ("ratio", "C_A"), [(1.25, 0.642), (1.5, 0.690), (2.5, 0.801), (4.0, 0.872), (6.25, 0.917), (8.0, 0.934)]
)
def test_plates_between_the_kept_ratios_agree_with_printed_coefficients(ratio, C_A):
    """Table of rectangular plates in DNV-RP-H103, appendix A."""
    assert formula.plate(1.0, 1.0, ratio) == pytest.approx(C_A * math.pi / 4.0 * ratio, rel=READ_OFF)


def test_a_long_plate_is_a_strip_of_two_dimensional_flow():
    assert formula.plate(1.0, 2.0, 2000.0) == pytest.approx(math.pi * 2000.0, rel=1e-3)


def test_a_plate_has_no_first_side():
    assert formula.plate(RHO, 3.0, 7.0) == formula.plate(RHO, 7.0, 3.0)


def test_a_square_plate_and_a_disc_of_its_area_carry_nearly_the_same_water():
    """Both are flat and compact; the disc, with the shorter rim, moves a little more."""
    square, disc = formula.plate(1.0, 1.0, 1.0), formula.disc(1.0, math.sqrt(1.0 / math.pi))
    assert 1.0 < disc / square < 1.06


@pytest.mark.parametrize(("height", "C_A"), [(1.0, 0.68), (2.0, 0.36), (3.0, 0.24)])
def test_the_height_factor_gives_square_prisms_their_printed_added_mass(height, C_A):
    """C_A of square prisms on their own volume, DNV-RP-H103, appendix A."""
    grown = formula.plate(1.0, 1.0, 1.0) * formula.height_factor(1.0, height)
    assert grown == pytest.approx(C_A * height, rel=TALL)


def test_a_flat_body_has_no_height_to_grow_by_and_an_endless_one_grows_by_the_root_of_a_half():
    assert formula.height_factor(4.0, 0.0) == 1.0
    assert formula.height_factor(4.0, 1e9) == pytest.approx(1.0 + math.sqrt(0.5), rel=1e-6)


@pytest.mark.slow
@given(st.floats(0.0, 0.5), st.floats(0.0, 0.1))
@settings(deadline=None)
def test_more_holes_never_leave_more_added_mass(p, more):
    assert formula.perforation_factor(min(p + more, 0.5)) <= formula.perforation_factor(p) + EXACT


def test_small_holes_change_nothing_and_half_a_plate_of_holes_leaves_a_quarter():
    assert formula.perforation_factor(0.05) == 1.0
    assert formula.perforation_factor(0.5) == pytest.approx(0.24, abs=0.01)


# Shapes


@kinds
def test_added_mass_and_volume_never_fall_on_the_way_down_and_end_at_those_of_the_covered_payload(kind):
    load = payload(kind)
    curve, covered = load.curve(RHO), load.covered(RHO)
    assert np.diff(curve.A33).min() >= -1e-9 * covered.A33
    assert np.diff(curve.V).min() >= -1e-12
    assert curve.A33[0] == curve.V[0] == 0.0
    assert (curve.A33[-1], curve.V[-1]) == pytest.approx((covered.A33, covered.V), rel=EXACT)
    deep = load.at(np.array([1e4]), RHO)
    assert deep.A33[0] == pytest.approx(covered.A33, rel=EXACT)


@kinds
def test_a_payload_of_steel_displaces_its_mass_of_steel_unless_its_volume_is_given(kind):
    assert payload(kind).covered(RHO).V == pytest.approx(60e3 / 7850.0)
    assert payload(kind, volume="7 m^3").covered(RHO).V == pytest.approx(7.0)


@kinds
def test_added_mass_goes_with_the_density_of_the_water(kind):
    load = payload(kind)
    assert load.covered(1000.0).A33 == pytest.approx(load.covered(RHO).A33 * 1000.0 / RHO, rel=EXACT)


@kinds
def test_payloads_of_twice_the_size_carry_eight_times_the_water(kind):
    double = {
        k: v if isinstance(v, float) else f"{2 * float(v.split()[0])} {v.split()[1]}" for k, v in KINDS[kind].items()
    }
    assert payload(kind, **double).covered(RHO).A33 == pytest.approx(8.0 * payload(kind).covered(RHO).A33, rel=1e-9)


@kinds
def test_the_levels_lose_no_momentum(kind):
    record, rows = pack_payload(payload(kind), RHO, 100.0)
    assert rows.shape == (LEVELS, len(COLUMNS))
    h = column(rows, "h")
    assert np.sum(slopes(rows)[:-1].mean(axis=1) * np.diff(h)) == pytest.approx(
        payload(kind).covered(RHO).A33, rel=1e-9
    )
    assert h[0] == 0.0
    assert np.all(np.diff(h) > 0.0)
    assert h[-1] == record.reach >= record.H


@kinds
def test_every_face_has_a_level(kind):
    load = payload(kind)
    h = column(pack_payload(load, RHO, 100.0)[1], "h")
    for face in (0.0, load.shape.contact, load.height):
        assert np.abs(h - face).min() == 0.0


def test_every_face_of_every_part_of_an_assembly_has_a_level():
    """Undersides, roofs and tops of parts at four heights: what slams there is not spread over a level that began before."""
    parts = [{"shape": "disc", "at": f"{at} m", **KINDS["disc"]} for at in (0.0, 1.37, 2.91)]
    parts.append({"shape": "suction-anchor", "at": "0.11 m", **KINDS["suction-anchor"]})
    load = Payload(name="tower", mass="200 t", shape="assembly", parts=parts)
    _, rows = pack_payload(load, RHO, 100.0)
    h, slope = column(rows, "h"), column(rows, "dA33")
    for at, body in (
        (0.0, load.shape.parts[0].shape),
        (1.37, load.shape.parts[1].shape),
        (2.91, load.shape.parts[2].shape),
    ):
        assert np.abs(h - at).min() < 1e-12
        jump = slope[np.abs(h - at).argmin()] - (
            column(rows, "dA33_next")[np.abs(h - at).argmin() - 1] if at > 0.0 else 0.0
        )
        assert jump == pytest.approx(0.5 * RHO * body.C_s * body.solid_area, rel=0.01)
    roof = 0.11 + load.shape.parts[3].shape.contact
    assert np.abs(h - roof).min() < 1e-12


def test_more_heights_than_levels_are_refused_in_one_line():
    levels = [{"h": f"{0.05 * i!r} m", "V": f"{i} L", "A33": f"{10 * i} kg", "A_p": "1 m^2"} for i in range(200)]
    load = Payload(name="stairs", mass="60 t", height="9.95 m", C_D=2.0, levels=levels)
    with pytest.raises(
        LiftError, match=r'Payload "stairs": 200 different heights .* at most 129 .* give fewer levels'
    ) as e:
        pack_payload(load, RHO, 100.0)
    assert "\n" not in str(e.value)


@pytest.mark.parametrize("kind", ["plate", "disc", "spool"])
def test_the_steepest_rise_of_the_added_mass_is_that_of_the_slamming_coefficient(kind):
    """The curve begins with the slope 1/2 rho C_s A_s, and so do the levels."""
    load = payload(kind, C_s=4.0)
    _, rows = pack_payload(load, RHO, 100.0)
    assert slopes(rows).max() == pytest.approx(0.5 * RHO * 4.0 * load.shape.solid_area, rel=1e-5)
    assert slopes(rows).max() == column(rows, "dA33")[0]


def test_a_suction_anchor_slams_once_the_water_reaches_its_roof():
    load = payload("suction-anchor")
    _, rows = pack_payload(load, RHO, 100.0)
    first = int(np.flatnonzero(column(rows, "dA33"))[0])
    assert column(rows, "h")[first] == pytest.approx(9.7, rel=1e-9)
    roof = 0.5 * RHO * 5.0 * math.pi / 4.0 * (5.0**2 - 0.03 * 4.94**2)
    inside = RHO * math.pi / 4.0 * 4.94**2 * 9.7 / (0.25 * 9.7)
    assert column(rows, "dA33")[first] == pytest.approx(roof + inside, rel=1e-5)
    gentle = pack_payload(payload("suction-anchor", engaged="9 m"), RHO, 100.0)[1]
    assert slopes(gentle).max() < 0.6 * slopes(rows).max()
    assert column(gentle, "A33")[-1] == pytest.approx(column(rows, "A33")[-1])


def test_a_suction_anchor_takes_the_water_inside_along():
    """The share of the water inside is what a disc of its size, of its height, does not explain."""
    load = payload("suction-anchor")
    inside = RHO * math.pi / 4.0 * 4.94**2 * 9.7
    outside = formula.disc(RHO, 2.5) * formula.height_factor(math.pi / 4.0 * 25.0, 10.0)
    assert load.covered(RHO).A33 == pytest.approx(inside + outside, rel=EXACT)
    assert payload("suction-anchor", hatch=0.2).covered(RHO).A33 < 0.8 * load.covered(RHO).A33


def test_skirts_displace_their_steel_evenly_and_the_roof_the_rest():
    load = payload("suction-anchor")
    V = load.at(np.array([0.0, 4.85, 9.7, 10.0]), RHO).V
    assert V[1] == pytest.approx(V[2] / 2.0)
    skirt = math.pi * 4.97 * 0.03 * 9.7
    roof = 0.3 * load.shape.solid_area
    assert V[2] / V[3] == pytest.approx(skirt / (skirt + roof), rel=1e-9)


def test_a_spool_carries_as_much_water_as_its_outside_encloses():
    assert payload("spool").covered(RHO).A33 == pytest.approx(RHO * math.pi * 0.2**2 * 50.0)


def test_a_frame_whose_members_lie_in_one_layer_is_a_spool():
    flat = payload("frame", height="0.8 m")
    pipe = payload("spool", diameter="0.8 m", length="100 m")
    assert flat.at(np.linspace(0, 3, 50)).A33 == pytest.approx(pipe.at(np.linspace(0, 3, 50)).A33)


def test_a_tall_frame_slams_less_than_a_flat_one_and_carries_the_same_water():
    tall, flat = (pack_payload(payload("frame", height=h), RHO, 100.0)[1] for h in ("5 m", "0.8 m"))
    assert slopes(tall).max() < 0.4 * slopes(flat).max()
    assert column(tall, "A33")[-1] == pytest.approx(column(flat, "A33")[-1])


def test_a_tall_frame_of_thin_members_is_known_up_to_its_top():
    load = payload("frame", diameter="0.3 m", height="12 m", C_s=8.0)
    record, rows = pack_payload(load, RHO, 100.0)
    assert record.reach == 12.0
    assert column(rows, "V")[-1] == pytest.approx(60e3 / 7850.0)


def test_a_frames_added_mass_is_the_mean_of_its_members():
    """Against a sum over 20,000 members, each at its own height."""
    load = payload("frame")
    one = payload("spool", diameter="0.8 m", length="100 m")
    h = np.linspace(0.1, load.reach(RHO) * 1.1, 15)
    places = (np.arange(20_000) + 0.5) / 20_000 * 4.2
    mean = [float(one.shape.added_mass(x - places, RHO).mean()) for x in h]
    assert load.at(h, RHO).A33 == pytest.approx(mean, rel=1e-4)


# Assemblies


@kinds
def test_an_assembly_of_one_part_is_that_part(kind):
    alone = payload(kind)
    whole = Payload(name="one", mass="60 t", shape="assembly", parts=[{"shape": kind, "mass": "60 t", **KINDS[kind]}])
    h = np.linspace(0.0, alone.reach(RHO), 40)
    for a, b in zip(whole.at(h, RHO), alone.at(h, RHO), strict=True):
        assert a == pytest.approx(b, rel=1e-9)
    assert pack_payload(whole, RHO, 100.0)[0].gap_B == pack_payload(alone, RHO, 100.0)[0].gap_B


def test_parts_add_up_and_higher_ones_come_later():
    parts = {
        "low": {"shape": "disc", "count": 3, **KINDS["disc"]},
        "high": {"shape": "disc", "at": "6 m", **KINDS["disc"]},
    }
    whole = Payload(name="two", mass="60 t", shape="assembly", parts=parts)
    one = payload("disc").shape.added_mass(np.array([1.0]), RHO)[0]
    assert whole.height == 6.4
    assert whole.at(np.array([1.0]), RHO).A33[0] == pytest.approx(3.0 * one)
    assert whole.covered(RHO).A33 == pytest.approx(4.0 * payload("disc").covered(RHO).A33)


def test_volume_follows_the_masses_of_the_parts():
    parts = [
        {"shape": "disc", "mass": "45 t", **KINDS["disc"]},
        {"shape": "disc", "mass": "15 t", "at": "6 m", **KINDS["disc"]},
    ]
    whole = Payload(name="two", mass="60 t", shape="assembly", parts=parts)
    V = whole.at(np.array([1.0, 7.0]), RHO).V
    assert V[0] / V[1] == pytest.approx(0.75)


# Given levels


def levels(*rows):
    return [{"h": f"{h} m", "V": f"{V} m^3", "A33": f"{A} t", "A_p": f"{S} m^2"} for h, V, A, S in rows]


def test_given_levels_are_met_and_joined_without_overshoot():
    load = Payload(
        name="own",
        mass="60 t",
        height="3 m",
        C_D=2.0,
        levels=levels((0, 0, 0, 0), (1, 2, 5, 10), (3, 4, 90, 12), (5, 4, 90, 12)),
    )
    at = load.at(np.array([0.0, 1.0, 3.0, 5.0, 50.0]))
    assert at.A33 == pytest.approx([0.0, 5e3, 90e3, 90e3, 90e3])
    assert at.V == pytest.approx([0.0, 2.0, 4.0, 4.0, 4.0])
    fine = load.curve().A33
    assert np.diff(fine).min() >= 0.0
    assert fine.max() == pytest.approx(90e3)


def test_a_payload_and_what_was_stored_of_it_are_the_same():
    for kind in KINDS:
        load = payload(kind, seabed={"settlement": "0.3 m"}, lift_off={"suction": "200 kN"})
        assert Payload.from_dict(json.loads(json.dumps(load.to_dict()))) == load
    own = Payload(name="own", mass="60 t", height="1 m", C_D=2.0, levels=levels((0, 0, 0, 0), (1, 2, 5, 10)))
    assert Payload.from_dict(json.loads(json.dumps(own.to_dict()))) == own
