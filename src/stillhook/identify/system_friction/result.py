"""What `identify friction` writes: parameter set with evidence, numbers for machines, tables of points and
stretches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from stillhook.base.arrays import FloatArray
from stillhook.identify.system_friction.fitting.fit import FrictionFit, predicted
from stillhook.identify.system_friction.fitting.model import Y_NAMES, Points, motor_loss_at
from stillhook.identify.system_friction.fitting.second_loop import SecondLoop
from stillhook.identify.system_friction.fitting.uncertainty import correlation
from stillhook.identify.system_friction.identify import Friction, Mapped, nominal_share
from stillhook.identify.system_friction.measure import LOAD_CODE, carried
from stillhook.library.parameter_sets import LOSS_RANGE, Evidence, FrictionSet, LossSet
from stillhook.logs.campaign import MARK
from stillhook.spec.crane import Source, SourceKind
from stillhook.units import from_display, in_display, number
from stillhook.winches.circuits.losses import MJ4, X_NAMES, loss_values
from stillhook.winches.circuits.tables import Motor

if TYPE_CHECKING:
    import pandas


def friction_set(result: Friction) -> FrictionSet:
    """The identified parameters as a set for the library or a crane file, with where each is from and how well it is
    known."""
    campaign, fitted_points = result.campaign, result.points.fitted()
    extent = f"{len(np.unique(fitted_points.test))} tests, {len(fitted_points)} pairs"
    text = f"identified from {campaign.prefix}campaign {campaign.source} ({extent}), motor loss {campaign.losses.name}"
    title = f"System friction of {campaign.crane.name}, from {campaign.title}"
    title = title if MARK in title else campaign.prefix + title
    return _set_of(result, result.fit, "friction", title, text, [s.text for s in result.statements])


def _set_of(
    result: Friction, fit: FrictionFit, name: str, title: str, text: str, statements: Sequence[str]
) -> FrictionSet:
    """The parameters of a fit as a set; text: where they are from."""
    ranges = _ranges(result.points.fitted())
    evidence = Evidence.fitted(fit.names, fit.covariance, dof=fit.dof, data=text, ranges=ranges, statements=statements)
    return FrictionSet(name, title, fit.y.system, _sources(result, fit, text), evidence)


def warnings(result: Friction) -> str:
    """Comment lines at the top of a set whose loads are in doubt; empty where none is."""
    lines = [" ".join(s.text.split()) for s in result.statements if s.code == LOAD_CODE]
    return "".join(f"# WARNING: {line}\n" for line in lines)


def _sources(result: Friction, fit: FrictionFit, text: str) -> dict[str, Source]:
    """Where each parameter of a fit is from; text says it of the fitted ones."""
    out = {n: Source(text=text, kind=SourceKind.FITTED) for n in Y_NAMES}
    for n in fit.prescribed:
        out[n] = Source(
            text=f"taken from {result.campaign.fit.like}: these tests cannot determine it", kind=SourceKind.ASSUMED
        )
    for n in fit.dropped:
        reason = f"{result.campaign.source} does not request it"
        if n not in result.design.used:
            reason = f"the tests of {result.campaign.source} cannot determine it"
        out[n] = Source(text=f"left out: {reason}", kind=SourceKind.FITTED)
    return out


def second_loop_sets(result: Friction) -> tuple[LossSet, FrictionSet]:
    """The motor loss refined on the crane's tests and the system friction that belongs to it: use both, or neither.
    What held-out tests say of them is in their evidence."""
    loop, campaign = result.second, result.campaign
    assert loop is not None
    prefix, fitted_points = campaign.prefix, result.points.fitted()
    text = (
        f"second loop (paper D section 3) on {prefix}campaign {campaign.source}, {len(fitted_points)} pairs:"
        f" {loop.verdict}"
    )
    law, refined = loop.motor.law, loss_values(loop.motor)
    free = [i for i, x in enumerate(refined.values()) if x > 0.0]
    names, matrix = [list(refined)[i] for i in free], loop.covariance[np.ix_(free, free)]
    ranges = {k: v for k, v in _ranges(fitted_points).items() if k != "T_d"}
    plain = {n: getattr(campaign.motor, n) for n in Motor.model_fields if n not in LOSS_RANGE}
    refined_by = {"loss": loop.motor.loss, "loss_model": loop.motor.loss_model, "alternatives": None}
    motor = Motor.model_construct(None, **plain | refined_by)  # alternatives fit the supplier's map, not these tests
    gone = (*LOSS_RANGE, "alternatives")
    unchanged = {path: s for path, s in campaign.losses.sources.items() if path.split(".")[0] not in gone}
    fields = [f"loss.{n}" for n in X_NAMES] if law == MJ4 else ["loss_model.C", "loss_model.scale"]
    sources = unchanged | dict.fromkeys(fields, Source(text=text, kind=SourceKind.FITTED))
    dof, remarks = float(len(fitted_points) - len(names)), list(loop.statements)
    evidence = Evidence.fitted(names, matrix, dof=dof, data=text, ranges=ranges, statements=remarks)
    title = f"{prefix}{campaign.losses.name}, torque loss refined on {campaign.title}"
    friction_title = (
        f"{prefix}System friction of {campaign.crane.name} with its refined motor loss, from {campaign.title}"
    )
    return (
        LossSet("second-loop-motor", title, motor, sources, evidence),
        _set_of(result, loop.system, "second-loop-friction", friction_title, text, remarks),
    )


def _ranges(fitted_points: Points) -> dict[str, tuple[float, float]]:
    return {
        "omega_m": _range(fitted_points.omega, "rotation"),
        "T_d": _range(fitted_points.T_d, "drum_torque"),
        "D_m": _range(fitted_points.D_m, "displacement"),
        "dp_m": _range(np.concatenate([fitted_points.dp_up, fitted_points.dp_down]), "pressure"),
    }


def _range(values: FloatArray, kind: str) -> tuple[float, float]:
    """Ends of the data, rounded to four digits in display units: a range is not a measurement."""
    low, high = (from_display(float(number(in_display(float(v), kind), 4)), kind) for v in (values.min(), values.max()))
    return low, high


def to_dict(result: Friction) -> dict[str, Any]:
    """Everything in SI, ready for JSON; names as in the nomenclature."""
    fit, check = result.fit, result.check
    return {
        "campaign": result.campaign.title,
        "crane": result.campaign.crane.name,
        "motor": result.campaign.losses.name,
        "synthetic": result.campaign.synthetic,
        "usable": result.usable,
        "parameters": {n: _parameter(result, n) for n in Y_NAMES},
        "method": "profile",
        "names": list(fit.names),
        "covariance": fit.covariance.tolist(),
        "correlation": correlation(fit).tolist(),
        "evidence": dict(fit.evidence),
        "chi2": fit.chi2,
        "dof": fit.dof,
        "scatter_dp_F": fit.tau,
        "thesis": {
            "E_ours": check.cost_ours,
            "E_least_squares": check.cost_grid,
            "least_squares": check.y_grid._asdict(),
            "E_complex": check.optimum.cost,
            "complex": check.y_complex._asdict(),
            "evaluations": check.optimum.evaluations,
            "agree": check.agree,
            "on_grid": check.on_grid,
        },
        "tests": test_rows(result),
        "held_out": [
            {"test": h.test, "rms_percent": h.rms, "worst_percent": h.worst, "pairs": h.count} for h in result.held_out
        ],
        "second_loop": None if result.second is None else _second(result.second),
        "map": None if result.mapped is None else _mapped(result.mapped),
        "proposals": [asdict(p) for p in result.proposals],
        "statements": [asdict(s) for s in result.statements],
    }


def _parameter(result: Friction, name: str) -> dict[str, Any]:
    interval = result.intervals.get(name)
    state = "given" if name in result.fit.prescribed else "left out" if name in result.fit.dropped else "fitted"
    return {
        "value": float(getattr(result.fit.y, name)),
        "low": interval.low if interval else None,
        "high": interval.high if interval else None,
        "standard_error": result.fit.sd(name) if name in result.fit.names else None,
        "state": state,
    }


def test_rows(result: Friction) -> list[dict[str, Any]]:
    """What each test gave, SI, errors in % of nominal torque."""
    rows = []
    for m in result.measured:
        error = nominal_share(m.points, result.loss, result.fit.y)
        row = {
            "name": m.test.name,
            "load": m.test.load,
            "wire": m.test.wire,
            "load_carried": carried(result.campaign, m.test, m.points),
            "D_m": float(m.points.D_m.mean()),
            "T_d": float(m.points.T_d.mean()),
            "hold_out": m.test.hold_out,
            "log": m.test.log.name,
            "pairs": len(m.points),
            "stretches": len(m.steady.windows),
            "rejected": len(m.steady.rejected),
            "unpaired": len(m.pairs.unpaired),
            "omega_m_min": float(m.points.omega.min()),
            "omega_m_max": float(m.points.omega.max()),
            "rms_percent": float(np.sqrt(np.nanmean(error**2))),
            "notes": [n.text for n in m.notes],
            "findings": [f.text for f in m.log.findings],
        }
        rows.append(row)
    return rows


def _second(s: SecondLoop) -> dict[str, Any]:
    return {
        "law": s.motor.law,
        "motor": loss_values(s.motor),
        "system": s.system.y._asdict(),
        "E_fitted": [s.first.fitted, s.second.fitted],
        "E_held_out": [s.first.held_out, s.second.held_out],
        "verdict": s.verdict,
        "statements": list(s.statements),
    }


def _mapped(m: Mapped) -> dict[str, Any]:
    return {
        "source": m.source,
        "rms_model": m.rms_model,
        "rms_map": m.rms_map,
        "outside": m.outside,
        "system": m.fit.y._asdict(),
    }


def points_table(result: Friction) -> pandas.DataFrame:
    """Every pair in display units, units in the headings: what was measured, what the models make of it."""
    import pandas as pd

    p = result.points
    rpm, bar = 60.0 / math.tau, 1e-5
    return pd.DataFrame(
        {
            "campaign": [result.campaign.title] * len(p),
            "test": [p.names[i] for i in p.test],
            "held_out": p.hold_out,
            "omega_up [rev/min]": p.omega_up * rpm,
            "omega_down [rev/min]": p.omega_down * rpm,
            "dp_up [bar]": p.dp_up * bar,
            "dp_down [bar]": p.dp_down * bar,
            "dp_F [bar]": p.dp_F * bar,
            "u_dp_F [bar]": p.u_dp * bar,
            "dp_L [bar]": p.dp_L * bar,
            "D_m [cm^3/rev]": p.D_m * math.tau * 1e6,
            "T_d [kN m]": p.T_d / 1e3,
            "T_f [N m]": p.T_f,
            "T_f_total [N m]": p.T_f * p.count,
            "T_fm [N m]": motor_loss_at(p, result.loss),
            "T_f_model [N m]": predicted(p, result.loss, result.fit.y),
            "error [% of nominal]": nominal_share(p, result.loss, result.fit.y),
        }
    )


def stretches_table(result: Friction) -> pandas.DataFrame:
    """Every stretch of every log, used or not, and why not."""
    import pandas as pd

    rows = []
    for m in result.measured:
        stretches = [(w.start, w.end, w.direction, w.speed, w.effort, "used") for w in m.steady.windows]
        unused = (*m.steady.rejected, *m.pairs.unpaired)
        stretches += [(r.start, r.end, r.direction, r.speed, r.effort, r.reason) for r in unused]
        rows += [(m.test.name, *row) for row in sorted(stretches)]
    columns = ["test", "start [s]", "end [s]", "direction", "omega_m [rad/s]", "dp_m [Pa]", "use"]
    frame = pd.DataFrame(rows, columns=columns)
    frame["omega_m [rev/min]"] = frame.pop("omega_m [rad/s]") * 60.0 / math.tau
    frame["dp_m [bar]"] = frame.pop("dp_m [Pa]") / 1e5
    return frame
