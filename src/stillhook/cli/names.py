"""What older versions called commands and options.

Old names work for this version: the command line is rewritten before it is read, and a note on standard error says the
new one. What moved into a file is refused with the key that it has there. `tests/api/test_command_names.py` holds every
command against these tables, and against that of the options with the one meaning of each (`tests/api/options.toml`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from stillhook.errors import CommandError


class Renamed(NamedTuple):
    """What an older version called a command: its words, those of today, and an option that they need."""

    words: tuple[str, ...]
    option: str = ""


OLD_COMMANDS: Mapping[tuple[str, ...], Renamed] = {
    ("cranes",): Renamed(("list", "cranes")),
    ("list", "plans"): Renamed(("list", "lifts")),
    ("vessel", "list"): Renamed(("list", "vessels")),
    ("payload", "list"): Renamed(("list", "payloads")),
    ("friction", "sets"): Renamed(("list", "frictions")),
    ("vessel", "show"): Renamed(("vessel",)),
    ("vessel", "check"): Renamed(("vessel",), "--check"),
    ("payload", "show"): Renamed(("payload",)),
    ("identify", "example-map"): Renamed(("example", "motor-map")),
    ("identify", "example-campaign"): Renamed(("example", "friction-tests")),
    ("certificate", "example-campaign"): Renamed(("example", "sea-trials")),
    ("plan", "example"): Renamed(("example", "plan")),
    ("certificate", "show"): Renamed(("certificate",)),
    ("certificate", "check"): Renamed(("certificate",), "--check"),
}
AS_ARGUMENT = ""
"""The value of an old option that is an argument now."""
OLD_OPTIONS: Mapping[tuple[str, ...], Mapping[str, str]] = {
    ("compare",): {"--modes": "--controllers", "--crane": AS_ARGUMENT},
    ("envelope",): {"--modes": "--controllers", "--load": "--loads"},
    ("uncertainty",): {"--modes": "--controllers", "--crane": AS_ARGUMENT},
    ("stability",): {"--mode": "--controller"},
    ("response",): {"--mode": "--controller", "--sea": "--wave"},
    ("map",): {"--period": "--periods"},
    ("calc",): {"--displacement": "D_m=", "--speed": "omega_m=", "--dp": "dp_m=", "--drum-torque": "T_d="}
    | {"--layer": "layer=", "--s-w": "s_w=", "--alpha-m": "alpha_m=", "--v-w": "v_w="}
    | dict.fromkeys(("--controller", "--mode"), "controller="),
    ("friction", "draws"): {"--mode": "--controller", "--n": "--draws"},
    ("external",): {"--platform": "--platforms"},
    ("plan",): {"--alpha": "--forecast-factors", "--quick": "--tier=frequency"}
    | {"--threads": "--workers", "--scheduler": "--workers"},
    ("demo",): {"--quick": "quick"},
    ("tip",): {"--vessel": AS_ARGUMENT},
    ("fmu",): {"--ssp": "--contents=ssp"},
    ("lower",): {"--animation": "--film=ssc"},
    ("weather", "alpha"): {"--table": "--forecast-factors"},
    ("weather", "forecast"): {"--table": "--forecast-factors"},
    ("weather", "lift"): {"--table": "--forecast-factors"},
}
"""Options by the command of today; NAME= is an argument NAME=VALUE now."""


def _in(file: str, **keys: str) -> dict[str, str]:
    """Options by name, each with the place that it moved to."""
    return {f"--{option.replace('_', '-')}": f"{key} in {file}" for option, key in keys.items()}


CASE = "a case file (stillhook COMMAND CASE.toml)"
WEATHER = "a description of the weather file (stillhook weather COMMAND WEATHER.toml)"
_RUN = _in(CASE, warm_up="scenario.warm_up", step="step")
_SEED = _in(CASE, seed="settings.seed")
_DELAY = _in(CASE, delay="scenario.sensors.delay")
_STORED = _in(CASE, store="settings.store", scheduler="settings.scheduler")
_LOG = {"heave": "scenario.tip.heave", "start": "scenario.tip.start"}
_TABLE = _in(
    WEATHER,
    direction="sense",
    time="time",
    date_order="date_order",
    time_zone="time_zone",
    step="step",
)
MOVED: Mapping[tuple[str, ...], Mapping[str, str]] = {
    ("compare",): _RUN
    | _SEED
    | _DELAY
    | _in(CASE, **_LOG, position="scenario.tip.position", draws="settings.draws")
    | _in(CASE, top_speed="settings.top_speed", full_plan="settings.full_plan"),
    ("lower",): _in("the lift file", step="step"),
    ("map",): _RUN | _STORED | _in(CASE, motion="scenario.tip", duration="scenario.duration"),
    ("uncertainty",): _RUN | _SEED | _STORED | _in(CASE, at_most="settings.at_most"),
    ("tune",): _SEED | _DELAY | _in(CASE, s_w="scenario.s_w", budget="settings.budget"),
    ("friction", "draws"): _in(
        "the case file of --crane", seed="settings.seed", s_w="scenario.s_w", motion="scenario.tip"
    ),
    ("identify", "friction"): _in(
        "the campaign file",
        like="fit.like",
        keep_Y_2="fit.keep_Y_2",
        loops="fit.loops",
        map="fit.map",
        variant="fit.variant",
        seed="fit.seed",
        proposals="fit.proposals",
    ),
    ("identify", "curve"): _in(
        "the file of --mapping",
        position="curve.position",
        command="curve.command",
        least_length="curve.least_length",
        least_speed="curve.least_speed",
        speed="curve.speed",
        effort="curve.effort",
    ),
    ("tip",): _in(
        '--boom "x=-10 m, y=-6 m, z=15 m, slew 270 deg, main 25 m 50 deg"',
        pedestal="x, y, z",
        slew="slew",
        main="main",
        knuckle="knuckle",
    )
    | _in("the case file of --log", **_LOG, time="scenario.tip.time", max_gap="scenario.tip.max_gap"),
    **dict.fromkeys((("weather", "persistence"), ("weather", "forecast"), ("weather", "show")), _TABLE),
}
"""Options that moved into files or other options, and where each is now."""


def modern(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """A command line in the names of today, and a note for each old one in it. Errors: CommandError for an option that
    moved into a file."""
    words, notes = list(arguments), []
    for old, new in OLD_COMMANDS.items():
        if tuple(words[: len(old)]) == old:
            words = [*new.words, *words[len(old) :], *([new.option] if new.option else [])]
            called = " ".join((*new.words, *(["..."] if new.option else []), new.option)).strip()
            notes.append(f'"stillhook {" ".join(old)}" is called "stillhook {called}" now')
            break
    for command, options in OLD_OPTIONS.items():
        if tuple(words[: len(command)]) == command:
            words = list(command) + _renamed(words[len(command) :], options, notes)
    for command, places in MOVED.items():
        if tuple(words[: len(command)]) == command:
            _refuse_moved(words, places)
    return words, list(dict.fromkeys(notes))


def _refuse_moved(words: Sequence[str], places: Mapping[str, str]) -> None:
    for word in words[: words.index("--")] if "--" in words else words:
        name = word.partition("=")[0]
        if name in places:
            raise CommandError(f"{name}: moved. Write {places[name]}.")


def _renamed(words: Sequence[str], options: Mapping[str, str], notes: list[str]) -> list[str]:
    out: list[str] = []
    rest = iter(words)
    for word in rest:
        if word == "--":
            return [*out, word, *rest]
        name, sign, value = word.partition("=")
        if name not in options:
            out.append(word)
            continue
        new = options[name]
        if new.endswith("="):
            out.append(new + (value if sign else next(rest, "")))
            notes.append(f"{name} VALUE is written {new}VALUE now")
        elif new:
            out.append(f"{new}{sign}{value}")
            notes.append(f"{name} is called {new} now")
        else:
            out += [value] if sign else []
            notes.append(f"{name} is an argument now: leave its name out")
    return out
