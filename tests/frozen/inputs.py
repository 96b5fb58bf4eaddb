"""Files that the cases read: cranes, lifts, plans, weather and logs, all made up."""

import math

import numpy as np

CRANES_TOML = {
    "small-power": """
base = "nov-250t"
name = "small-power"

[active.line]
V = "60 L"

[hpu]
P_max = "250 kW"
P_back = "150 kW"

[control]
K_p = "0.3 1/m"
compute_share = 0.5

[brake]
t_wait = "1 s"
""",
    "worn-pure-active": """
base = "nov-100t-pure-active"
name = "worn-pure-active"

[active]
C_leak = "0.6 L/min/bar"

[wire]
zeta = 0.02
""",
}
SCENARIO = """
[scenario]
load = "100 t"
s_w = "100 m"
tip = "sine 1.5 m 12 s"
duration = "30 s"
warm_up = "10 s"
"""
CASES_TOML = {
    "manual": f'crane = "nov-250t"\n{SCENARIO}mode = "manual"\n[scenario.operator]\nprofile = [["5 s", "0 m/min"], ["7 s", "20 m/min"]]\n',
    "high-speed": f'crane = "nov-250t"\n{SCENARIO}mode = "hs"\n',
    "power-limit": f'crane = "small-power.toml"\n{SCENARIO}mode = "ssc"\n',
    "power-loss": f'crane = "nov-250t"\n{SCENARIO}mode = "ssc"\n[scenario.power_loss]\ntime = "18 s"\nunit = 2\n',
    "brake": f'crane = "small-power.toml"\n{SCENARIO.replace("1.5 m", "0.2 m")}mode = "manual"\n',
    "bumpless": f'crane = "nov-250t"\n{SCENARIO}mode = "ns"\nmodes = [["12 s", "hs"], ["20 s", "ssc"]]\n',
    "sensors": f'crane = "nov-250t"\n{SCENARIO}mode = "ssc"\n[scenario.sensors]\ndelay = "50 ms"\nnoise_v_tip = "10 mm/s"\nstep_s_w = "1 mm"\nseed = 4\n',
    "in-water": f'crane = "nov-250t"\n{SCENARIO}mode = "ssc"\n[scenario.water]\nvolume = "12 m^3"\nadded_mass = "30 t"\nC_D = 1.2\narea = "15 m^2"\n',
    "leakage": f'crane = "worn-pure-active.toml"\n{SCENARIO.replace("100 t", "50 t")}mode = "ssc"\n',
}
LID = """
name = "lid to the seabed"
crane = "nov-250t"
start_depth = "-2 m"
ramp = "2 s"
duration = "180 s"
[payload]
name = "lid"
mass = "30 t"
shape = "plate"
length = "5 m"
width = "4 m"
height = "0.5 m"
[tip]
height = "20 m"
motion = "sine 0.3 m 9 s"
[water]
depth = "25 m"
[wire]
nodes = 5
[[phase]]
name = "through"
mode = "splash"
speed = "30 m/min"
depth = "10 m"
[[phase]]
name = "down"
mode = "ahc"
speed = "30 m/min"
depth = "20 m"
[[phase]]
name = "land"
mode = "landing"
speed = "12 m/min"
tension = "100 kN"
time = "20 s"
"""
PLAN = """
name = "Manifold to 300 m"
crane = "nov-250t"
vessel = "construction-vessel-130m"
payload = "manifold-60t"
start_depth = "-5 m"
alternatives = ["none", "cap-80", "ssc", "strong-ssc"]

[tip]
at = "x=-15 m, y=-24 m, z=36 m"

[water]
depth = "300 m"

[environment]
Hs = ["1 m", "2 m", "4 m"]
Tp = ["6 s", "9 s"]
headings = ["180 deg"]

[operation]
T_POP = "4 h"

[[phase]]
name = "splash"
kind = "splash-zone"
depth = "280 m"

[[phase]]
name = "deep"
kind = "deep"
time = "5 min"

[[phase]]
name = "landing"
kind = "landing"
depth = "300 m"
speed = "12 m/min"
"""
TWIN_PLAN = (
    PLAN.replace('["none", "cap-80", "ssc", "strong-ssc"]', '["none", "ssc"]')
    .replace('["6 s", "9 s"]', '["9 s"]')
    .replace("5 min", "2 min")
    .replace("-5 m", "297 m")
    .replace('[[phase]]\nname = "splash"\nkind = "splash-zone"\ndepth = "280 m"\n\n', "")
)
STAIRCASE_MAPPING = """
[signals]
time = { column = "t", unit = "s" }
speed = { column = "v", quantity = "speed", unit = "mm/s" }
effort = { column = "F", quantity = "force", unit = "N" }
"""


def spectra(hours: int = 24) -> str:
    """Measured wave spectra as NDBC prints them: a swell that grows and a wind sea."""
    f = [0.02 + 0.0125 * i for i in range(34)]
    lines = ["#YY  MM DD hh mm" + "".join(f"  {x:.4f}"[:8] for x in f)]
    for hour in range(hours):
        swell, wind = 2.0 + 6.0 * math.sin(math.pi * hour / hours), 0.3 + 0.1 * (hour % 3)
        S = [swell * math.exp(-(((x - 0.09) / 0.012) ** 2)) + wind * math.exp(-(((x - 0.16) / 0.03) ** 2)) for x in f]
        lines.append(f"2019 08 01 {hour:02d} 00" + "".join(f" {value:6.2f}" for value in S))
    return "\n".join(lines) + "\n"


SPECTRA = spectra()


def weather_csv(days: int = 30) -> str:
    """A calm day in three, with a gap in time and values that are missing."""
    times = np.datetime64("2020-01-01T00:00") + np.arange(days * 24) * np.timedelta64(1, "h")
    rows = [
        f"{t}Z,{0.9 if i // 24 % 3 == 2 else 2.5},{90 * (i // 24 % 4)}"
        for i, t in enumerate(times)
        if not 200 <= i < 205
    ]
    rows[300] = rows[300].split(",")[0] + ",,"
    return "\n".join(["time,Hs [m],MWD [deg]", *rows]) + "\n"


def staircase() -> str:
    """Friction of a hydraulic ram over speed: Coulomb, Stribeck and viscous parts, with noise."""
    rng, t, rows = np.random.default_rng(3), 0.0, ["t,v,F"]
    for speed in (0.0, 0.05, 0.1, 0.2, 0.35, 0.5):
        for v in (speed, 0.0, -speed, 0.0):
            for _ in range(100):
                F = 5e4 + math.copysign(600.0 + 250.0 * math.exp(-abs(v) / 0.05) + 900.0 * abs(v), v) * (v != 0.0)
                rows.append(f"{t:.2f},{1e3 * v + rng.normal(0.0, 0.2):.4f},{F + rng.normal(0.0, 20.0):.2f}")
                t += 0.1
    return "\n".join(rows) + "\n"
