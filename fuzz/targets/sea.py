"""Vessels, waves, weather and motion as other programs write them."""

from __future__ import annotations

import json
import math
from pathlib import Path

from fuzz.targets import samples
from fuzz.targets.registry import Form, Target, text
from stillhook import read_tip_motion, read_vessel
from stillhook.formats.motion.open import read_ship_motion, understood_motion
from stillhook.formats.waves.wavespectra import read_sea
from stillhook.formats.weather.description import understood_weather
from stillhook.formats.weather.file import read_weather
from stillhook.sea.motion.text import motion_from_json
from stillhook.sea.spectra.text import spectrum_from_dict


def _ship(path: Path) -> object:
    return read_ship_motion(path, heave="up", time="logger")


def _spectrum(data: bytes) -> object:
    try:
        found = json.loads(text(data))
    except (ValueError, RecursionError):
        return None
    return spectrum_from_dict(found)


TIP = b"time [s],tip [m]\n" + b"".join(b"%.1f,%.3f\n" % (0.5 * i, math.sin(0.3 * i)) for i in range(120))
SIX = samples.hydrostar()
SITE = b"time;Hs [m];Tp [s];dir [deg]\n" + b"".join(
    b"2026-01-01 %02d:00;1.%d;8.5;120\n" % (i, i % 10) for i in range(24)
)
TARGETS = (
    Target("vessel-csv", Form.TABLE, read_vessel, "vessel.csv", seeds=samples.vessels, share=2),
    Target("vessel-text", Form.TABLE, read_vessel, "vessel.4", seeds=samples.vessels, share=3),
    Target(
        "vessel-hydrostar",
        Form.TABLE,
        read_vessel,
        "motion1.rao",
        seeds=lambda: iter(SIX[:1]),
        beside={f"motion{i}.rao": data for i, data in enumerate(SIX[1:], 2)},
    ),
    Target("vessel-orcaflex", Form.TABLE, read_vessel, "vessel.yml", seeds=samples.orcaflex),
    Target(
        "vessel-description",
        Form.TOML,
        read_vessel,
        "vessel.toml",
        seeds=lambda: iter((b'motions = "plank.4"\nlength_scale = "1 m"\ndepth = "100 m"\n',)),
        beside={"plank.4": next(samples.vessels())},
        share=0.5,
    ),
    Target("vessel-netcdf", Form.NETCDF, read_vessel, "vessel.nc", seeds=samples.capytaine, share=0.5),
    Target("waves-text", Form.TABLE, read_sea, "waves.txt", share=2),
    Target("waves-netcdf", Form.NETCDF, read_sea, "waves.nc", seeds=samples.directional, share=0.5),
    Target("weather-text", Form.TABLE, read_weather, "site.csv", share=2),
    Target("weather-gzip", Form.GZIP, read_weather, "site.csv.gz"),
    Target("weather-netcdf", Form.NETCDF, read_weather, "site.nc", seeds=samples.hindcast, share=0.5),
    Target(
        "weather-understood", Form.TABLE, lambda p: understood_weather(str(p)), "site.csv", seeds=lambda: iter((SITE,))
    ),
    Target("motion-file", Form.TABLE, read_tip_motion, "motion.csv", seeds=lambda: iter((TIP,)), share=2),
    Target("motion-ship", Form.TABLE, _ship, "motion.txt", share=2),
    Target("motion-understood", Form.TABLE, understood_motion, "motion.csv", seeds=lambda: iter((TIP,))),
    Target(
        "motion-stored",
        Form.JSON,
        lambda d: motion_from_json(text(d)),
        seeds=lambda: iter((b'{"type": "still"}', b'{"type": "sine", "amplitude": 1.0, "period": 8.0, "phase": 0.0}')),
    ),
    Target(
        "spectrum-stored",
        Form.JSON,
        _spectrum,
        seeds=lambda: iter((b'{"type": "jonswap", "H_s": 2.0, "T_p": 9.0, "gamma": 3.3, "norm": "exact"}',)),
    ),
)
