"""Paper E, introduction: one of three hydraulic power units shuts down in AHC, is isolated, and the gains are
reconfigured."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import causes
import xarray
from batch import Numbers, side_by_side
from blocks import Blocks, save

from stillhook import Crane, Scenario, load_crane, simulate
from stillhook.engine.pack.winch import wire_speed_max
from stillhook.engine.scenario.checks import layer_diameter_at
from stillhook.report.plots.run import four_panels
from stillhook.thesis.quay import sine

SLOW_PAGE = True
CRANE = load_crane("nov-250t")
MODES = ("ns", "hs", "ssc")
UNITS = (1, 2, 3)
PERIOD = 12.0  # s
SPEEDS = (30.0, 50.0, 65.0, 75.0, 85.0)  # m/min
LIMIT_SHARES = tuple(
    0.90 + 0.01 * i for i in range(11)
)  # of the speed without leakage, among which the limit is looked for
MOMENTS = 5  # over one period of the sine at which the unit stops
FIRST = 48.0  # s: the earliest of them
NEVER = "1000 s"  # detection after the end of the run: no reconfiguration
LOAD, WIRE = "100 t", 100.0  # m
CM = 100.0


def share_left(unit: int, passive: bool = False) -> float:
    """Part of the pumps that is left without this unit."""
    assert CRANE.passive is not None
    D = CRANE.passive.pump.D if passive else CRANE.active.pump.D
    return 1.0 - D[unit - 1] / sum(D)


def case(v: float, mode: str, loss: Mapping[str, Any] | None, period: float = PERIOD, **more: Any) -> Scenario:
    asked: dict[str, Any] = {"load": LOAD, "s_w": f"{WIRE} m", "warm_up": "40 s", "duration": "82 s", **more}
    losing = {} if loss is None else {"power_loss": dict(loss)}
    return Scenario(tip=sine(period, v / 60.0), mode=mode, **asked, **losing)


def losses(unit: int, period: float = PERIOD, **more: str) -> list[dict[str, Any] | None]:
    """No loss, and losses at moments spread over a period."""
    times = [FIRST + period * i / MOMENTS for i in range(MOMENTS)]
    return [None, *({"time": f"{t!r} s", "unit": unit, **more} for t in times)]


class Outcome(NamedTuple):
    """Largest error [cm] and highest pressure [bar] without a loss, and the worst of the losses over the moment of the
    loss."""

    quiet: float
    error: float
    p_quiet: float
    p: float


def outcome(runs: Sequence[Numbers]) -> Outcome:
    e, p = [CM * one["e_c_max"] for one in runs], [one["p_max"] / 1e5 for one in runs]
    return Outcome(e[0], max(e[1:]), p[0], max(p[1:]))


def outcomes(asked: Iterable[tuple[Crane, Sequence[Scenario]]]) -> list[Outcome]:
    """One outcome for every crane with its cases, the first of which has no loss."""
    groups = list(asked)
    runs = side_by_side([(crane, one) for crane, cases in groups for one in cases])
    n = 1 + MOMENTS
    return [outcome(runs[i * n : (i + 1) * n]) for i in range(len(groups))]


def transients(detection: str) -> dict[tuple[int, float, str], Outcome]:
    keys = [(unit, v, mode) for unit in UNITS[:2] for v in SPEEDS for mode in MODES]
    found = outcomes((CRANE, [case(v, m, loss) for loss in losses(u, detection=detection)]) for u, v, m in keys)
    return dict(zip(keys, found, strict=True))


def limits() -> dict[tuple[int, str], float]:
    """Highest speed of the tip at which the pumps do not saturate, unit 0: with all of them [m/min]. Units 2 and 3 are
    alike."""
    stop = [None, *({"time": "5 s", "unit": unit} for unit in UNITS)]
    keys = [(unit, mode, part) for unit in (0, 1, 2) for mode in MODES for part in LIMIT_SHARES]
    asked = [case(part * ideal_limit(mode, unit), mode, stop[unit], duration="53 s") for unit, mode, part in keys]
    runs = side_by_side((CRANE, one) for one in asked)
    free = [key for key, one in zip(keys, runs, strict=True) if one["saturation_time"] == 0.0]
    found = {
        (u, m): max(part for unit, mode, part in free if (unit, mode) == (u, m)) * ideal_limit(m, u)
        for u in (0, 1, 2)
        for m in MODES
    }
    return found | {(3, m): found[2, m] for m in MODES}


def ideal_limit(mode: str, unit: int) -> float:
    """The same without leakage: share left of the speed at the mode's smallest displacement on this layer [m/min]."""
    c = CRANE.control
    alpha = {"ns": c.alpha_ns, "hs": c.alpha_hs, "ssc": CRANE.active.motor.alpha_min}[mode]
    left = 1.0 if unit == 0 else share_left(unit)
    return 60.0 * left * wire_speed_max(CRANE, alpha, layer_diameter_at(CRANE, WIRE))


V_VARIED = 65.0  # m/min: more than NS has left without unit 2, less than HS and SSC have
ROWS = causes.variants(globals())


def sensitivity() -> list[dict[str, Any]]:
    asked = []
    for row in ROWS:
        period = row.own.get("period", PERIOD)
        some = losses(2, period, **row.own.get("loss", {}))
        asked += [(row.on(CRANE), [case(V_VARIED, m, loss, period, **row.more) for loss in some]) for m in MODES]
    found = outcomes(asked)
    every = [found[3 * i : 3 * i + 3] for i in range(len(ROWS))]
    return [{"row": row, "all": all_, "ns": all_[0], "ssc": all_[2]} for row, all_ in zip(ROWS, every, strict=True)]


GOES_ON = 10.0  # cm: by how much the largest error may grow where compensation is said to continue


def setting(row: causes.Variant) -> causes.Alternative:
    """A row as a setting that may be otherwise; what the loss is like, for the runs in which the PLC learns of it."""
    if "loss" not in row.own:
        return row.alternative()

    def change(runs: causes.Runs) -> causes.Runs:
        out = dict(runs)
        for name, (crane, one) in runs.items():
            if name.startswith("loss") and one.power_loss is not None:
                stop = {"time": f"{one.power_loss.time!r} s", "unit": one.power_loss.unit}
                loss = case(V_VARIED, "ns", stop | row.own["loss"]).power_loss
                out[name] = crane, one.model_copy(update={"power_loss": loss})
        return out

    return causes.Alternative(row.label, change, row.group)


def worst(r: Mapping[str, Numbers], what: str, mode: str) -> float:
    """Largest error over the moments of the loss [cm]."""
    return max(CM * r[f"{what} {mode} {i}"]["e_c_max"] for i in range(MOMENTS))


def attribution() -> causes.Attribution:
    """What the figures of unit 2 at 65 m/min depend on, one change at a time."""
    runs: dict[str, causes.Pair] = {}
    for m in MODES[1:]:
        quiet, *some = losses(2)
        runs[f"quiet {m}"] = CRANE, case(V_VARIED, m, quiet)
        runs |= {f"loss {m} {i}": (CRANE, case(V_VARIED, m, loss)) for i, loss in enumerate(some)}
        runs |= {
            f"never {m} {i}": (CRANE, case(V_VARIED, m, loss)) for i, loss in enumerate(losses(2, detection=NEVER)[1:])
        }

    return causes.attribute(runs, causes.figures(globals()), [setting(row) for row in ROWS[1:]], pairs=False)


def passive() -> list[dict[str, Any]]:
    """How hard the passive pumps work while a unit is missing."""
    rows = []
    for unit in (0, 1, 3):
        loss = None if unit == 0 else {"time": "5 s", "unit": unit}
        one = simulate(CRANE, case(V_VARIED, "ssc", loss, duration="148 s", warm_up="100 s"), every="0.1 s")
        last = one.sel(time=slice(100.0, None))  # four periods
        rows.append({**locals()})
    return rows


def transient_row(
    unit: int, v: float, known: Mapping[Any, Outcome], never: Mapping[Any, Outcome]
) -> tuple[object, ...]:
    cells = []
    for mode in MODES:
        a, b = known[unit, v, mode], never[unit, v, mode]
        cells += [f"{a.quiet:.1f}", f"{a.error:.1f}", f"{b.error:.0f}"]
    ssc = known[unit, v, "ssc"]
    return (unit, f"{v:g}", *cells, f"{ssc.p_quiet:.0f}, {ssc.p:.0f}")


def claims(
    known: Mapping[Any, Outcome], never: Mapping[Any, Outcome], limit: Mapping[tuple[int, str], float]
) -> dict[str, Any]:
    """Numbers of the claims."""
    inside = {key: one for key, one in known.items() if key[1] <= limit[key[0], key[2]]}
    growth = max(one.error - one.quiet for one in inside.values())
    beside = [never[key].error for key in inside]
    least = {m: min(limit[u, m] for u in UNITS) for m in MODES}
    left = [f"{m.upper()} {least[m]:.0f} of {limit[0, m]:.0f} m/min" for m in MODES]
    return locals()


def compute() -> tuple[Blocks, dict[str, xarray.Dataset]]:
    """Blocks of the page, its claims, and the runs of the picture."""
    known, never, limit = transients("0.1 s"), transients(NEVER), limits()
    told = claims(known, never, limit)
    lost = zip((0, *UNITS), (0.0, *CRANE.active.pump.D), strict=True)
    blocks = {
        "causes": causes.block(attribution()),
        "claims": told,
        "speeds": [{"unit": unit, "D": D, "limit": limit} for unit, D in lost],
        "transients": [transient_row(u, v, known, never) for u in UNITS[:2] for v in SPEEDS],
        "passive": passive(),
        "sensitivity": sensitivity(),
    }
    loss = {"time": "60 s", "unit": 2}
    runs = {m.upper(): simulate(CRANE, case(V_VARIED, m, loss), every="0.02 s") for m in MODES}
    runs["SSC, not known"] = simulate(CRANE, case(V_VARIED, "ssc", loss | {"detection": NEVER}), every="0.02 s")
    return blocks, runs


def draw(runs: Mapping[str, xarray.Dataset]) -> None:
    title = "nov-250t, 100 t, tip 65 m/min with 12 s: unit 2 (500 of 1355 cm³/rev) stops at 60 s"
    save(four_panels(runs, title=title, start=50.0, end=82.0), "power-unit-loss.png")
