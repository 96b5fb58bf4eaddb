"""From a seed a folder of files as a user would write them, and the commands that are run on them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stillhook import Crane
from stillhook.library.write import crane_toml, toml_value
from trials.strangers.machines import Random, crane, deepest, load_chart, payload
from trials.strangers.seas import vessel, weather

DEEPEST, SHALLOWEST = 2000.0, 80.0
"""Depths of water [m]."""
SEVERAL = 0.3
"""Part of the plans with two controllers, and of those with weather that have two periods."""
LOWERED = 120.0
"""Depth to which `lower` runs at most [m]: it runs in time."""
PLAN, LIFT, CRANE = "plan.toml", "lift.toml", "crane.toml"
LOOSE = "plan-loose.toml"
"""The plan with limits that are `FACTOR` times as lenient."""
FACTOR = 2.0


@dataclass(frozen=True)
class Place:
    """Where `stability` is asked and the twin is run: load [kg], s_w [m], v_tip [m/s], tip up positive."""

    load: float
    s_w: float
    v_tip: float

    @property
    def words(self) -> tuple[str, ...]:
        """Options of the command."""
        return ("--load", f"{self.load!r} kg", "--s-w", f"{self.s_w!r} m", "--v-tip", f"{self.v_tip!r} m/s")


@dataclass(frozen=True)
class Draw:
    """What a seed gave: the folder with plan, loose plan, lift, crane and what they name; the crane's winch type;
    load, wire paid out and motion of `compare` as texts; places of `stability`."""

    seed: int
    folder: Path
    winch: str
    load: str
    s_w: str
    motion: str
    places: tuple[Place, ...]

    @property
    def compare(self) -> tuple[str, ...]:
        """The command that compares controllers."""
        case = ("--load", self.load, "--s-w", self.s_w, "--motion", self.motion, "--duration", "100 s")
        return ("compare", str(self.folder / CRANE), *case, "--json")


def draw(seed: int, folder: Path) -> Draw:
    """Write the files of a seed into a folder, which is made; the same seed gives the same files."""
    folder.mkdir(parents=True, exist_ok=True)
    parts = [np.random.default_rng([seed, i]) for i in range(8)]
    machine = crane(parts[0], f"stranger-{seed}")
    (folder / CRANE).write_text(crane_toml(machine), encoding="utf-8")
    (folder / "vessel.csv").write_text(vessel(parts[1], f"Barge of stranger {seed}"), encoding="utf-8")
    load, mass = payload(parts[2], f"load-{seed}", machine.SWL)
    (folder / "payload.toml").write_text(load, encoding="utf-8")
    rng = parts[3]
    h_tip = float(f"{rng.uniform(32.0, 42.0):.1f}")
    depth = _depth(rng, deepest(machine, mass, h_tip))
    where = _where(rng, seed, h_tip, depth)
    tables = _tables(parts[4], machine, mass, folder)
    phases, top = list(_phases(parts[5], depth)), [*where, *_alternatives(parts[6], machine)]
    for name, factor in ((PLAN, None), (LOOSE, FACTOR)):
        plan = _file(top, [*tables, *(phase.table(factor) for phase in phases)])
        (folder / name).write_text(plan, encoding="utf-8")
    (folder / LIFT).write_text(_lift(parts[7], machine, mass, where), encoding="utf-8")
    return Draw(seed, folder, str(machine.plant), f"{mass / 1e3:g} t", *_case(parts[7], machine, mass, depth))


def _depth(rng: Random, most: float) -> float:
    least, most = math.log(min(SHALLOWEST, most)), math.log(min(DEEPEST, most))
    return float(f"{math.exp(rng.uniform(least, most)):.0f}")


def _where(rng: Random, seed: int, h_tip: float, depth: float) -> list[list[str]]:
    """Lines of the top and of the tables that plan and lift share."""
    top = [f'name = "Stranger {seed}"', f'crane = "{CRANE}"', 'vessel = "vessel.csv"', 'payload = "payload.toml"']
    side = -1.0 if rng.random() < 0.7 else 1.0
    x, y = rng.uniform(-30.0, 20.0), side * rng.uniform(14.0, 26.0)
    tables = [["[tip]", f'at = "x={x:.1f} m, y={y:.1f} m, z={h_tip:g} m"'], ["[water]", f'depth = "{depth:g} m"']]
    if rng.random() < 0.3:
        tables[1].append(f'rho = "{rng.uniform(1000.0, 1030.0):.0f} kg/m^3"')
    tables.append(["[rigging]", f'height = "{rng.uniform(5.0, 9.0):.1f} m"'])
    if rng.random() < 0.4:
        tables[2].append(f'stiffness = "{rng.uniform(20.0, 80.0):.0f} MN/m"')
    tables.append(["[wire]", f"nodes = {int(rng.choice([10, 15, 20]))}"])
    if rng.random() < 0.5:
        tables.append(["[winch]", f'ramp = "{rng.uniform(0.05, 0.15):.3f} m/s^2"'])
    if rng.random() < 0.4:
        tables.append(["[sensors]", f'delay = "{rng.uniform(10.0, 120.0):.0f} ms"'])
    return [top, *tables]


def _alternatives(rng: Random, machine: Crane) -> list[list[str]]:
    """The line of a plan with its alternatives, as one more part of the top."""
    closed = "active" in machine.circuits and "ssc" in machine.plant.type.modes
    twins = ["ns", "hs", "ssc", "strong-ssc"] if closed else ["position"]
    n = 2 if closed and rng.random() < SEVERAL else 1
    chosen = [str(a) for a in rng.choice(twins, n, replace=False)]
    return [["", f"alternatives = {toml_value(['none', 'cap-80', *chosen])}"]]


def _tables(rng: Random, machine: Crane, mass: float, folder: Path) -> list[list[str]]:
    """Seas, weather, load chart, certificate and operation of a plan."""
    weathered, several = rng.random() < 0.6, rng.random() < SEVERAL
    n_periods = 2 if several or not weathered else 1
    periods = sorted(float(T) for T in rng.choice(np.arange(5.0, 15.0), n_periods, replace=False))
    away, gap = float(rng.choice([180.0, 180.0, 165.0, 90.0, 30.0])), float(rng.choice([15.0, 30.0]))
    headings = [away, away - gap] if weathered else [away]
    step, highest = float(rng.choice([0.5, 1.0])), float(rng.choice([3.0, 4.0, 5.0]))
    seas = ["[environment]", f'Hs = "{step:g} m to {highest:g} m by {step:g} m"']
    seas += [f"Tp = {toml_value([f'{T:g} s' for T in periods])}"]
    seas += [f"headings = {toml_value([f'{h:g} deg' for h in headings])}", f'heading_tolerance = "{gap:g} deg"']
    seas += ["spread = 4"] * bool(rng.random() < 0.4)
    seas += ['wave = "pm"'] * bool(rng.random() < 0.2)
    tables = [seas]
    if weathered:
        text, says = weather(rng)
        (folder / "weather.csv").write_text(text, encoding="utf-8")
        tables.append(["[weather]", 'file = "weather.csv"', f'ship = "{rng.integers(0, 360)} deg"'])
        tables[-1] += [f"{key} = {toml_value(value)}" for key, value in says.items()]
    if rng.random() < 0.35:
        chart, radius = load_chart(rng, machine.SWL, mass)
        (folder / "chart.csv").write_text(chart, encoding="utf-8")
        tables.append(["[load_chart]", 'file = "chart.csv"', f'radius = "{radius:.2f} m"'])
    if rng.random() < 0.35:
        loads = [f"{0.5 * mass / 1e3:.4g} t", f"{1.3 * mass / 1e3:.4g} t"]
        within = ["[synthetic_certificate]", f"load = {toml_value(loads)}", 's_w = ["5 m", "2500 m"]']
        within += [f's_tip_pp = ["0 m", "{rng.uniform(1.0, 4.0):.1f} m"]', 'period = ["4 s", "12 s"]']
        tables.append([*within, f"modes = {toml_value([m.value for m in machine.plant.type.usual_modes])}"])
    if rng.random() < 0.6:
        tables.append(["[operation]", f'T_POP = "{rng.uniform(4.0, 30.0):.0f} h"'])
        tables[-1] += [f'T_C = "{rng.uniform(2.0, 24.0):.0f} h"'] * bool(rng.random() < 0.5)
    return tables


class Phase(NamedTuple):
    """A phase of a plan: its lines, its kind, and limits of its own: rule -> number and unit."""

    lines: tuple[str, ...]
    kind: str
    limits: Mapping[str, tuple[float, str]]

    def table(self, factor: float | None = None) -> list[str]:
        """Its table [[phase]]. factor: on limits of its own and on `USUAL` ones, for a plan that is more lenient."""
        limits = {**(USUAL[self.kind] if factor else {}), **self.limits}
        if not limits:
            return list(self.lines)
        texts = [f'{key} = "{_looser(key, x, factor or 1.0):.4g}{unit}"' for key, (x, unit) in limits.items()]
        return [*self.lines, f"limits = {{ {', '.join(texts)} }}"]


SEQUENCES = (0.22, 0.22, 0.16, 0.15, 0.25)
"""How often each of the sequences of phases is drawn: through the surface; way down and deep; off the seabed; all of a
lowering; landing alone."""
AT_LEAST = ("slack-sling",)
"""Rules whose limit is a least value."""
_DAF: Mapping[str, tuple[float, str]] = {"rigging-daf-subsea": (2.0, "")}
_LANDING = {"control-error": (0.5, " m"), "load-motion": (0.5, " m"), "landing-speed": (0.5, " m/s")}
USUAL: Mapping[str, Mapping[str, tuple[float, str]]] = {
    "in-air": {"rigging-daf-air": (1.25, ""), "slack-sling": (0.1, "")},
    "splash-zone": {**_DAF, "slack-sling": (0.1, "")},
    "lowering": {**_DAF, "slack-sling": (0.1, "")},
    "deep": {**_DAF, "slack-sling": (0.1, "")},
    "seabed-lift-off": {**_DAF, "control-error": (0.5, " m")},
    "landing": {**_DAF, **_LANDING},
}
"""Limits of the library's rules that a plan may change, by kind of phase."""


def _looser(key: str, value: float, factor: float) -> float:
    return value / factor if key in AT_LEAST else value * factor


def _phases(rng: Random, depth: float) -> Iterator[Phase]:
    """Phases of a plan: one of five usual sequences, short."""
    kind = int(rng.choice(5, p=SEQUENCES))
    speed = f'speed = "{rng.uniform(10.0, 30.0):.0f} m/min"'
    hold = ['hold = "off"'] if rng.random() < 0.5 else [f'hold = "{rng.uniform(2.0, 8.0):.0f} min"']
    if kind == 0:
        yield _phase("splash zone", "splash-zone", 'start_depth = "-4 m"', speed, *hold)
        return
    if kind == 1:
        bottom = min(0.8 * depth, depth - 30.0)
        yield _phase("way down", "lowering", 'mode = "ahc"', 'start_depth = "25 m"', f'depth = "{bottom:.0f} m"', speed)
        yield _phase("deep", "deep", f'time = "{rng.uniform(5.0, 20.0):.0f} min"')
        return
    own = _limits(rng)
    if kind == 2:
        of_start = {key: limit for key, limit in own.items() if key == "control-error"}
        yield _phase(
            "off the seabed", "seabed-lift-off", f'start_depth = "{depth:g} m"', 'mode = "ahc"', limits=of_start
        )
        return
    landing = list(hold) if hold == ['hold = "off"'] else [*hold, f'stand_off = "{rng.uniform(2.0, 5.0):.1f} m"']
    if kind == 3:
        yield _phase("over the side", "in-air", 'start_depth = "-5 m"', 'time = "5 min"')
        yield _phase("splash zone", "splash-zone", 'hold = "off"', speed)
        yield _phase("way down", "lowering", 'mode = "manual"', speed)
        yield _phase("landing", "landing", *landing, limits=own)
        return
    yield _phase("landing", "landing", f'start_depth = "{depth - 20.0:g} m"', *landing, limits=own)


def _phase(name: str, kind: str, *lines: str, limits: Mapping[str, tuple[float, str]] | None = None) -> Phase:
    return Phase(("[[phase]]", f'name = "{name}"', f'kind = "{kind}"', *lines), kind, limits or {})


def _limits(rng: Random) -> dict[str, tuple[float, str]]:
    """Tolerances of one's own, or none."""
    if rng.random() < 0.4:
        return {}
    error, motion = round(rng.uniform(0.15, 0.5), 2), round(rng.uniform(0.2, 0.6), 2)
    return {"control-error": (error, " m"), "load-motion": (motion, " m")}


def _file(top: Sequence[Sequence[str]], tables: Sequence[Sequence[str]]) -> str:
    """A TOML file: the lines of its top, and the start of its phases, before those of its tables."""
    first = [line for part in top if not part[0].startswith("[") for line in part if line]
    first += [line for part in tables for line in part if line.startswith("start_depth")]
    rest = [
        [line for line in part if not line.startswith("start_depth")]
        for part in (*top, *tables)
        if part[0].startswith("[")
    ]
    return "\n\n".join("\n".join(part) for part in (first, *rest)) + "\n"


def _lift(rng: Random, machine: Crane, mass: float, where: Sequence[Sequence[str]]) -> str:
    """A lift file for `lower`: through the surface, or on its way down, and where the water is shallow to its bed."""
    depth = float(next(line for part in where for line in part if line.startswith("depth")).split('"')[1].split()[0])
    closed = "active" in machine.circuits and "ssc" in machine.plant.type.modes
    law = str(rng.choice(["ns", "hs", "ssc"])) if closed else "position"
    Hs, Tp = rng.uniform(0.5, 3.0), rng.uniform(5.0, 13.0)
    top = [*where[0], f'controller = "{law}"', 'start_depth = "-3 m"']
    sea = ["[sea]", f'wave = "jonswap Hs={Hs:.2f} m Tp={Tp:.1f} s gamma={rng.uniform(1.0, 4.0):.1f}"']
    sea += [f'heading = "{rng.integers(0, 360)} deg"', f"seed = {int(rng.integers(1000))}"]
    sea += ["spread = 4"] * bool(rng.random() < 0.4)
    stages = [_stage("hang", str(rng.choice(["manual", "splash"])), 'time = "20 s"')]
    through = f'speed = "{rng.uniform(10.0, 20.0):.0f} m/min"'
    stages.append(_stage("surface", str(rng.choice(["manual", "splash"])), through, 'depth = "20 m"'))
    end = min(depth - 12.0, LOWERED)
    stages.append(_stage("down", "ahc", 'speed = "24 m/min"', f'depth = "{end:.0f} m"'))
    stages.append(_stage("wait", "ahc", 'time = "60 s"'))
    if depth <= LOWERED + 12.0:
        hold = f'tension = "{(0.3 * mass + machine.hook_mass) * 9.81 / 1e3:.0f} kN"'
        stages.append(_stage("landing", "landing", 'speed = "6 m/min"', hold, 'time = "30 s"'))
    return _file([top], [*where[1:], sea, *stages])


def _stage(name: str, mode: str, *lines: str) -> list[str]:
    return ["[[phase]]", f'name = "{name}"', f'mode = "{mode}"', *lines]


def _case(rng: Random, machine: Crane, mass: float, depth: float) -> tuple[str, str, tuple[Place, ...]]:
    """Wire paid out and motion of `compare`, places of `stability`."""
    s_w = rng.uniform(60.0, min(depth, 800.0) + 30.0)
    waves = [(rng.uniform(0.3, 1.5), rng.uniform(6.0, 14.0)), (rng.uniform(0.1, 0.5), rng.uniform(5.0, 9.0))]
    motion = " + ".join(f"sine {a:.2f} m {T:.1f} s" for a, T in waves[: int(rng.integers(1, 3))])
    places = []
    for least, most in ((1.0, 5.0), (8.0, 40.0)):
        v = float(f"{rng.choice([-1.0, 1.0]) * math.exp(rng.uniform(math.log(least), math.log(most))) / 60.0:.4f}")
        wire = float(f"{rng.uniform(60.0, min(depth, 600.0) + 30.0):.1f}")
        places.append(Place(float(f"{rng.choice([0.0, 1.0, 1.0]) * mass:.0f}"), wire, v))
    return f"{s_w:.1f} m", motion, tuple(places)


def as_json(drawn: Draw) -> Mapping[str, Any]:
    """What a draw is, for its line of results."""
    return {
        "seed": drawn.seed,
        "winch": drawn.winch,
        "compare": list(drawn.compare),
        "places": [list(place.words) for place in drawn.places],
    }


def files_of(folder: Path) -> str:
    """All files of a draw as one text, by name."""
    return json.dumps({path.name: path.read_text(encoding="utf-8") for path in sorted(folder.iterdir())})
