"""Make the library's weather: a hindcast that nobody measured, for examples and tests. Its file and its name state
SYNTHETIC.

    python weather_data/make.py

Ten years, a record every three hours, of a deep and open place such as the Norwegian Sea: strong winters and calm
summers, storms of a day or two, wind sea that grows with the wind and dies after it, swell of its own from the
north-west. Every number below is assumed and has no source but judgement: that Hs is some 2.5 m on average, twice as
high in January as in July, and stays within a metre for a day.
"""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

NAME = "SYNTHETIC-norwegian-sea"
FILE = Path(__file__).resolve().parents[1] / "src" / "stillhook" / "library" / "data" / "weather" / f"{NAME}.csv.gz"
SEED = 20210
START, YEARS, STEP = np.datetime64("2011-01-01T00:00"), 10, 3
HOURS = 1
"""The sea is stepped every hour and written every `STEP`."""
FloatArray = NDArray[np.float64]
HEADER = (
    "# SYNTHETIC weather: made by a random generator (weather_data/make.py), measured nowhere; for examples only",
    "# wave direction: coming from, clockwise from north",
    "time,Hs [m],Tp [s],wave_direction [deg],wind_speed [m/s],wind_from_direction [deg]",
)


def red(rng: np.random.Generator, n: int, hours: float) -> FloatArray:
    """Gaussian noise (n,) of unit deviation, its correlation e^-1 after so many hours, smooth over an hour or two."""
    keep = np.exp(-HOURS / hours)
    noise = rng.standard_normal(n) * np.sqrt(1.0 - keep**2)
    x = np.empty(n)
    x[0] = rng.standard_normal()
    for i in range(1, n):
        x[i] = keep * x[i - 1] + noise[i]
    return x


def normal_share(x: FloatArray) -> FloatArray:
    """Share of a unit Gaussian below x (error function by Abramowitz and Stegun 7.1.26, within 1e-7)."""
    z = np.abs(x) / np.sqrt(2.0)
    t = 1.0 / (1.0 + 0.3275911 * z)
    poly = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))))
    erf = 1.0 - poly * np.exp(-(z**2))
    return 0.5 * (1.0 + np.sign(x) * erf)


def lagged(target: FloatArray, rise: float, fall: float) -> FloatArray:
    """Follows a target (n,), with one time constant upwards and another downwards [h]."""
    y = np.empty(len(target))
    y[0] = target[0]
    for i in range(1, len(target)):
        y[i] = y[i - 1] + (target[i] - y[i - 1]) * (1.0 - np.exp(-HOURS / (rise if target[i] > y[i - 1] else fall)))
    return y


def weather() -> tuple[NDArray[np.datetime64], dict[str, FloatArray]]:
    """Times and columns: Hs [m], Tp [s], directions [rad, coming from], wind [m/s]."""
    rng = np.random.default_rng(SEED)
    end = START.astype("datetime64[Y]") + YEARS
    time = np.arange(START, end.astype("datetime64[m]"), np.timedelta64(HOURS, "h"))
    n = len(time)
    day = (time - time.astype("datetime64[Y]")) / np.timedelta64(1, "D")
    season = np.cos(2.0 * np.pi * (day - 20.0) / 365.25)  # 1 in the second half of January, -1 in July
    year = np.repeat(rng.normal(0.0, 0.05, YEARS), np.unique(time.astype("datetime64[Y]"), return_counts=True)[1])
    scale = (9.7 + 2.2 * season) * (1.0 + year)
    slow, quick = red(rng, n, 40.0), red(rng, n, 7.0)
    wind = scale * (-np.log(1.0 - np.clip(normal_share(0.94 * slow + 0.34 * quick), 1e-6, 1.0 - 1e-6))) ** (1.0 / 2.1)
    wind_from = np.radians(235.0) + np.radians(70.0) * red(rng, n, 48.0) + np.radians(15.0) * red(rng, n, 10.0)
    sea = np.sqrt(lagged((0.0145 * wind**2) ** 2, 9.0, 20.0))
    swell = (1.2 + 0.4 * season) * np.exp(0.45 * red(rng, n, 90.0))
    swell_from = np.radians(315.0) + np.radians(22.0) * red(rng, n, 120.0)
    east, north = lagged(np.sin(wind_from), 8.0, 8.0), lagged(np.cos(wind_from), 8.0, 8.0)
    sea_from = np.arctan2(east, north)
    Hs = np.hypot(sea, swell)
    flow = sea**2 * np.exp(1j * sea_from) + swell**2 * np.exp(1j * swell_from)
    T_sea = 4.35 * np.sqrt(np.maximum(sea, 0.25)) * np.exp(0.04 * red(rng, n, 24.0))
    T_swell = np.clip(11.2 + 0.9 * season + 1.9 * red(rng, n, 60.0), 7.5, 18.0)
    Tp = np.where(sea > swell, np.maximum(T_sea, 3.0), T_swell)
    kept = slice(None, None, STEP)
    columns = {
        "Hs": Hs,
        "Tp": Tp,
        "from": np.angle(flow) % (2.0 * np.pi),
        "wind": wind,
        "wind_from": wind_from % (2.0 * np.pi),
    }
    return time[kept], {name: x[kept] for name, x in columns.items()}


def text() -> str:
    """The table: heights to 5 cm, periods to 0.1 s, directions to 5 deg, wind to 0.5 m/s, as hindcasts are rounded."""
    time, c = weather()
    stamps = np.datetime_as_string(time, unit="m")
    turn = {name: np.round(np.degrees(c[name]) / 5.0).astype(int) * 5 % 360 for name in ("from", "wind_from")}
    Hs, wind = np.round(c["Hs"] / 0.05) * 0.05, np.round(c["wind"] / 0.5) * 0.5
    rows = (
        f"{t}Z,{H:.2f},{T:.1f},{d},{U:.1f},{u}"
        for t, H, T, d, U, u in zip(stamps, Hs, c["Tp"], turn["from"], wind, turn["wind_from"], strict=True)
    )
    return "\n".join((*HEADER, *rows)) + "\n"


def main() -> None:
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_bytes(gzip.compress(text().encode(), 9, mtime=0))
    print(f"{FILE.name}: {FILE.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
