"""Payloads of the library and from files: every number sourced, plausible as steel, and each mistake reported in one line."""

import math
import re
import tomllib
from importlib.resources import files
from pathlib import Path

import pytest

from stillhook.engine.pack.payload import pack_payload
from stillhook.errors import LiftError, StillhookError
from stillhook.library.catalogue import payloads, read_payload
from stillhook.library.toml.tree import LABELS
from stillhook.physics.load_path.payload import WettedLevel
from stillhook.spec.crane import SourceKind
from stillhook.spec.lift.payload import Payload

RHO = 1025.0
names = pytest.mark.parametrize("name", payloads())


def leaves(table: dict, path: str = "") -> list[tuple[str, object]]:
    out: list[tuple[str, object]] = []
    for key, item in table.items():
        place = f"{path}.{key}" if path else key
        out += leaves(item, place) if isinstance(item, dict) and "value" not in item else [(place, item)]
    return out


# Library


def test_the_library_has_each_kind_of_payload():
    shapes = {read_payload(name).shape.kind for name in payloads()}
    assert shapes == {"suction-anchor", "assembly", "plate", "box", "spool"}


@names
def test_every_number_of_a_library_payload_has_a_kind_and_a_source(name):
    text = (files("stillhook.library") / "data" / "payloads" / f"{name}.toml").read_text(encoding="utf-8")
    found = leaves(tomllib.loads(text))
    for path, leaf in found:
        if path in LABELS:
            continue
        assert set(leaf) == {"value", "kind", "source"}, path
        assert leaf["kind"] in {kind.value for kind in SourceKind} - {"user"}, path
        assert len(leaf["source"]) > 4, path
    assert set(read_payload(name).sources) == {path for path, _ in found} - LABELS


@names
def test_a_library_payload_is_named_as_its_file_and_by_its_mass(name):
    load = read_payload(name)
    assert load.name == name
    assert float(name.split("-")[-1].removesuffix("t")) * 1e3 == load.mass


@names
def test_a_library_payload_sinks_lands_and_is_slammed_within_reason(name):
    """Speeds of free sinking from 1 to 5 m/s, water taken along from a third to twenty times the mass."""
    load = read_payload(name)
    record, rows = pack_payload(load, RHO, 500.0)
    covered = WettedLevel(*rows[-1])
    W = record.W - RHO * record.g * covered.V
    assert 0.5 * record.W < W < record.W
    assert 1.0 < math.sqrt(W / covered.B) < 5.0
    assert 0.3 < covered.A33 / load.mass < 20.0
    assert 0.0 < record.gap_B <= record.gap_0 < load.height + 3.0


@pytest.mark.parametrize(
    ("name", "part", "heaviest"), [("suction-anchor-85t", None, 85.0), ("template-230t", "anchors", 25.0)]
)
def test_skirts_of_suction_anchors_weigh_less_than_the_anchor(name, part, heaviest):
    shape = read_payload(name).shape
    body = shape if part is None else shape.parts[0].shape
    skirt = math.pi * (body.diameter - body.wall) * body.wall * body.contact * 7.85
    assert 0.5 * heaviest < skirt < 0.8 * heaviest


# Files


def written(folder: Path, text: str) -> Path:
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_payload_of_ones_own_is_described_by_its_dimensions(tmp_path):
    path = written(
        tmp_path, 'mass = "40 t"\nshape = "disc"\ndiameter = "5 m"\nheight = "0.4 m"\n[seabed]\nsettlement = "5 cm"\n'
    )
    load = read_payload(path)
    assert (load.name, load.mass, load.height, load.C_D, load.seabed.settlement) == ("mine", 40e3, 0.4, 2.5, 0.05)
    assert load.sources["mass"].kind is SourceKind.USER
    assert read_payload(str(path)) == load


def test_parts_and_levels_are_read_from_tables_and_lists(tmp_path):
    parts = 'mass = "40 t"\nshape = "assembly"\n[parts.mat]\nshape = "plate"\nlength = "5 m"\nwidth = "4 m"\nheight = "0.4 m"\n'
    assert read_payload(written(tmp_path, parts)).shape.solid_area == 20.0
    rows = "".join(f'[[levels]]\nh = "{h} m"\nV = "{h} m^3"\nA33 = "{9 * h} t"\nA_p = "8 m^2"\n' for h in (0, 1, 2))
    load = read_payload(written(tmp_path, f'mass = "40 t"\nheight = "2 m"\nC_D = 2.0\n{rows}'))
    assert load.covered(RHO).A33 == 18e3
    assert load.sources["levels.2.A33"].text == "given in mine.toml"


DISC = 'mass = "40 t"\nshape = "disc"\ndiameter = "5 m"\nheight = "0.4 m"\n'
ANCHOR = 'mass = "40 t"\nshape = "suction-anchor"\ndiameter = "5 m"\nheight = "9 m"\nwall = "3 cm"\nroof = "0.3 m"\n'


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "mine.toml: empty. Give name, mass and a shape with its dimensions."),
        (
            "mass = 40 t",
            "mine.toml: not valid TOML: Expected newline or end of document after a statement (at line 1, column 11).",
        ),
        (
            'mass = "40 t"',
            "mine.toml: Payload: give either levels or a shape (plate, box, disc, suction-anchor, spool, frame, assembly) with its dimensions.",
        ),
        (
            DISC.replace('"40 t"', "40"),
            'mine.toml: Payload.mass = 40: a bare number; write it as text with its unit, "40 t" (allowed: kg, t, te).',
        ),
        (
            DISC.replace("40 t", "40 m"),
            'mine.toml: Payload.mass = "40 m": unit "m" is not one of kg, t, te.',
        ),
        (
            DISC.replace("disc", "dics"),
            'mine.toml: Payload.shape = "dics": not one of plate, box, disc, suction-anchor, spool, frame, assembly; did you mean "disc"?',
        ),
        (DISC.replace("diameter", "radius"), 'mine.toml: Payload.radius: unknown field for shape "disc".'),
        (DISC.replace('diameter = "5 m"\n', ""), "mine.toml: Disc.diameter: missing (in m, cm, mm, km). Add it."),
        (DISC.replace('"5 m"', '"-5 m"'), 'mine.toml: Disc.diameter = "-5 m": it must be greater than 0.'),
        (DISC + "perforation = 0.7", "mine.toml: Disc.perforation = 0.7: it must be less than or equal to 0.5."),
        (DISC + "perforation = nan", "mine.toml: Disc.perforation = nan: it must be a finite number."),
        (
            DISC + '[seabed]\nzeta = "big"',
            'mine.toml: Seabed.zeta = "big": it must be a number (damping ratio of the payload with',
        ),
        (DISC + "C_D = -1.0", "mine.toml: Payload.C_D = -1.0: it must be greater than or equal to 0."),
        (
            DISC.replace("40 t", "400 t"),
            "mine.toml: Payload: it displaces 50960 L, its mass in steel, and its outside encloses 7854 L. Check mass, volume and dimensions.",
        ),
        (
            ANCHOR,
            "mine.toml: SuctionAnchor.hatch: missing (open area of the hatches as part of the inner area). Add it.",
        ),
        (ANCHOR + "hatch = 0.0", "mine.toml: SuctionAnchor.hatch = 0.0: it must be greater than 0."),
        (
            ANCHOR.replace("3 cm", "3 m") + "hatch = 0.1",
            "mine.toml: SuctionAnchor: wall 3 m leaves no room inside a diameter of 5 m.",
        ),
        ('mass = "4 t"\nshape = "assembly"', "mine.toml: Assembly.parts: missing. Add it."),
        ('mass = "4 t"\nshape = "assembly"\nparts = 3', "mine.toml: Assembly.parts = 3: it must be a list."),
        (
            'mass = "4 t"\nshape = "assembly"\n[parts.a]\nshape = "assembly"',
            'mine.toml: Part.shape = "assembly": not one of plate, box, disc, suction-anchor, spool, frame.',
        ),
        (
            'mass = "4 t"\n[shape]\nkind = "scaled"\nfactor = 0.1\nparts = []',
            'mine.toml: Payload.shape = "scaled": not one of plate, box, disc, suction-anchor, spool, frame, assembly.',
        ),
        (
            'mass = "4 t"\n[shape]\ndiameter = "5 m"',
            'mine.toml: Payload.shape = "": not one of plate, box, disc, suction-anchor, spool, frame, assembly.',
        ),
        (
            'mass = "4 t"\nheight = "2 m"\nC_D = 2.0',
            "mine.toml: Payload: give either levels or a shape (plate, box, disc, suction-anchor, spool, frame, assembly) with its dimensions.",
        ),
        (
            'mass = "4 t"\nheight = "2 m"\nC_D = 2.0\n[[levels]]\nh = "1 m"\nV = "0 m^3"\nA33 = "0 t"\nA_p = "0 m^2"',
            "mine.toml: Payload: levels: h must begin at 0 and rise. Sort them.",
        ),
    ],
)
def test_a_file_with_a_mistake_ends_in_one_line(tmp_path, text, line):
    with pytest.raises(LiftError) as caught:
        read_payload(written(tmp_path, text))
    assert str(caught.value).startswith(line)
    assert "\n" not in str(caught.value)


def test_a_shape_in_a_table_is_that_of_its_dimensions_next_to_the_payload(tmp_path):
    flat = read_payload(written(tmp_path, DISC))
    table = read_payload(written(tmp_path, 'mass = "40 t"\n[shape]\nkind = "disc"\ndiameter = "5 m"\nheight = "0.4 m"'))
    assert (table.shape, table.height, table.C_D) == (flat.shape, flat.height, flat.C_D)


def test_unknown_names_and_missing_files_are_told():
    with pytest.raises(LiftError, match=r'^No payload "mud-mat": the library has .*; did you mean "mud-mat-25t"\?'):
        read_payload("mud-mat")
    with pytest.raises(LiftError, match=r"nowhere\.toml.*no such file"):
        read_payload("nowhere.toml")


def test_a_payload_that_floats_cannot_be_packed():
    with pytest.raises(
        StillhookError, match=r'^Payload "buoy": it floats, for it weighs 4 t and displaces 10\.25 t of water\.'
    ):
        pack_payload(
            Payload(name="buoy", mass="4 t", volume="10 m^3", shape="disc", diameter="3 m", height="2 m"), RHO, 100.0
        )


# How-to


HOW_TO = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "describe-a-payload.md"
BLOCKS = re.findall(r"```toml\n(.*?)```", HOW_TO.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.parametrize("text", BLOCKS, ids=[block.split('"')[1] for block in BLOCKS])
def test_the_files_of_the_how_to_are_payloads_that_sink(tmp_path, text):
    load = read_payload(written(tmp_path, text))
    record, _ = pack_payload(load, RHO, 100.0)
    assert record.H == load.height
    assert load.name in text


def test_the_python_of_the_how_to_runs():
    for code in re.findall(r"```python\n(.*?)```", HOW_TO.read_text(encoding="utf-8"), re.DOTALL):
        exec(code, {})
