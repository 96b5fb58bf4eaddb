"""A result of a plan that was never computed: smooth made-up numbers with every case that a report must tell."""

from typing import Any

import numpy as np
import xarray

from stillhook.plan.definition.rules import ALTERNATIVES
from stillhook.plan.result import PlanResult
from stillhook.trust.standing import Judgement, Standing

HEADINGS = np.radians([150.0, 165.0, 180.0])
PERIODS = np.array([5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 14.0, 16.0])
PHASES = ("lift off deck", "over-boarding", "splash zone", "lowering", "deep", "landing")
KINDS = ("lift-off", "in-air", "splash-zone", "lowering", "deep", "landing")
TIERS = ("closed-form", "frequency", "time")
SIGNATURE = Judgement(Standing.TRUSTED, "Sea trials", "0123456789abcdef" * 2, trust_list="the user's list").to_dict()
DIGEST = "c0ffee" * 10 + "beef"
STRENGTH = {"none": 1.0, "cap-80": 1.55, "ns": 1.5, "hs": 1.62, "ssc": 2.0, "strong-ssc": 2.05}
STANDARD = {
    "standard": "DNV-ST-N001",
    "edition": "2021-09",
    "clause": "16.3 (check against your edition)",
    "note": "recalled, not read clause by clause",
}
RULES: tuple[dict[str, Any], ...] = (
    {
        "key": "capacity",
        "title": "tension at the crane tip within the crane's capacity",
        "quantity": "F_w_max",
        "limit": "crane-capacity",
        "sense": "at-most",
        "level": "p90",
        "phases": KINDS,
        **STANDARD,
    },
    {
        "key": "slack-sling",
        "title": "no slack sling",
        "quantity": "F_w_min",
        "limit": 0.1,
        "sense": "at-least",
        "level": "p90",
        "phases": KINDS[2:],
        **STANDARD,
        "standard": "DNV-RP-N103",
        "clause": "4.4.3.3 (check against your edition)",
    },
    {
        "key": "wire-speed",
        "title": "wire speed that the motion asks within the winch's",
        "quantity": "v_tip_max",
        "limit": "winch-speed",
        "sense": "at-most",
        "level": "mpm",
        "phases": KINDS[3:],
        **STANDARD,
        "standard": "Stillhook",
        "edition": "",
        "clause": "",
        "note": "steady speed at load and layer",
    },
    {
        "key": "landing-speed",
        "title": "landing speed",
        "quantity": "v_tip_max",
        "limit": 0.5,
        "sense": "at-most",
        "level": "p90",
        "phases": KINDS[5:],
        **STANDARD,
    },
)


def made_up(*, certificate: bool = False, synthetic: bool = True, blocks: bool = True) -> PlanResult:
    """The result of a made-up plan."""
    data = _data(certificate)
    found = _blocks(data, synthetic) if blocks else {}
    return PlanResult(data=data, facts=_facts(certificate) | {"card": card_of(data, certificate)}, blocks=found)


def with_synthetic_certificate(*, synthetic: bool = True) -> PlanResult:
    """The made-up plan with a SYNTHETIC certificate of all seas: credited is what the twin says, claimed the cap."""
    less = made_up(synthetic=synthetic)

    def of(block: xarray.Dataset) -> xarray.Dataset:
        three = block.sel(credit=["twin", "twin", "credited"])
        return three.assign_coords(credit=["twin", "credited", "claimable"])

    certificate = {"number": "0123456789ab", "statement": "", "synthetic": True, "assumed": True}
    facts = {**less.facts, "crane": {**less.facts["crane"], "certificate": certificate}}
    return PlanResult(of(less.data), facts, {**less.blocks, "weather": of(less["weather"])})


def card_of(data: xarray.Dataset, certificate: bool = False) -> dict[str, Any]:
    """The assessment "card" of a table: its credited limits are claimed, in every part of the lift alike."""
    table = data.sel(credit="credited", alternative="strong-ssc")
    names = ("Hs_limit_low", "alpha", "op_wf", "governing_phase", "governing_rule", "governing_tier")
    highest, cells = float(data.attrs["Hs_highest"]), []
    for i, beta in enumerate(table["heading"].values):
        for k, Tp in enumerate(table["period"].values):
            at = table.isel(heading=i, period=k)
            Hs = float(at["Hs_limit"])
            limit = {"Hs_limit": None if np.isnan(Hs) else min(Hs, highest), "above": Hs > highest}
            more = {name: at[name].item() for name in names}
            more |= {name: None for name in names[:3] if not np.isfinite(more[name])}
            cells.append({"beta": float(beta), "T_p": float(Tp), "governing_end": "", **limit, **more})
    speeds = [
        {"T_p": float(Tp), "Hs_limit": 1.0, "share": 0.9, "protects": True, "sigma_v": 0.01 * float(Tp)}
        for Tp in table["period"].values
    ]
    return {
        "alternative": "strong-ssc",
        "credit": {"by": "certificate", "certificate": "0123456789ab", "cap": 0.8, "share": 1.0}
        if certificate
        else {"by": "cap", "cap": 0.8},
        "cells": cells,
        "parts": [
            {"name": "wave zone", "phases": list(PHASES[:3]), "cells": cells},
            {"name": "deep", "phases": list(PHASES[3:5]), "cells": cells},
            {"name": "landing", "phases": list(PHASES[5:]), "cells": cells},
        ],
        "tip_speed_per_metre": [{"beta": c["beta"], "T_p": c["T_p"], "sigma_v": 0.01 * c["T_p"]} for c in cells],
        "tip_speed": {
            "wave zone": [{**row, "share": 0.1, "protects": False} for row in speeds],
            **dict.fromkeys(("deep", "landing"), speeds),
        },
    }


def _data(certificate: bool) -> xarray.Dataset:
    names = [a.value for a in ALTERNATIVES]
    rules = [r["key"] for r in RULES]
    shape = (2, len(TIERS), len(names), len(PHASES), len(rules), len(HEADINGS), len(PERIODS))
    Hs = np.full(shape, np.nan)
    T = PERIODS[None, :]
    h = 1.0 - 0.25 * np.abs(HEADINGS[:, None] - np.pi)
    for c in range(2):
        for a, name in enumerate(names):
            gain = STRENGTH[name] if c == 0 or certificate else min(STRENGTH[name], STRENGTH["cap-80"])
            for p, kind in enumerate(KINDS):
                for r, rule in enumerate(RULES):
                    if kind not in rule["phases"]:
                        continue
                    base = 1.4 + 0.9 * p % 2.3 + 0.5 * r + 6.0 / (T - 2.0)
                    limit = base * h * (0.55 * gain if p > 2 else 1.6)
                    limit = np.where(limit > 4.0, np.inf, limit)
                    for t, part in enumerate((0.85, 1.0, 1.04)):
                        if (t == 1 and p == 2) or (t == 2 and p in (0, 1)):
                            continue
                        Hs[c, t, a, p, r] = part * limit
    Hs[:, :, 0, 4, 2, 0, 0] = 0.0
    counts = np.array(["", *TIERS])[[1, 1, 3, 2, 3, 3]]
    final = np.stack(
        [Hs[:, TIERS.index(str(t)), :, p] for p, t in enumerate(counts)], axis=2
    )  # credit, alternative, phase, rule, ...
    for p, t in enumerate(counts):  # what is credited is told by the tier that counts alone
        Hs[1, [i for i, tier in enumerate(TIERS) if tier != t], :, p] = np.nan
    flat = np.where(np.isnan(final), np.inf, final).reshape(2, len(names), -1, len(HEADINGS), len(PERIODS))
    least, at = flat.min(axis=2), flat.argmin(axis=2)
    governs = np.isfinite(least)
    phase, rule = at // len(rules), at % len(rules)
    dims = ("credit", "alternative", "heading", "period")
    cells = ("alternative", "phase", "heading", "period")
    four = (len(names), len(PHASES), len(HEADINGS), len(PERIODS))
    op_wf = 0.76 * np.where(np.isfinite(least), least, 4.0)
    variables = {
        "Hs_limit": (dims, least),
        "Hs_limit_low": (dims, np.where(counts[phase] == "time", 0.95 * least, np.nan)),
        "Hs_limit_high": (dims, np.where(counts[phase] == "time", 1.05 * least, np.nan)),
        "governing_phase": (dims, np.where(governs, np.array(PHASES)[phase], "")),
        "governing_rule": (dims, np.where(governs, np.array(rules)[rule], "")),
        "governing_tier": (dims, np.where(governs, counts[phase], "")),
        "alpha": (dims, np.full(least.shape, 0.76)),
        "op_wf": (dims, np.where(np.isnan(least), np.nan, op_wf)),
        "Hs_rule": (("credit", "tier", "alternative", "phase", "rule", "heading", "period"), Hs),
        "counts": (cells, np.broadcast_to(counts[None, :, None, None], four).copy()),
        "n_seeds": (cells, np.broadcast_to(np.where(counts == "time", 24, 0)[None, :, None, None], four).copy()),
        "inside": (cells, np.full(four, 1.0 if certificate else 0.0)),
    }
    coords = {
        "credit": ["twin", "credited"],
        "tier": list(TIERS),
        "alternative": names,
        "phase": list(PHASES),
        "rule": rules,
        "heading": HEADINGS,
        "period": PERIODS,
    }
    attrs = {
        "name": "made-up",
        "digest": DIGEST,
        "Hs_lowest": 0.5,
        "Hs_highest": 4.0,
        "heading_tolerance": float(np.radians(15.0)),
    }
    return xarray.Dataset(variables, coords, attrs)


def _blocks(data: xarray.Dataset, synthetic: bool) -> dict[str, xarray.Dataset]:
    names = list(data["alternative"].values)
    gain = np.array([STRENGTH[n] for n in names])[:, None]
    z = np.linspace(0.0, -1500.0, 31)
    static = 1.1e6 + 260.0 * -z
    peak = 1.0 + 0.25 * np.exp(-(((z + 900.0) / 250.0) ** 2)) / gain**2 + 0.05 / gain
    depth = xarray.Dataset(
        {
            "F_top_max": (("alternative", "z"), static * peak),
            "F_top_static": (("z",), static),
            "DAF": (("alternative", "z"), peak),
            "sling_ratio": (("alternative", "z"), 1.0 - 1.8 * (peak - 1.0)),
            "slack_chance": (("alternative", "z"), np.clip(3.0 * (peak - 1.2), 0.0, 1.0)),
            "T_0": (("z",), 0.6 + 5.5 * np.sqrt(-z / 1500.0)),
        },
        {"alternative": names, "z": z},
        {"Hs": 2.0, "Tp": 9.0, "beta": float(np.pi), "z_resonance": -900.0},
    )
    eta = 1.0 - 1.0 / (1.0 + (gain - 1.0) * 8.0) * np.ones((1, len(PERIODS)))
    efficiency = xarray.Dataset(
        {"eta_wire": (("alternative", "period"), eta), "eta_load": (("alternative", "period"), eta - 1.2 / PERIODS)},
        {"alternative": names, "period": PERIODS},
        {"Hs": 2.0, "beta": float(np.pi), "z": -1500.0},
    )
    rng = np.random.default_rng(7)
    landing = xarray.Dataset(
        {"v_landed": (("alternative", "run"), (0.3 + rng.gumbel(0.0, 0.05, (len(names), 40))) / gain)},
        {"alternative": names},
        {"Hs": 2.0, "Tp": 9.0, "beta": float(np.pi), "limit": 0.5},
    )
    n = np.arange(4, 41, 4)
    middle = np.array([0.93, 1.04, 0.98])[:, None] + 0.03 * np.cos(n)[None, :] / np.sqrt(n)
    convergence = xarray.Dataset(
        {
            "Hs_limit": (("cell", "n"), middle),
            "low": (("cell", "n"), middle - 0.4 / np.sqrt(n)),
            "high": (("cell", "n"), middle + 0.4 / np.sqrt(n)),
        },
        {
            "cell": [
                "splash zone, all alternatives: slack-sling at Tp 8 s, 180 deg",
                "deep, ssc: wire-speed at Tp 9 s, 180 deg",
                "landing, ns: landing-speed at Tp 10 s, 165 deg",
            ],
            "n": n,
        },
    )
    return {
        "depth": depth,
        "efficiency": efficiency,
        "landing": landing,
        "convergence": convergence,
        "weather": _weather(names, synthetic),
    }


def _weather(names: list[str], synthetic: bool) -> xarray.Dataset:
    dims = ("credit", "alternative", "month")
    month = np.arange(13)
    season = np.where(month == 0, 0.6, 0.6 + 0.35 * np.cos(2.0 * np.pi * (month - 7) / 12.0))
    strength = np.array([STRENGTH[n] for n in names])
    both = np.stack([strength, np.minimum(strength, STRENGTH["cap-80"])])[:, :, None]
    operability = np.clip(0.45 * season * both, 0.0, 1.0)
    mean = 3600.0 * 20.0 / operability**2
    days = (mean + 48 * 3600.0) / 86400.0
    over = ("none", "cap-80", "best-classic")
    at = [names.index("none"), names.index("cap-80"), names.index("hs")]
    days_gained = np.stack([days[:, [i], :] - days for i in at], axis=-1)
    whole = 8760.0 * np.where(month == 0, 1.0, 1.0 / 12.0)
    hours_gained = np.stack([(operability - operability[:, [i], :]) * whole for i in at], axis=-1)
    variables = {
        "operability": (dims, operability),
        "wait_mean": (dims, mean),
        "wait_p50": (dims, 0.6 * mean),
        "wait_p90": (dims, 2.6 * mean),
        "vessel_days": (dims, days),
        "n_hours": (("month",), (10 * whole).astype(int)),
        "hours_gained": ((*dims, "over"), hours_gained),
        "days_gained": ((*dims, "over"), days_gained),
        "n_windows": (dims, (100 * operability).astype(int)),
        "n_windows_long_enough": (dims, (40 * operability).astype(int)),
        "n_censored": (dims, (9 * (1.0 - operability)).astype(int)),
        "n_gaps": ((), 3),
    }
    attrs = {
        "source": "made-up-north-sea.csv.gz",
        "synthetic": int(synthetic),
        "first": "2014-01-01T00",
        "last": "2023-12-31T23",
        "limit": "OP_WF of the table, by height, period and direction",
        "window": 48 * 3600.0,
        "ship": float("nan"),
        "alpha_table": "dnv-os-h101-2011",
        "T_R": 48 * 3600.0,
        "T_POP": 24 * 3600.0,
        "workable_limit": "OP_WF",
        "free": 1,
    }
    return xarray.Dataset(
        variables, {"credit": ["twin", "credited"], "alternative": names, "month": month, "over": list(over)}, attrs
    )


def _facts(certificate: bool) -> dict[str, Any]:
    phases = [
        {
            "name": n,
            "kind": k,
            "mode": "ahc" if i > 3 else "manual",
            "start_depth": None if i == 0 else i * 100.0 - 10.0,
            "depth": i * 200.0 - 5.0,
            "speed": 0.3,
            "duration": 1800.0 * (i + 1),
            "compensated": i > 3,
            "tiers": list(TIERS),
            "reason": "near the limit: run by the twin" if i > 1 else "no water, no compensation: closed form",
        }
        for i, (n, k) in enumerate(zip(PHASES, KINDS, strict=True))
    ]
    twin = (
        "twin: validated, level 2, certificate 0123 4567 89ab (holds)"
        if certificate
        else "twin: level 1, no certificate: credit at most 80 % of compensation"
    )
    return {
        "name": "made-up",
        "source": "made-up.toml",
        "digest": DIGEST,
        "notes": ["numbers are made up"],
        "version": "0.7.0",
        "code": "0123456789abcdef",
        "date": "2026-11-21",
        "settings": {
            "wave": "jonswap",
            "gamma": None,
            "spread": None,
            "heading_tolerance": float(np.radians(15.0)),
            "Hs": [0.5 * i for i in range(1, 9)],
            "Tp": PERIODS.tolist(),
            "headings": HEADINGS.tolist(),
        },
        "crane": {
            "name": "nov-250t",
            "title": "250 t knuckle-boom crane",
            "SWL": 250e3,
            "digest": "ab" * 32,
            "twin": twin,
            "certificate": {"number": "0123456789ab", "statement": "validated 2026-01-01", "signature": SIGNATURE}
            if certificate
            else None,
        },
        "vessel": {
            "name": "construction-vessel-130m",
            "title": "offshore construction vessel of 130 m",
            "notes": ["roll damping 5 % of critical"],
        },
        "payload": {
            "name": "template-120t",
            "mass": 120e3,
            "height": 7.0,
            "digest": "cd" * 32,
            "rows": [
                ["mass in air", "120 t", "assumed", "a template of this size"],
                ["added mass", "210 t", "derived", "DNV-RP-N103 3.3, perforation 15 %"],
            ],
        },
        "place": {"h_tip": 36.0, "depth": 1500.0, "rho": 1025.0, "text": "x = -15 m, y = 0 m, z = 36 m"},
        "phases": phases,
        "rules": {
            "name": "offshore-lift",
            "version": "1.0",
            "digest": "ef" * 32,
            "changes": [],
            "rows": [{**r, "phases": list(r["phases"])} for r in RULES],
        },
        "limited": [
            {"phase": p, "alternative": "ssc", "rule": "capacity", "limit": 2.4e6, "basis": "SWL 250 t with hook 3 t"}
            for p in PHASES
        ],
        "alternatives": [
            {
                "name": a.value,
                "description": f"what {a.value} is, in words",
                "credit_note": "computed by the twin; credited with no more than the cap" if a.twin else "as it is",
            }
            for a in ALTERNATIVES
        ],
        "operation": {
            "T_POP": 24 * 3600.0,
            "T_C": None,
            "T_R": 48 * 3600.0,
            "weather_restricted": True,
            "alpha": 0.76,
            "OP_LIM": 2.0,
            "op_wf": 1.5,
            "alpha_table": {
                "name": "dnv-os-h101",
                "version": "1",
                "standard": "DNV-OS-H101",
                "edition": "2011-10",
                "clause": "table 4-1",
            },
        },
        "tiers": list(TIERS),
        "summary": {"shown": "strong-ssc", "alternatives": {}},
        "limits": [],
        "inputs": [
            {"item": "plan", "file": "made-up.toml", "sha256": "12" * 32},
            {"item": "weather", "file": "made-up-north-sea.csv.gz", "sha256": "34" * 32},
        ],
        "runs": {
            "n": 4200,
            "n_failed": 2,
            "seeds_per_cell": [20, 40],
        },
        "not_covered": ["Wind on crane and payload."],
        "remarks": ["Phases without compensation are the same run for all alternatives."],
    }
