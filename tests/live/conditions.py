"""Dated campaigns on disk whose fit says what their remark says, and a certified crane file that they are of."""

import os
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from tests.signers import KEY
from tests.validate.staged_certificate import staged, write

from stillhook.live.condition import measured, outputs
from stillhook.statistics.estimate import Estimate
from stillhook.validate import certificate_of
from stillhook.validate.criteria.results import Measure

HALF = 0.016
"""Half width of the friction of a campaign."""
OLD = 1e9
"""Time of the last write to a campaign that is complete [s]."""


@dataclass
class Fits:
    """What was asked of `validate`: steps, names of tests, friction of the crane."""

    calls: list[tuple[list[int], list[str], float]] = field(default_factory=list)

    def __call__(self, campaign: Any, *, steps: Any, progress: Any = None) -> SimpleNamespace:
        Y_5 = campaign.crane.friction.system.Y_5
        self.calls.append((sorted(steps), [t.name for t in campaign.tests], Y_5))
        says = dict(r.split() for r in campaign.remarks)
        for test in campaign.tests:
            assert test.log.read_text().startswith("Time"), "a log that cannot be read"
        made = []
        if 1 in steps and "friction" in says:
            made.append(Measure.of("friction_error", Estimate.around(float(says["friction"]), HALF, 20, 0.005)))
        if 2 in steps:
            off = abs(1.0 + float(says.get("friction", 0.0)) - Y_5 / 0.00943)
            made += [Measure.of("e_c_pp_deviation", 0.01 + 0.1 * off), Measure.of("u_p_deviation", 0.004)]
        return SimpleNamespace(steps=[SimpleNamespace(measures=made)])

    @property
    def fitted(self) -> int:
        """Campaigns that were fitted."""
        return sum(1 in steps for steps, _, _ in self.calls)


@pytest.fixture
def fits(monkeypatch: pytest.MonkeyPatch) -> Fits:
    """In place of the fit, which takes a minute, and of the pictures."""
    return fits_in(monkeypatch)


def fits_in(patch: pytest.MonkeyPatch) -> Fits:
    """`fits` as long as a patch holds."""
    made = Fits()
    patch.setattr(outputs, "draw_if_possible", lambda _: {})
    patch.setattr(measured, "validate", made)
    return made


def campaign(
    folder: Path,
    date: str,
    friction: float | None,
    *,
    crane: str = "../certified/crane.toml",
    old: bool = True,
    mark: str = "",
) -> Path:
    """A campaign of three tests in heave compensation in a folder of its own."""
    folder.mkdir(parents=True)
    says = "" if friction is None else f'remarks = ["friction {friction}"]\n'
    tests = []
    for name in ("a", "b", "c"):
        log = folder / f"{name}.csv"
        log.write_text(f"Time [s],Tip [m]\n0,0\n0.1,{date} {name} {mark}\n")
        tests.append(f'[[test]]\nname = "{name}"\nlog = "{name}.csv"\nkind = "ahc"\nload = "82 t"\n')
    file = folder / "campaign.toml"
    file.write_text(f'title = "Quay {date}"\ndate = {date}\ncrane = "{crane}"\n{says}' + "\n".join(tests))
    if old:
        settle(folder)
    return file


def settle(folder: Path) -> None:
    """As if nothing had been written for long."""
    for path in folder.iterdir():
        os.utime(path, (OLD, OLD))


def certified(folder: Path, date: str = "2026-11-21", *, logs: str = "", extra: str = "") -> Path:
    """A crane file with its certificate of that date; logs: what tells its logs from others."""
    folder.mkdir(parents=True, exist_ok=True)
    place = folder.parent.with_name(f"{folder.parent.name}-trials") / folder.name / (logs or "first")
    file = write(place, synthetic=False)
    file.write_text(file.read_text().replace("2026-11-21", date))
    for log in (place / "logs").iterdir():
        log.write_text(log.read_text() + logs)
    made = certificate_of(staged(file)).signed(KEY)
    (folder / "certificate.json").write_text(made.text(), encoding="utf-8")
    (folder / "crane.toml").write_text(extra + made.crane_toml(), encoding="utf-8")
    return folder / "crane.toml"


DATES = ("2026-11-21", "2027-01-20", "2027-03-21", "2027-05-20", "2027-07-19", "2027-09-17")
WEAR = (0.0, 0.06, 0.13, 0.21, 0.3, 0.4)
"""Friction over that of the crane file in these campaigns."""


def worn(root: Path, values: tuple[float, ...] = WEAR) -> list[Path]:
    """A certified crane in `certified`, and campaigns of it that show these frictions."""
    certified(root / "certified")
    return [campaign(root / date, date, x) for date, x in zip(DATES, values, strict=False)]
