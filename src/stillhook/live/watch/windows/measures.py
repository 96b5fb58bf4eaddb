"""Measures of validation on a stream: sums over a batch, the statistic that they give, and extremes without one."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from stillhook.base.arrays import BoolArray, FloatArray
from stillhook.live.estimate.half_waves import AT_STOP
from stillhook.live.watch.windows.balances import Balances
from stillhook.live.watch.windows.batches import Statistic, ratio, share_below
from stillhook.live.watch.windows.rows import HISTORY, Piece, Signals
from stillhook.spec.crane import Crane
from stillhook.validate.ahc.measures import COMMON, judged_signal
from stillhook.validate.criteria.results import OF_SIGNAL

ENDS_EVERY = 0.5
"""Spacing of the ends of peak-to-peak windows [s], as in `stillhook.validate.ahc.comparison`."""
EDGES = np.append(np.linspace(0.0, 0.1, 101), 2.0)
"""Of the counts of command deviations [-]: a thousandth of full command, and what is beyond a tenth."""
SHARE = 0.95
"""Share of the samples that criterion 3 judges."""
HIGHEST = 1.0 - 1e-9
"""Largest correlation that has a z."""
ETA_ABOVE = 1.0
"""Least peak-to-peak tip motion for which the efficiency is judged [m]: `eta_above` of paper F's criteria."""
STANDS = 1.0
"""Motor speed below which the winch is at rest [rad/s]."""
ROWS_NAMES: tuple[str, ...] = (
    *("s_tip", "v_tip", "s_w", "v_w", "omega_m", "e_c_measured", "u_p", "u_m", "alpha_p", "alpha_m", "p_a", "p_b"),
    *("p_hp", "alpha_pm", "alpha_pp", "V_acc", "F_w", "mode", "v_op", "brake"),
)
"""Signals that the measures are from, besides those of the winch type."""
Sums = dict[str, FloatArray]


def names_of(crane: Crane) -> tuple[str, ...]:
    """Signals that a crane is watched by."""
    return tuple(dict.fromkeys((*ROWS_NAMES, *misfit_signals(crane))))


def misfit_signals(crane: Crane) -> tuple[str, ...]:
    """Signals of the drive whose misfit is judged."""
    return (*COMMON, *(row.name for row in crane.plant.type.rows if judged_signal(row)))


class Measures:
    """What is computed from a batch: `statistics` by key, "measure" or "measure/signal"; `sums` of a piece by key."""

    def __init__(self, crane: Crane) -> None:
        self.balances = Balances(crane)
        self._misfits = () if "active" in crane.circuits else misfit_signals(crane)  # judged by any-drive alone
        self._keys = {key.partition("/")[2]: key.partition("/")[0] for key in self.balances.statistics}
        own = {name: self.balances.statistics[f"{of}/{name}"] for name, of in self._keys.items()}
        misfits = {f"signal_misfit/{OF_SIGNAL}{s}": Statistic(_misfit) for s in self._misfits}
        self.statistics: Mapping[str, Statistic] = {**COMPARED, **own, **misfits}

    def sums(self, piece: Piece) -> Sums:
        """Of the new rows, by key of `statistics`; those whose signals are there."""
        out: Sums = {}
        of_balance = self.balances.sums(piece.crane, piece.twin, piece.new, piece.every)
        out |= {name: of_balance[of] for name, of in self._keys.items() if of in of_balance}
        for of in (_errors, _commands, self._kinematics, _levels, self._of_signals):
            out |= of(piece)
        return {key: np.nan_to_num(s) for key, s in out.items() if np.isfinite(s).any()}

    def _kinematics(self, p: Piece) -> Sums:
        """Gains of speeds against the lengths that they are rates of, and of the wire against the motors' turns."""
        x, h, out = p.crane, p.every, {}
        pairs = [("v_w_error", "v_w", "s_w", -1.0, 1.0), ("v_tip_error", "v_tip", "s_tip", 1.0, 1.0)]
        if "s_w" in x and self.balances.balance is not None:
            r_eff = self.balances.balance.geometry(float(np.nanmean(x["s_w"]))).r_eff
            pairs.append(("lever_error", "omega_m", "s_w", -1.0, r_eff))
        for name, speed, length, sign, scale in pairs:
            if speed in x and length in x:
                v, s = scale * x[speed][p.new], sign * x[length][p.new]
                step = 0.5 * h * (v[1:] + v[:-1])
                rise = np.diff(s)
                good = np.isfinite(step) & np.isfinite(rise)
                of_both, of_step = step[good] @ rise[good], step[good] @ step[good]
                out[name] = np.array([of_both, of_step] if name == "lever_error" else [of_step, of_both])
        return out

    def _of_signals(self, p: Piece) -> Sums:
        out: Sums = {}
        for name in self._misfits:
            if name in p.crane and name in p.twin:
                m, s = p.crane[name][p.new], p.twin[name][p.new]
                good = np.isfinite(m) & np.isfinite(s)
                m, s = m[good], s[good]
                d = s - m
                sums = [len(m), m.sum(), m @ m, d.sum(), d @ d]
                out[f"signal_misfit/{OF_SIGNAL}{name}"] = np.array(sums, dtype=np.float64)
        return out


def errors(p: Piece) -> tuple[FloatArray, FloatArray] | None:
    """Control errors of crane and twin over a piece, by one definition [m]; None where the crane's is not known."""
    if "e_c_measured" in p.crane and "e_c_measured" in p.twin:
        return p.crane["e_c_measured"], p.twin["e_c_measured"]
    if "s_tip" not in p.crane or "s_w" not in p.crane or "s_w" not in p.twin:
        return None
    taken = np.nancumsum(p.crane["v_op"]) * p.every if "v_op" in p.crane else 0.0
    return p.crane["s_tip"] - taken - p.crane["s_w"], p.crane["s_tip"] - taken - p.twin["s_w"]


def _errors(p: Piece) -> Sums:
    """Of the control errors: 2b, 2c and 2d."""
    both = errors(p)
    if both is None or "s_tip" not in p.crane:
        return {}
    m, s = (x[p.new] for x in both)
    good = np.isfinite(m) & np.isfinite(s)
    m, s = m[good] - _first(m), s[good] - _first(m)
    out = {"e_c_correlation": np.array([len(m), m.sum(), s.sum(), m @ m, s @ s, m @ s], dtype=np.float64)}
    length, step = round(HISTORY / p.every) + 1, max(1, round(ENDS_EVERY / p.every))
    ends = [k for k in range(p.new.start, p.new.stop, step) if k - length + 1 >= 0]
    if ends:
        pp = np.array([[np.ptp(x[k - length + 1 : k + 1]) for k in ends] for x in (*both, p.crane["s_tip"])])
        off, tip = np.abs(pp[1] - pp[0]), pp[2]
        good = np.isfinite(pp).all(axis=0)
        out["e_c_pp_deviation"] = np.array([off[good].sum(), good.sum()], dtype=np.float64)
        out["tip_pp"] = np.array([tip[good].max(initial=0.0)])
        high = good & (tip >= ETA_ABOVE)
        out["eta_c_deviation_high"] = np.array([(off[high] / tip[high]).sum(), high.sum()], dtype=np.float64)
    return out


def _first(x: FloatArray) -> float:
    good = np.isfinite(x)
    return float(x[good][0]) if good.any() else 0.0


def _commands(p: Piece) -> Sums:
    """Of the commands: criteria 3 and 4."""
    out: Sums = {}
    for name in ("u_p", "u_m"):
        if name in p.crane and name in p.twin:
            off = np.abs(p.crane[name] - p.twin[name])[p.new]
            count = np.histogram(np.minimum(off[np.isfinite(off)], EDGES[-1]), EDGES)[0]
            out[f"{name}_deviation"] = count.astype(np.float64)
    if "u_p" not in p.crane or "u_p" not in p.twin:
        return out
    m, s = p.crane["u_p"], p.twin["u_p"]
    rate = np.gradient(s, p.every)
    at_end_m, at_end_s = np.abs(m) >= AT_STOP, np.abs(s) >= AT_STOP
    free = (~at_end_m & ~at_end_s & np.isfinite(m) & np.isfinite(s))[p.new]
    m_, s_, r_ = m[p.new][free], s[p.new][free], rate[p.new][free]
    A = [s_ @ s_, s_ @ r_, s_ @ r_, r_ @ r_]
    out["K_1_deviation"] = out["command_lag"] = np.array([*A, s_ @ m_, r_ @ m_])
    both = np.array([(at_end_m & at_end_s)[p.new].sum(), (at_end_m | at_end_s)[p.new].sum()], dtype=np.float64)
    out["saturation_overlap"] = both
    if "v_w" in p.crane and "v_w" in p.twin:
        at = (at_end_m & at_end_s)[p.new]
        speeds = [np.nansum(np.abs(x["v_w"][p.new][at])) for x in (p.twin, p.crane)]
        out["limit_speed_error_whole"] = np.array(speeds)
    return out


def _levels(p: Piece) -> Sums:
    """Mean levels of both sides."""
    c, w, out = p.crane, p.twin, {}

    def mean_of(name: str, of: Callable[[Signals], FloatArray], where: BoolArray | None = None) -> None:
        try:
            pair = [np.asarray(of(x))[p.new] for x in (c, w)]
        except KeyError:
            return
        good = np.isfinite(pair[0]) & np.isfinite(pair[1])
        good = good if where is None else good & where[p.new]
        out[name] = np.array([pair[0][good].sum(), pair[1][good].sum(), good.sum()], dtype=np.float64)

    mean_of("load_cell_error", lambda x: x["F_w"])
    mean_of("motor_offset_error", lambda x: x["alpha_m"] - x["u_m"])
    mean_of("boost_error", lambda x: np.minimum(x["p_a"], x["p_b"]))
    if "mode" in c and "omega_m" in c:
        stands = (c["mode"] == 0.0) & (np.abs(c["omega_m"]) < STANDS)
        if stands.any():
            mean_of("rest_pressure_difference", lambda x: x["p_a"] - x["p_b"], stands)
    if all(name in x for name in ("alpha_p", "u_p") for x in (c, w)):
        sums = [f(x) for x in (c, w) for f in (_product, _square)]
        out["pump_gain_error"] = np.array([s(p.new) for s in sums])
    if "V_acc" in c and "V_acc" in w:
        out["passive_flow_error"] = np.array(
            [np.abs(np.diff(x["V_acc"][p.new])).sum() for x in (c, w)], dtype=np.float64
        )
    known = [np.isfinite(x[p.new]).mean() for name, x in c.items() if name in w]
    out["samples_doubtful"] = np.array([1.0 - min(known, default=1.0), 1.0])
    return out


def _product(x: Signals) -> Callable[[slice], float]:
    return lambda new: float(np.nansum(x["alpha_p"][new] * x["u_p"][new]))


def _square(x: Signals) -> Callable[[slice], float]:
    return lambda new: float(np.nansum(x["u_p"][new] ** 2))


def _correlation(s: FloatArray) -> FloatArray:
    n, m, t, mm, tt, mt = (s[..., k] for k in range(6))
    r = (mt / n - m * t / n**2) / np.sqrt((mm / n - (m / n) ** 2) * (tt / n - (t / n) ** 2))
    return np.arctanh(np.clip(r, -HIGHEST, HIGHEST))


def _misfit(s: FloatArray) -> FloatArray:
    n, m, mm, d, dd = (s[..., k] for k in range(5))
    return np.sqrt((dd / n - (d / n) ** 2) / (mm / n - (m / n) ** 2))


def _gain(s: FloatArray) -> FloatArray:
    a, b, c, d, e, f = (s[..., k] for k in range(6))
    return (d * e - b * f) / (a * d - b * c) - 1.0


def _lag(s: FloatArray) -> FloatArray:
    a, b, c, d, e, f = (s[..., k] for k in range(6))
    return -(a * f - c * e) / (d * e - b * f)


COMPARED: Mapping[str, Statistic] = {
    "e_c_pp_deviation": ratio(0, 1),
    "eta_c_deviation_high": ratio(0, 1),
    "e_c_correlation": Statistic(_correlation, np.tanh),
    "u_p_deviation": share_below(EDGES, SHARE),
    "u_m_deviation": share_below(EDGES, SHARE),
    "command_lag": Statistic(_lag),
    "K_1_deviation": Statistic(_gain),
    "saturation_overlap": ratio(0, 1),
    "limit_speed_error_whole": ratio(0, 1, 1.0),
    "lever_error": ratio(0, 1, 1.0),
    "v_w_error": ratio(0, 1, 1.0),
    "v_tip_error": ratio(0, 1, 1.0),
    "load_cell_error": ratio(0, 1, 1.0),
    "motor_offset_error": Statistic(lambda s: (s[..., 0] - s[..., 1]) / s[..., 2]),
    "boost_error": Statistic(lambda s: (s[..., 0] - s[..., 1]) / s[..., 2]),
    "rest_pressure_difference": Statistic(lambda s: s[..., 0] / s[..., 2]),
    "pump_gain_error": Statistic(lambda s: s[..., 0] / s[..., 1] / (s[..., 2] / s[..., 3]) - 1.0),
    "passive_flow_error": ratio(0, 1, 1.0),
    "samples_doubtful": ratio(0, 1),
}
"""Statistics of the sums that this file makes, by measure of validation."""
