"""Bands of the peak period, as a limit is read on board: at the most unfavourable heading, and between two periods of
the table the lower of both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any

from stillhook.report.formatting import fixed

MOST = 9
"""Bands at most, but for the one above the table: neighbours that differ least are one, at the lower limit."""
NO_RESULT, CALM, NO_FACTOR, ABOVE_TABLE = "no result", "exceeded in calm", "no alpha", "beyond the table"
"""Why there is no go in a band."""
GOVERNING = ("governing_phase", "governing_rule", "governing_tier", "governing_end", "beta")


def edges_of(cells: Iterable[Mapping[str, Any]], most: int = MOST) -> list[tuple[float, float]]:
    """First and last period of every band, rising; a single period is a band of its own."""
    worst = _worst_headings(cells)
    edges = list(pairwise(sorted(worst))) or [(T, T) for T in worst]
    while len(edges) > most:
        heights = [min(_height(worst[T]) for T in worst if low <= T <= high) for low, high in edges]
        k = min(range(len(edges) - 1), key=lambda i: abs(heights[i] - heights[i + 1]))
        edges[k : k + 2] = [(edges[k][0], edges[k + 1][1])]
    return edges


def bands_of(
    cells: Iterable[Mapping[str, Any]], restricted: bool, edges: Sequence[tuple[float, float]]
) -> list[dict[str, Any]]:
    """Bands of the cells of an assessment "card", rising: T_p_from (None: from the shortest waves), T_p_to (None: to
    the longest), Hs_limit [m], above (whether it is the highest sea analysed, and no limit), alpha, op_wf [m], what
    governs, and no_go, the reason where there is none.

    restricted: whether the operation is weather restricted, so that a band without a forecast factor is no go; edges of
    `edges_of`.
    """
    worst = _worst_headings(cells)
    rows = []
    for i, (low, high) in enumerate(edges):
        lowest = min((worst[T] for T in sorted(worst) if low <= T <= high), key=_height)
        rows.append(_row(lowest, low if i else None, high, restricted))
    nothing = {"Hs_limit": 0.0, "above": False, "alpha": None, "op_wf": None} | dict.fromkeys(GOVERNING)
    return [*rows, nothing | {"T_p_from": edges[-1][1], "T_p_to": None, "no_go": ABOVE_TABLE}]


def _worst_headings(cells: Iterable[Mapping[str, Any]]) -> dict[float, Mapping[str, Any]]:
    """Of every period the cell with the lowest limit; one without a result comes first."""
    worst: dict[float, Mapping[str, Any]] = {}
    for cell in cells:
        T = float(cell["T_p"])
        worst[T] = min(worst.get(T, cell), cell, key=_height)
    return worst


def _height(row: Mapping[str, Any]) -> float:
    """Limit of a row for comparing [m]: without a result below all, and without a factor below those with one."""
    return -1.0 if row["Hs_limit"] is None else float(row["Hs_limit"])


def _row(cell: Mapping[str, Any], low: float | None, high: float, restricted: bool) -> dict[str, Any]:
    Hs = cell["Hs_limit"]
    reason = NO_RESULT if Hs is None else CALM if Hs <= 0.0 else ""
    reason = reason or (NO_FACTOR if restricted and cell["op_wf"] is None else "")
    kept = {key: cell[key] for key in ("Hs_limit", "above", *GOVERNING)}
    factors = {key: cell[key] if restricted and not reason else None for key in ("alpha", "op_wf")}
    return {"T_p_from": low, "T_p_to": high, **kept, **factors, "no_go": reason}


def label(band: Mapping[str, Any]) -> str:
    """ "up to 6 s", "6 s to 7 s", "above 14 s"."""
    low, high = (None if band[key] is None else f"{band[key]:g}" for key in ("T_p_from", "T_p_to"))
    if low is None:
        return f"up to {high} s"
    return f"above {low} s" if high is None else f"{low} to {high} s"


def stopped(bands: Sequence[Mapping[str, Any]]) -> str:
    """Where there is no go: "up to 7 s, above 12 s"; empty where there is a go in every band."""
    return _spans([band for band in bands if band["no_go"]])


def open_bands(bands: Sequence[Mapping[str, Any]]) -> str:
    """Where there is a go: "7 to 12 s"; empty where there is none."""
    return _spans([band for band in bands if not band["no_go"]])


def _spans(bands: Sequence[Mapping[str, Any]]) -> str:
    """Bands, neighbours as one."""
    rows: list[dict[str, Any]] = []
    for band in bands:
        if rows and rows[-1]["T_p_to"] == band["T_p_from"]:
            rows[-1]["T_p_to"] = band["T_p_to"]
        else:
            rows.append({"T_p_from": band["T_p_from"], "T_p_to": band["T_p_to"]})
    return "any" if rows == [{"T_p_from": None, "T_p_to": None}] else ", ".join(map(label, rows))


def limit(band: Mapping[str, Any]) -> str:
    """OP_LIM of a band [m]."""
    if band["Hs_limit"] is None:
        return "-"
    return fixed(band["Hs_limit"], 2) if band["Hs_limit"] > 0.0 else "0"


def forecast(band: Mapping[str, Any]) -> str:
    """OP_WF of a band [m], "NO GO" where there is none."""
    return "NO GO" if band["no_go"] else fixed(band["op_wf"], 2)


def headline(bands: Sequence[Mapping[str, Any]], key: str = "Hs_limit") -> str:
    """Range of a height over the bands in which there is a go: "0.54 m to 1.55 m"; empty where there is none."""
    heights = [band[key] for band in bands if not band["no_go"] and band[key] is not None]
    ends = dict.fromkeys(f"{x:.2f} m" for x in (min(heights), max(heights))) if heights else {}
    return " to ".join(ends)
