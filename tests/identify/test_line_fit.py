"""Restrictions of a line from a log of its own: what is found where the drop follows the law, and where it does not."""

import numpy as np
import pytest

from stillhook.identify import identify_component

R_1, R_2 = 2.0e7, 4.0e10
"""Laminar [Pa s/m^3] and turbulent restriction [Pa s^2/m^6]."""
N = 2000
SIGNALS = """[signals]
time = { column = "time", unit = "s" }
p_a_pump = { column = "p_a_pump", unit = "Pa" }
p_a_motor = { column = "p_a_motor", unit = "Pa" }
Q_line = { column = "Q_line", unit = "m^3/s", quantity = "flow" }
"""


@pytest.fixture
def line(tmp_path):
    """Fit of a log in which the drop of line A is that of the law times a share, and noise of the same deviation."""

    def fitted(share):
        rng, t = np.random.default_rng(4), 0.05 * np.arange(N)
        Q = 6.0e-3 * np.sin(2.0 * np.pi * t / 11.0) + 2.5e-3 * np.sin(2.0 * np.pi * t / 7.0)
        drop = R_1 * Q + R_2 * Q * np.abs(Q)
        noise = rng.normal(0.0, np.std(drop), N)
        p_motor = 100e5 + 0.0 * t
        p_pump = p_motor + share * drop + np.sqrt(1.0 - share**2) * noise
        rows = zip(*(x.tolist() for x in (t, p_pump, p_motor, Q)), strict=True)
        head, path = "time,p_a_pump,p_a_motor,Q_line", tmp_path / "line.csv"
        path.write_text("\n".join([head, *(",".join(map(repr, row)) for row in rows)]), encoding="utf-8")
        mapping = tmp_path / "mapping.toml"
        mapping.write_text(SIGNALS, encoding="utf-8")
        return identify_component("lines", path, mapping=mapping)

    return fitted


@pytest.mark.slow
def test_a_drop_that_follows_the_law_gives_its_restrictions(line):
    found = line(1.0)
    assert found["R_1_a"].value == pytest.approx(R_1, rel=1e-6)
    assert found["R_2_a"].value == pytest.approx(R_2, rel=1e-6)
    assert found.usable


@pytest.mark.slow
def test_a_drop_that_is_mostly_something_else_is_not_to_be_used(line):
    """Half of the drop's deviation is its law: sqrt(1 - 0.5^2) = 0.87 of it is left."""
    assert not line(0.5).usable
    assert line(0.95).usable
