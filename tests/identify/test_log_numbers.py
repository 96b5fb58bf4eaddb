"""Numbers and stamps of a log in text: the double nearest to the text, however many digits it has."""

import math

import numpy as np
import pytest

from stillhook.formats.table.stamps import stamps_to_seconds
from stillhook.logs.formats.csv import EXACT_DIGITS, open_csv
from stillhook.logs.formats.source import Want

COLUMNS = 6


def read(folder, rows, separator=",", decimal="."):
    """Columns of numbers as the reader has them."""
    text = [separator.join(cell.replace(".", decimal) for cell in row) for row in rows]
    head = separator.join(f"x{i} [m]" for i in range(COLUMNS))
    (folder / "log.csv").write_text("\n".join([head, *text, ""]), encoding="utf-8")
    wants = [Want((i,)) for i in range(COLUMNS)]
    pieces = [chunk.values for chunk in open_csv(folder / "log.csv").chunks(wants, 1 << 16)]
    return np.column_stack([np.concatenate([piece[want] for piece in pieces]) for want in wants])


@pytest.mark.slow
@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ",")])
@pytest.mark.parametrize("digits", [4, EXACT_DIGITS, EXACT_DIGITS + 1, 17])
def test_every_number_is_the_double_nearest_to_its_text(tmp_path, digits, separator, decimal):
    rng = np.random.default_rng(digits)
    x = rng.normal(size=(4000, COLUMNS)) * 10.0 ** rng.integers(-3, 5, size=(4000, COLUMNS))
    rows = [[f"{value:.{digits}f}"[: digits + 2] for value in row] for row in x.tolist()]
    expected = np.array([[float(cell) for cell in row] for row in rows])
    assert np.array_equal(read(tmp_path, rows, separator, decimal), expected)


def test_exponents_are_read_to_the_last_bit(tmp_path):
    cells = ["1.7e-30", "9.3e-23", "1e22", "1e23", "-7.1e-300", "2.2e307"]
    assert np.array_equal(read(tmp_path, [cells] * 3), np.array([[float(cell) for cell in cells]] * 3))


def test_a_column_of_true_and_false_is_words_beside_columns_of_numbers(tmp_path):
    (tmp_path / "log.csv").write_text("a [m],on,b [m]\n1.5,true,0\n2.5,false,1\n", encoding="utf-8")
    a, on, b = (Want((i,)) for i in range(3))
    (chunk,) = open_csv(tmp_path / "log.csv").chunks([a, on, b], 1 << 16)
    assert chunk.values[a].tolist() == [1.5, 2.5]
    assert chunk.values[b].tolist() == [0.0, 1.0]
    assert np.isnan(chunk.values[on]).all()
    assert chunk.texts == {on: ("true", "false")}


@pytest.mark.parametrize("pattern", ["%d.%m.%Y %H:%M:%S%.f", "%d.%m.%Y %H:%M:%S.%f", "UTC"])
def test_a_fraction_of_a_second_is_read_as_a_fraction(pattern):
    first, second, wrong = stamps_to_seconds(["03.04.2020 10:00:00.5", "03.04.2020 10:00:00.750", "none"], pattern)
    assert second - first == pytest.approx(0.25, abs=1e-6)  # a double of seconds since 1970 has steps of 0.24 us
    assert math.isnan(wrong)
