"""Draw the pictures of README and guides: a swell under NS, HS and SSC; moments of a lowering to
3,000 m.

python docs/images/make.py
"""

from pathlib import Path

from stillhook import Scenario, Sine, load_crane
from stillhook.analysis.controllers import compare
from stillhook.engine.simulate import simulate
from stillhook.formats.lift_file import load_lift
from stillhook.report import kit
from stillhook.report.plots.moments import strip
from stillhook.report.plots.run import four_panels

SHOWN_FROM = 80.0  # s


def main() -> None:
    swell()
    anchor()


def anchor() -> None:
    file = load_lift("anchor-to-3000m")
    picture = strip(simulate(file.crane, file.lift), file.lift, title=file.lift.name)
    kit.save(picture, Path(__file__).with_name("anchor.png"))


def swell() -> None:
    tip = Sine(amplitude="2.8 m", period="12 s")
    result = compare(load_crane("nov-250t"), Scenario(load="100 t", s_w="100 m", tip=tip, duration="120 s"))
    data = result.dataset()
    runs = {mode.upper(): data.sel(case=mode) for mode in result.table()}
    title = "250 t active/passive crane, 100 t on the hook, 100 m of wire out, tip 2.8 m at 12 s"
    kit.save(four_panels(runs, title=title, start=SHOWN_FROM), Path(__file__).with_name("swell.png"))


if __name__ == "__main__":
    main()
