"""One name for one thing on the command line: every option with its meaning, and what older versions called it.

Old names work for this version: the command line is rewritten before it is read, and a note on standard error says the
new one. `tests/api/test_command_names.py` holds every command against these tables.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

OPTIONS: Mapping[str, str] = {
    # what is run
    "--crane": "crane of a command that is about something else",
    "--controller": "one controller",
    "--controllers": "several controllers, with commas between them",
    "--drives": "winch types in place of controllers",
    "--load": "payload on the hook",
    "--loads": "payloads on the hook",
    "--s-w": "wire paid out",
    "--layer": "layer of wire, counted from the bare drum",
    "--motion": "motion of the crane tip",
    "--alpha-m": "displacement of the motors over their largest",
    "--speed": "one speed",
    "--speeds": "speeds of the tip",
    "--period": "one period",
    "--periods": "periods of the tip",
    "--v-w": "wire speed",
    "--v-tip": "speed of the tip",
    "--dp": "pressure drop",
    "--displacement": "displacement of a motor",
    "--drum-torque": "torque at the drum",
    "--delay": "delay of the motion signals",
    "--depth": "depth of the payload's underside",
    "--rho": "density of the water",
    "--top-speed": "wire speed at full command",
    # how long, how fine, how often
    "--duration": "length of the run",
    "--start": "where in a log or series to begin",
    "--warm-up": "begin of the run that no figure counts",
    "--step": "step of the integration, or of a series",
    "--every": "time between stored values",
    "--max-gap": "longest gap in a log that is bridged",
    "--horizon": "how far a forecast is looked at",
    "--window": "length of a weather window",
    "--draws": "draws of what is uncertain",
    "--seed": "seed of random numbers",
    "--seeds": "several seeds",
    "--budget": "runs of a search",
    "--threads": "cores of this machine",
    "--scheduler": "address of a Dask scheduler",
    "--store": "folder that keeps results as they finish",
    "--quick": "the fast answer",
    "--exact": "without approximation",
    "--full": "the complete plant",
    # sea, vessel, weather
    "--vessel": "vessel: a library name or a file",
    "--at": "place of the crane tip, or of a point",
    "--wave": "waves as text, or a file of spectra",
    "--sea": "a sea of the lift file",
    "--heading": "direction in which waves travel, from the bow",
    "--spread": "exponent of short-crested waves",
    "--record": "record of a file",
    "--point": "point of a file",
    "--ship": "course of the ship",
    "--amplitudes": "how amplitudes are drawn",
    "--pedestal": "heel pin of the boom",
    "--slew": "direction of the boom",
    "--main": "main boom",
    "--knuckle": "knuckle boom",
    "--position": "crane tip from the motion sensor, or column of a position",
    "--heave": "how a ship log counts heave",
    "--log": "measured motion",
    "--direction": "whether directions say from or to",
    "--column": "column of a file",
    "--time": "column of time",
    "--date-order": "order of day, month and year",
    "--time-zone": "zone of times without one",
    "--hs": "significant wave height",
    "--t-pop": "planned operation period",
    "--t-c": "contingency",
    "--forecast-factors": "table of factors on forecast heights",
    "--limit": "limit of a quantity",
    "--plan": "lift plan",
    "--full-plan": "the plan with the twin in the loop",
    "--alternative": "alternative of a plan",
    "--cell": "governing cell of a plan",
    "--twin": "certificate of the winch",
    "--tier": "how far to go",
    "--check": "test, and print what was found",
    # analysis, identification, validation
    "--metric": "number that a map shows",
    "--objective": "what a search makes small",
    "--free": "settings that a search may change",
    "--pareto": "front of two objectives",
    "--factors": "factors that are uncertain",
    "--sobol": "variance-based indices",
    "--attribute": "factor that explains a figure",
    "--at-most": "factors together",
    "--mapping": "columns of a log",
    "--effort": "column of an effort",
    "--command": "column of a command",
    "--least-length": "shortest piece that counts",
    "--least-speed": "lowest speed that counts",
    "--like": "set whose names and layout are taken",
    "--model": "model of a loss",
    "--threshold": "improvement that a term must bring",
    "--keep-Y-2": "keep a term",
    "--loops": "loops of a fit",
    "--map": "map of the motor's loss",
    "--variant": "variant of a fit",
    "--proposals": "tests that are proposed",
    "--steps": "steps of a validation",
    "--criteria": "file of criteria",
    "--all": "everything, also what was not judged",
    "--campaign": "campaign file",
    # export and output
    "--fmi": "version of FMI",
    "--coupling": "where host and winch meet",
    "--contents": "what a model holds",
    "--platforms": "platforms that a library is made for",
    "--ssp": "system structure as well",
    "--reference": "reference run as well",
    "--signals": "columns that are written",
    "--case": "case of a set of runs",
    "--format": "format of a file",
    "--language": "language of a text",
    "--animation": "an animation as well",
    "--figures": "every figure as a separate file",
    "--out": "folder for files",
    "--json": "JSON in SI units",
    "--version": "version of the program",
    "--help": "help",
}
"""Every option of every command, with the one thing that it means."""


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
    ("uncertainty",): {"--modes": "--controllers"},
    ("stability",): {"--mode": "--controller"},
    ("response",): {"--mode": "--controller"},
    ("calc",): {"--mode": "--controller"},
    ("friction", "draws"): {"--mode": "--controller", "--n": "--draws"},
    ("external",): {"--platform": "--platforms"},
    ("plan",): {"--alpha": "--forecast-factors"},
    ("weather", "alpha"): {"--table": "--forecast-factors"},
    ("weather", "forecast"): {"--table": "--forecast-factors"},
    ("weather", "lift"): {"--table": "--forecast-factors"},
}
"""Options by the command of today."""


def modern(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """A command line in the names of today, and a note for each old one in it."""
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
    return words, list(dict.fromkeys(notes))


def _renamed(words: Sequence[str], options: Mapping[str, str], notes: list[str]) -> list[str]:
    out: list[str] = []
    for place, word in enumerate(words):
        if word == "--":
            return [*out, *words[place:]]
        name, sign, value = word.partition("=")
        if name not in options:
            out.append(word)
            continue
        new = options[name]
        notes.append(f"{name} is called {new} now" if new else f"{name} is an argument now: leave its name out")
        if new:
            out.append(f"{new}{sign}{value}")
        elif sign:
            out.append(value)
    return out
