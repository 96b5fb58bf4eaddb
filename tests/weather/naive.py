"""Persistence by the slowest road: one record after the other, dates of the standard library, no arrays. Shares no line with the package."""

import csv
import datetime as dt
import functools
import itertools
import statistics

HOUR = dt.timedelta(hours=1)


@functools.cache
def orbit(path):
    """(time, Hs, wind) of the American table."""
    with open(path, newline="") as file:
        return [
            (dt.datetime.strptime(r["datetime"], "%m/%d/%y %H:%M"), float(r["waveheight"]), float(r["windspeed"]))
            for r in csv.DictReader(file)
        ]


@functools.cache
def hindcast(path):
    """(time, Hs, Tp, direction as printed [deg])."""
    with open(path, newline="") as file:
        rows = csv.reader(file)
        next(rows)
        return [(dt.datetime.fromisoformat(t), float(H), float(T), float(d)) for t, H, T, d in rows]


def follows(a, b, step):
    return b - a == step


def runs(times, good, step):
    """Lists of indices of consecutive good records."""
    found, now = [], []
    for i, fine in enumerate(good):
        if now and (not fine or not follows(times[i - 1], times[i], step)):
            found.append(now)
            now = []
        if fine:
            now.append(i)
    return found + ([now] if now else [])


def persistence(times, good, step, window):
    """What the command prints, in hours; good holds True, False, or None where a value is missing."""
    known = [g for g in good if g is not None]
    found = runs(times, [bool(g) for g in good], step)
    lengths = [len(run) * (step / HOUR) for run in found]
    starting = starts(times, [bool(g) for g in good], step, window)
    possible = starts(times, [g is not None for g in good], step, window)
    waits, censored, next_start = [], 0, None
    ahead = sorted(starting, reverse=True)
    ahead_set = set(ahead)
    for i in range(len(times) - 1, -1, -1):
        if i in ahead_set:
            next_start = i
        if next_start is None:
            censored += 1
        else:
            waits.append((times[next_start] - times[i]) / HOUR)
    return {
        "n_hours": len(times) * (step / HOUR),
        "operability": sum(known) / len(known),
        "start_share": len(starting) / len(possible) if possible else None,
        "n_windows": len(found),
        "window_mean": statistics.fmean(lengths) if lengths else None,
        "n_windows_long_enough": sum(length >= window for length in lengths),
        "wait_mean": statistics.fmean(waits) if waits else None,
        "wait_p50": quantile(waits, 0.5),
        "wait_p90": quantile(waits, 0.9),
        "n_censored": censored,
        "n_gaps": sum(not follows(a, b, step) for a, b in itertools.pairwise(times)),
    }


def starts(times, good, step, window):
    """Indices of the records from which so much good time follows."""
    return [
        i
        for run in runs(times, good, step)
        for place, i in enumerate(run)
        if (len(run) - place) * (step / HOUR) >= window
    ]


def kept_heading(times, good_at, step, window):
    """Of a ship that keeps one heading through an operation: good_at lists the good records of each heading. Starts, waits in hours, and the
    longest stretches (first and last record) that one heading gives: none of them lies within another."""
    starting = sorted({i for good in good_at for i in starts(times, good, step, window)})
    stretches = {(run[0], run[-1]) for good in good_at for run in runs(times, good, step)}
    longest = {a for a in stretches if not any(b != a and b[0] <= a[0] and b[1] >= a[1] for b in stretches)}
    possible = starts(times, [True] * len(times), step, window)
    waits = [min(((times[k] - times[i]) / HOUR for k in starting if k >= i), default=None) for i in range(len(times))]
    known = [w for w in waits if w is not None]
    return {
        "operability": len(
            {
                i
                for good in good_at
                for run in runs(times, good, step)
                if len(run) * (step / HOUR) >= window
                for i in run
            }
            if len(good_at) > 1
            else [i for i in range(len(times)) if good_at[0][i]]
        )
        / len(times),
        "start_share": len(starting) / len(possible) if possible else None,
        "n_windows": len(longest),
        "n_windows_long_enough": sum((b - a + 1) * (step / HOUR) >= window for a, b in longest),
        "wait_mean": statistics.fmean(known) if known else None,
        "n_censored": sum(w is None for w in waits),
    }


def quantile(waits, share):
    """Linear between the two nearest."""
    if not waits:
        return None
    ordered = sorted(waits)
    place = share * (len(ordered) - 1)
    below = int(place)
    above = min(below + 1, len(ordered) - 1)
    return ordered[below] + (place - below) * (ordered[above] - ordered[below])
