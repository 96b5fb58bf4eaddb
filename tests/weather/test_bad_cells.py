"""Cells of a weather table that are no numbers: the first is named with its line, and how many there are."""

import pytest

from stillhook.errors import StillhookError
from stillhook.formats.weather.file import read_weather


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        (("1.0", "x7", "1.2"), 'line 3: Hs [m] = "x7" is not a finite number.'),
        (("1.0", "x7", "x8"), 'line 3: Hs [m] = "x7" is not a finite number (2 such values).'),
    ],
)
def test_the_first_bad_cell_is_named_and_the_others_are_counted(tmp_path, cells, words):
    rows = [f"2020-01-01T0{i}:00Z,{cell}" for i, cell in enumerate(cells)]
    (tmp_path / "w.csv").write_text("\n".join(["time,Hs [m]", *rows, ""]), encoding="utf-8")
    with pytest.raises(StillhookError) as refused:
        read_weather(tmp_path / "w.csv")
    assert words in str(refused.value)
