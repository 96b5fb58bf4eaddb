"""The section of a report on the quality of the limits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from stillhook.plan.report.words import TEXTS, governs, named, write
from stillhook.report.document import Bullets, Part, Table, Text, Verdict
from stillhook.report.formatting import direction, fixed, fmt

SHOWN = 12
"""Failed limits and neighbours that are listed at most."""


def parts(facts: Mapping[str, Any]) -> list[Part]:
    """Verdict, failed checks, tiers, neighbours, holds, steep seas."""
    of = facts["quality"]
    failed = [row for check in of["checks"] for row in check["failed"]]
    passed = "every limit agrees with its runs and its credit"
    failing = f"{len(failed)} limits contradict their runs or their credit"
    lines = [_write(check["check"], n=check["n"], failed=len(check["failed"])) for check in of["checks"]]
    if of["agreement"]:
        lines.append(_write("agreement", **of["agreement"] | {"what": _what(of["agreement"])}))
    return [
        Verdict(failing if failed else passed, not failed, lines),
        *_failed(failed),
        *_holds(of["holds"]),
        *_tiers(of["tiers"]),
        *_neighbours(of["neighbours"]),
        Text(_steep(of["steep"])),
    ]


def _write(key: str, **values: Any) -> str:
    return write(TEXTS["quality"][key], **values)


def _what(row: Mapping[str, Any]) -> str:
    return governs(row["phase"], row["rule"])


def _metres(Hs: float | None) -> str:
    return "no limit" if Hs is None else fixed(Hs, 2)


def _failed(rows: list[Mapping[str, Any]]) -> Iterator[Part]:
    if rows:
        body = [
            [
                named(row["alternative"]),
                _what(row),
                fmt(row["Tp"], "time", 3),
                direction(row["beta"]),
                _metres(row["Hs"]),
                _metres(row["least"]),
            ]
            for row in rows[:SHOWN]
        ]
        yield Table(("", "limit", "Tp", "waves", "Hs [m]", "at least [m]"), body, _write("failed", n=len(rows)))


def _holds(rows: list[Mapping[str, Any]]) -> Iterator[Part]:
    if not rows:
        return
    body = []
    for row in rows:
        body.append([row["phase"], "on its way", "", *map(_metres, row["passage"])])
        label = "held" if row["claimed"] else "held, NOT CLAIMED"
        body.append(["", label, fmt(row["time"], "time", 3), *map(_metres, row["held"])])
    yield Table(("phase", "", "time", *(f"{T:g} s" for T in rows[0]["Tp"])), body, _write("holds"))
    if off := [row for row in rows if not row["claimed"]]:
        yield Bullets([_write("not_claimed", **row) for row in off])


def _tiers(rows: list[Mapping[str, Any]]) -> Iterator[Part]:
    if not rows:
        yield Text(_write("no_tiers"))
        return
    reasons = TEXTS["quality"]["reasons"]
    body = [
        [
            _what(row),
            ", ".join(map(named, row["alternatives"])),
            f"{row['n']} of {row['of']}",
            f"{_range(row['Hs_lower'])} {row['lower']}",
            f"{_range(row['Hs_higher'])} {row['higher']}",
            ", ".join(row["counts"]),
            reasons.get(row["reason"], row["reason"]),
        ]
        for row in rows
    ]
    head = ("limit", "alternatives", "cells", "lower [m], by", "higher [m], by", "counts", "reason")
    yield Table(head, body, _write("tiers"))


def _range(Hs: list[float | None]) -> str:
    return " to ".join(dict.fromkeys(map(_metres, Hs)))


def _neighbours(rows: list[Mapping[str, Any]]) -> Iterator[Part]:
    if not rows:
        yield Text(_write("no_neighbours"))
        return
    body = [
        [
            " to ".join(dict.fromkeys(fmt(T, "time", 3) for T in row["Tp"])),
            " to ".join(dict.fromkeys(map(direction, row["beta"]))),
            *(f"{fixed(Hs, 2)} ({governs(**by)})" for Hs, by in zip(row["Hs"], row["governs"], strict=True)),
        ]
        for row in rows[:SHOWN]
    ]
    yield Table(("Tp", "waves", "limit [m]", "of its neighbour [m]"), body, _write("neighbours", n=len(rows)))


def _steep(of: Mapping[str, Any]) -> str:
    if not of["n"]:
        return _write("no_steep")
    heights = ", ".join(f"{fixed(row['Hs'], 2)} m at {row['Tp']:g} s" for row in of["Hs_steepest"])
    cut = [f"{row['n']} of {of['cells']} ({', '.join(map(named, row['alternatives']))})" for row in of["cut"]]
    return _write("steep", **of, heights=heights, in_cells="; ".join(cut) or "none")
