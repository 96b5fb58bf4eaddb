"""What a plan asks, before anything is run: phases with what hangs in them, rules with their limits, seas, times."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from stillhook.plan.definition.capacities import static_tension
from stillhook.plan.definition.lift_plan import LiftPlan, WeatherUse
from stillhook.plan.definition.phases import Phase
from stillhook.plan.definition.rules import Alternative
from stillhook.plan.limits import limited
from stillhook.plan.tiers.frequency import resonance_depth, situations
from stillhook.plan.weather.value import weather_used
from stillhook.sea.spectra.spectrum import steepest, steepness
from stillhook.weather.alpha import load_alpha_table, reference_period


def checked(plan: LiftPlan) -> dict[str, Any]:
    """Plain data in SI: name, digest, what and where; phases; times T_POP, T_C, T_R and weather_restricted; rules with
    their limits in each phase and under each alternative; seas analysed, and how many are steeper than wind
    raises waves; depths of resonance; notes.
    """
    T_R, restricted = reference_period(load_alpha_table(), plan.T_POP, plan.T_C)
    env = plan.environment
    steep = sum(steepness(Hs, Tp) > steepest(Tp, "T_p") for Hs in env.Hs for Tp in env.Tp)
    return {
        "name": plan.name,
        "digest": plan.digest,
        "crane": plan.crane.name,
        "vessel": plan.vessel.name,
        "payload": plan.payload.name,
        "tip": {"x": plan.at.x, "y": plan.at.y, "h_tip": plan.h_tip},
        "depth": plan.depth,
        "phases": [_phase(plan, phase) for phase in plan.phases],
        "T_phases": sum(phase.duration or 0.0 for phase in plan.phases),
        "T_POP": plan.T_POP,
        "T_C": plan.T_C,
        "T_R": T_R,
        "weather_restricted": restricted,
        "rules": _rules(plan),
        "limits": [_limit(plan, phase, alternative) for phase in plan.phases for alternative in plan.alternatives],
        "seas": {
            "Hs": list(env.Hs),
            "Tp": list(env.Tp),
            "headings": list(env.headings),
            "steep": steep * len(env.headings),
        },
        "resonance": [{"T": T, "z": -depth} for T in env.Tp if not math.isnan(depth := resonance_depth(plan, T))],
        "weather": None if plan.weather is None else _weather(plan.weather),
        "alternatives": [a.value for a in plan.alternatives],
        "notes": list(plan.notes),
    }


def _weather(use: WeatherUse) -> dict[str, Any]:
    """How many records, from when to when, what they know, and what the reader had to say: errors of the file come
    before any run."""
    weather = weather_used(use)
    first, last = (str(np.datetime_as_string(weather.time[i], unit="m")) for i in (0, -1))
    return {
        "file": use.file,
        "n": len(weather),
        "step": weather.step,
        "first": first,
        "last": last,
        "columns": sorted(weather.columns),
        "ship": use.ship,
        "notes": [note.replace("--direction", "weather.sense") for note in weather.notes],
    }


def _rules(plan: LiftPlan) -> dict[str, Any]:
    words = ("key", "title", "standard", "edition", "clause")
    rows = [{word: getattr(rule, word) for word in words} for rule in plan.rules.rules]
    return {"name": plan.rules.name, "version": plan.rules.version, "changes": list(plan.rules.changes), "rows": rows}


def _phase(plan: LiftPlan, phase: Phase) -> dict[str, Any]:
    at = plan.tip_of(phase)
    looks = situations(plan, phase)
    return {
        "name": phase.name,
        "kind": phase.kind.value,
        "mode": phase.winch.value,
        "start": phase.start,
        "end": phase.end,
        "speed": phase.speed,
        "duration": phase.duration,
        "tip": {"x": at.x, "y": at.y, "z": at.z},
        "compensated": phase.compensated,
        "F_top_static": static_tension(plan, phase),
        "T_0": max((s.T_0 for s in looks), default=math.nan),
    }


def _limit(plan: LiftPlan, phase: Phase, alternative: Alternative) -> dict[str, Any]:
    rows = limited(plan, phase, alternative)
    return {
        "phase": phase.name,
        "alternative": alternative.value,
        "rules": [
            {"rule": row.rule.key, "quantity": row.rule.quantity, "limit": row.limit, "basis": row.basis}
            for row in rows
        ],
    }
