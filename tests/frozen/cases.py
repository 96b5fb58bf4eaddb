"""Cases of the regression suite: a name, and a function that computes its result in an empty folder. Every capability is among them."""

import atexit
import contextlib
import functools
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from datetime import date
from pathlib import Path
from typing import Any

import platformdirs
from tests.frozen.answers import ANSWERS
from tests.frozen.further import FURTHER
from tests.frozen.inputs import (
    CASES_TOML,
    CRANES_TOML,
    LID,
    PLAN,
    SPECTRA,
    STAIRCASE_MAPPING,
    TWIN_PLAN,
    staircase,
    weather_csv,
)
from tests.frozen.printed import cli, texts
from tests.frozen.record import condensed, dataset, normalised
from tests.frozen.written import WRITTEN
from trials.campaigns import write_campaign
from trials.campaigns.friction import campaign_plan
from trials.campaigns.friction import write_campaign as write_friction_tests
from trials.campaigns.motor_map import synthetic_map, write_map

import stillhook
from stillhook.base.kept.checked import BESIDE
from stillhook.kernels.c99.library import SUFFIX

Case = Callable[[], Any]
CASES: dict[str, Case] = {}
CACHE = "STILLHOOK_CACHE"
NOT_KERNELS = ("capacities", "residuals", "zig")
"""Folders of the cache with results, and with what Zig keeps for itself."""
COMPILED = (SUFFIX, BESIDE, ".txt", ".nbc")
"""Files of compiled kernels: libraries, their checksums, what names them, and Numba's."""


def case(function: Case) -> Case:
    CASES[function.__name__] = function
    return function


def result(name: str) -> Any:
    """The result of a case as it is stored, computed in an empty folder that is removed afterwards."""
    with tempfile.TemporaryDirectory(prefix="frozen-") as folder, contextlib.chdir(folder):
        value = CASES[name]()
        replaced = {str(Path(folder).resolve()): "<folder>", folder: "<folder>", stillhook.__version__: "<version>"}
        replaced[date.today().isoformat()] = "<date>"
        return condensed(normalised(value, replaced))


def write(**texts: str) -> None:
    """Files NAME.toml in the present folder."""
    for name, text in texts.items():
        Path(f"{name}.toml").write_text(text, encoding="utf-8")


def case_file(crane: str, load: str, settings: str = "", **fields: str) -> str:
    """Text of a case file: the usual lift, with other fields; settings: rows of its table [settings]."""
    scenario = {"load": load, "s_w": "100 m", "tip": "sine 1 m 10 s"} | fields
    rows = "".join(f'{name} = "{value}"\n' for name, value in scenario.items())
    return f'crane = "{crane}"\n[scenario]\n{rows}{settings and f"[settings]{chr(10)}{settings}"}'


# Folders


@contextlib.contextmanager
def fresh_cache() -> Iterator[None]:
    """A cache with the compiled kernels but without results of earlier runs, so that these are computed by the present code."""
    write(warm=case_file("nov-250t", "100 t", duration="2 s", warm_up="1 s"))
    cli("compare", "warm.toml", "--controllers", "ssc")  # kernels exist from here on
    before = os.environ.get(CACHE)
    real = Path(before or platformdirs.user_cache_dir("stillhook", appauthor=False))
    with tempfile.TemporaryDirectory(prefix="frozen-cache-") as folder:
        for path in sorted(real.iterdir()):
            if not path.is_dir() or path.name in NOT_KERNELS:
                continue
            for file in (found for found in path.rglob("*") if found.suffix in COMPILED):
                target = Path(folder) / file.relative_to(real)
                target.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
                with contextlib.suppress(FileNotFoundError):  # one that another process is writing
                    shutil.copy2(file, target)
        os.environ[CACHE] = folder
        try:
            yield
        finally:
            os.environ.pop(CACHE)
            if before is not None:
                os.environ[CACHE] = before


def computed_afresh(function: Case) -> Case:
    @functools.wraps(function)
    def wrapped() -> Any:
        with fresh_cache():
            return function()

    return wrapped


@functools.cache
def sea_trials() -> Path:
    """Folder with the synthetic sea trials of a crane, written once in a process."""
    folder = Path(tempfile.mkdtemp(prefix="frozen-trials-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return write_campaign(folder / "trials").folder


def trials(*names: str, most_lines: int | None = None) -> str:
    """Campaign file in the present folder with these tests of the sea trials only, their logs cut after so many lines."""
    head, *tests = (sea_trials() / "campaign.toml").read_text(encoding="utf-8").split("[[test]]")
    kept = [test for test in tests if any(f'name = "{name}"' in test for name in names)]
    Path("logs").mkdir()
    for name in names:
        lines = (sea_trials() / "logs" / f"{name}.csv").read_text(encoding="utf-8").splitlines(keepends=True)
        Path("logs", f"{name}.csv").write_text("".join(lines[:most_lines]), encoding="utf-8")
    Path("campaign.toml").write_text("[[test]]".join([head, *kept]), encoding="utf-8")
    return "campaign.toml"


# Library, single numbers


@case
def cranes() -> Any:
    return [cli("list", "cranes"), *(sheet(row["name"]) for row in cli("list", "cranes")["json"])]


def sheet(crane: str) -> dict[str, Any]:
    """A crane's sheet: values by field, the rest of each field as one table."""
    found = cli("crane", crane)
    fields = found["json"].pop("fields")
    values = {name: field.pop("value") for name, field in fields.items()}
    return found | {"values": values, "fields": [{"field": name, **field} for name, field in fields.items()]}


@case
def crane_of_a_user() -> Any:
    write(**CRANES_TOML)
    return [sheet(f"{name}.toml") for name in CRANES_TOML]


@case
def calc() -> Any:
    rows = [
        ("motor-loss", "A6VM215", "D_m=215 cm^3/rev", "omega_m=1000 rev/min", "dp_m=200 bar"),
        ("friction", "crane-1", "T_d=1.5 MN m", "omega_m=100 rev/min"),
    ]
    for crane in ("nov-250t", "nov-100t-pure-active"):
        rows += [("drum", crane), ("inertia", crane), ("steady", crane, "v_w=40 m/min")]
        rows += [(command, crane, "alpha_m=0.7") for command in ("speed", "eigenfrequency", "gain-limit")]
    return {" ".join(row): cli("calc", *row) for row in rows}


@case
def friction() -> Any:
    compared = cli("friction", "compare", "crane-1", "crane-2", "--load", "100 t", "--out", "out")
    return [cli("list", "frictions"), compared]


@case
def payload() -> Any:
    names = [row["payload"] for row in cli("list", "payloads")["json"]]
    return [cli("list", "payloads"), *(cli("payload", name) for name in names)]


@case
def vessel() -> Any:
    names = ("construction-vessel-130m", "supply-vessel-82m")
    shown = [cli("vessel", name, "--at", "x=-20 m, y=-18 m") for name in names]
    return [cli("list", "vessels"), *shown, *(cli("vessel", "--check", name) for name in names)]


# Waves and tip


@case
def sea() -> Any:
    texts = (
        "jonswap Hs=2 m Tp=8 s gamma=3.3",
        "pm Hs=3 m Tp=10 s",
        "torsethaugen Hs=2 m Tp=8 s",
        "jonswap Hs=1 m Tp=6 s + jonswap Hs=1.5 m Tp=14 s gamma=5",
    )
    return {text: cli("sea", text) for text in texts}


@case
def sea_measured() -> Any:
    Path("spectra.txt").write_text(SPECTRA, encoding="utf-8")
    return [cli("sea", "spectra.txt"), cli("sea", "spectra.txt", "--record", "1")]


@case
def tip() -> Any:
    base = ("tip", "construction-vessel-130m", "--duration", "10 min")
    boom = ("--boom", "x=-10 m, y=-6 m, z=15 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg")
    wave = ("--wave", "jonswap Hs=1 m Tp=8 s gamma=3.3")
    results = [
        cli(*base, *wave, "--at", "x=-20 m, y=-18 m", "--heading", "180 deg", "--seeds", "5"),
        cli(*base, *wave, *boom, "--heading", "150 deg", "--spread", "4"),
        cli(
            *base,
            *wave,
            "--at",
            "x=-20 m, y=-18 m, z=30 m",
            "--heading",
            "165 deg",
            "--exact",
            "--amplitudes",
            "rayleigh",
            "--out",
            "out",
        ),
        cli(*base, *wave, "--at", "x=-20 m, y=-18 m", "--heading", "all"),
    ]
    return [*results, json.loads(Path("out/tip.json").read_text(encoding="utf-8"))]


# Runs


@case
def run_cases() -> Any:
    write(**CRANES_TOML, **CASES_TOML)
    return {name: cli("run", f"{name}.toml") for name in CASES_TOML}


def series_of(crane: str, modes: tuple[str, ...], **more: Any) -> Any:
    plant = stillhook.load_crane(crane)
    given = {
        "load": "60 t",
        "s_w": "100 m",
        "tip": "sine 1.2 m 10 s + sine 0.2 m 6 s",
        "duration": "30 s",
        "warm_up": "10 s",
    } | more
    cases = {mode: stillhook.Scenario(mode=mode, **given) for mode in modes}
    return {mode: dataset(stillhook.simulate(plant, one, every="0.1 s", threads=1)) for mode, one in cases.items()}


@case
def simulate_active_passive() -> Any:
    return series_of("nov-250t", ("hs", "ssc"))


@case
def simulate_pure_active() -> Any:
    return series_of("nov-100t-pure-active", ("hs", "ssc"), load="45 t")


@case
def simulate_manual() -> Any:
    operator = {"profile": [["2 s", "0 m/min"], ["4 s", "30 m/min"], ["12 s", "30 m/min"], ["14 s", "0 m/min"]]}
    return {
        crane: series_of(crane, ("manual",), tip="sine 0.3 m 8 s", operator=operator)
        for crane in ("nov-250t", "nov-100t-pure-active")
    }


@case
def simulate_strong_sea() -> Any:
    """Power of the hydraulic units, saturation and relief are reached."""
    return series_of("nov-250t", ("ssc",), load="200 t", tip="sine 4 m 10 s")


@case
def simulate_many_lanes() -> Any:
    out = {}
    for crane, modes in (
        ("nov-150t", ("ns", "hs", "ssc", "ssc-cubic", "level-1", "manual")),
        ("nov-100t-pure-active", ("ns", "ssc")),
    ):
        cases = [
            stillhook.Scenario(
                load=f"{load} t", s_w="120 m", tip=f"sine {a} m 11 s", mode=mode, duration="25 s", warm_up="10 s"
            )
            for mode in modes
            for load, a in ((10, 0.5), (50, 1.0), (80, 2.0))
        ]
        out[crane] = dataset(stillhook.simulate(stillhook.load_crane(crane), cases, on_failure="mark", threads=1))
    return out


@case
def compare() -> Any:
    modes = "ns,hs,ssc,ssc-cubic,level-1,level-2,manual"
    both = (("nov-250t", "100 t"), ("nov-100t-pure-active", "60 t"))
    times = {"duration": "30 s", "warm_up": "10 s"}
    write(**{crane: case_file(crane, load, **times) + 'sensors = { delay = "50 ms" }\n' for crane, load in both})
    return {crane: cli("compare", f"{crane}.toml", "--controllers", modes) for crane, _ in both}


# Lowering


@case
def lower_library() -> Any:
    lifts = {"anchor-to-3000m": "90 s", "template-through-the-surface": "90 s"}
    return {name: cli("lower", name, "--duration", duration, "--seed", "3") for name, duration in lifts.items()}


@case
def lower_to_the_seabed() -> Any:
    """Splash zone, lowering in heave compensation, landing."""
    write(lid=LID)
    file = stillhook.load_lift("lid.toml")
    return [cli("lower", "lid.toml"), dataset(stillhook.simulate(file.crane, file.lift, threads=1))]


@case
def lower_many_lanes() -> Any:
    out = {}
    for crane in ("nov-250t", "nov-100t-pure-active"):
        lifts = []
        for i in range(4):
            write(
                **{
                    f"lid{i}": LID.replace("nov-250t", crane)
                    .replace("0.3 m 9 s", f"{0.2 + 0.1 * i} m 8 s")
                    .replace("180 s", "60 s")
                }
            )
            lifts.append(stillhook.load_lift(f"lid{i}.toml"))
        out[crane] = dataset(
            stillhook.simulate(lifts[0].crane, [file.lift for file in lifts], on_failure="mark", threads=1)
        )
    return out


# Analysis


@case
def envelope() -> Any:
    modes = ("--controllers", "ns,hs,ssc,ssc-cubic")
    return [
        cli("envelope", "nov-150t", "--loads", "90 t", "--loads", "120 t", *modes),
        cli("envelope", "nov-100t-pure-active", "--loads", "50 t", "--layer", "5", *modes),
    ]


@case
def stability() -> Any:
    return [
        cli("stability", "nov-250t", "--alpha-m", "1", "--alpha-m", "0.6", "--delay", "50 ms"),
        cli("stability", "nov-250t", "--full", "--v-tip", "10 m/min"),
        cli("stability", "nov-100t-pure-active"),
    ]


@case
def maps() -> Any:
    grid = ("--loads", "50 t, 150 t, 250 t", "--speeds", "20 m/min, 60 m/min, 100 m/min")
    return [
        cli("map", "nov-250t", "--controllers", "ns,ssc,strong-ssc", *grid),
        cli("map", "nov-250t", "--controllers", "hs,ssc", "--metric", "settling", *grid),
        cli(
            "map",
            "nov-100t-pure-active",
            "--controllers",
            "ns,hs",
            "--loads",
            "20 t, 60 t",
            "--speeds",
            "20 m/min, 50 m/min",
        ),
    ]


@case
def tune() -> Any:
    grid = ("--loads", "50 t", "--speeds", "40 m/min", "--periods", "12 s")
    write(short='crane = "nov-250t"\n[settings]\nbudget = 20\n')
    return cli("tune", "short.toml", "--controllers", "ns", "--free", "K_p", "--objective", "error", *grid)


@case
def uncertainty() -> Any:
    write(short=case_file("nov-250t", "100 t", tip="sine 2.8 m 12 s", duration="25 s", warm_up="10 s"))
    draws = ("--draws", "8", "--controllers", "ns,ssc,strong-ssc", "--limit", "e_c_pp <= 12 cm")
    return cli("uncertainty", "short.toml", *draws)


# Identification


@case
def identify_motor() -> Any:
    write_map(synthetic_map("A6VM170", seed=2), "map.csv")
    return [cli("identify", "motor", "map.csv", "--out", "out"), texts("out", ".html", ".toml")]


@case
def identify_friction() -> Any:
    write_friction_tests(campaign_plan("crane-2"), "tests", duration="3 min")
    with Path("tests/campaign.toml").open("a", encoding="utf-8") as campaign:
        campaign.write("[fit]\nloops = 1\nproposals = 1\n")
    return [cli("identify", "friction", "tests/campaign.toml", "--out", "out"), texts("out", ".html", ".toml")]


@case
def identify_curve() -> Any:
    Path("log.csv").write_text(staircase(), encoding="utf-8")
    write(mapping=STAIRCASE_MAPPING)
    return cli("identify", "curve", "log.csv", "--mapping", "mapping.toml")


# Validation


@case
def validate() -> Any:
    found = cli("validate", trials("1", "limits", "dynamics"), "--steps", "0,1,2,3,5,6", "--out", "out")
    return [found, texts("out", ".html")]


@case
def validate_dynamics() -> Any:
    return cli("validate", trials("dynamics", most_lines=5000), "--steps", "4")


@case
def certificate() -> Any:
    out = [cli("validate", trials("limits"), "--out", "out")["exit_code"]]
    (file,) = [path for path in Path("out").glob("*.json") if path.name in ("certificate.json", "not-passed.json")]
    return [*out, file.name, cli("certificate", str(file)), cli("certificate", "--check", str(file), "--quick")]


# Planning and weather


@case
@computed_afresh
def response() -> Any:
    return cli(
        "response", "anchor-to-3000m", "--depth", "2000 m", "--wave", "jonswap Hs=2 m Tp=8 s", "--heading", "150 deg"
    )


@case
def plan_check() -> Any:
    return [cli("plan", name, "--check") for name in ("template-to-1500m", "manifold-recovery")]


@case
@computed_afresh
def plan_quick() -> Any:
    headings = (
        PLAN.split('[[phase]]\nname = "landing"')[0]
        .replace(', "strong-ssc"', "")
        .replace('["180 deg"]', '["165 deg", "180 deg", "195 deg"]')
    )
    write(plan=headings.replace("[operation]", '[weather]\nfile = "SYNTHETIC-norwegian-sea"\n\n[operation]'))
    return [cli("plan", "plan.toml", "--tier", "frequency", "--workers", "1", "--out", "out"), texts("out", ".html")]


@case
@computed_afresh
def plan_with_the_twin() -> Any:
    write(plan=TWIN_PLAN)
    return cli("plan", "plan.toml", "--workers", "1", "--store", "store")


@case
def weather() -> Any:
    Path("site.csv").write_text(weather_csv(), encoding="utf-8")
    limits = ("--limit", "Hs <= 1.5 m", "--limit", "wind <= 10 m/s")
    return [
        cli("weather", "show", "SYNTHETIC-norwegian-sea"),
        cli("weather", "persistence", "SYNTHETIC-norwegian-sea", *limits, "--window", "24 h"),
        cli("weather", "persistence", "site.csv", "--limit", "Hs <= 1 m", "--window", "18 h"),
        cli("weather", "alpha", "--hs", "2 m", "--t-pop", "24 h"),
        cli("weather", "alpha", "--hs", "0.8 m", "--t-pop", "24 h"),
        cli(
            "weather", "forecast", "SYNTHETIC-norwegian-sea", "--limit", "Hs <= 2 m", "--t-pop", "24 h", "--t-c", "12 h"
        ),
    ]


@case
def weather_lift() -> Any:
    write(plan=PLAN)
    Path("spectra.txt").write_text(SPECTRA, encoding="utf-8")
    return cli("weather", "lift", "plan.toml", "spectra.txt", "--heading", "180 deg", "--alternative", "cap-80")


# What people read

for _function in (*ANSWERS, *FURTHER, *WRITTEN):
    case(_function)
