"""Cases of what a winch is written as for other programs, of components from data of their own, and of reports."""

import contextlib
import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.signal import cont2discrete, dlsim
from tests.frozen.drawn import figures, numbered
from tests.frozen.printed import columns, lines, printed, texts
from tests.plan.made_up import made_up

import stillhook
from stillhook.export.fmu.package import fmu_members
from stillhook.export.twin import export
from stillhook.library import changed
from stillhook.plan.report import document
from stillhook.report.terminal import print_document

ARRAY = re.compile(r"^(?:SH_UNUSED )?static (?:const )?double (sh_\w+)\[\d+\] = \{(.*?)\};", re.MULTILINE | re.DOTALL)
DEFINE = re.compile(r"^#define (SH_\w+) (-?[\d.e+-]+)\b", re.MULTILINE)
NUMBER = re.compile(r"-?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|NAN|INFINITY")
BOOM = "x=-10 m, y=-6 m, z=8 m, slew 270 deg, main 25 m 50 deg, knuckle 15 m 60 deg"


def _model(source: str) -> dict[str, Any]:
    """Numbers of a twin's C source beside its equations: tables, and what is defined."""
    tables = {name: [float(x) for x in NUMBER.findall(text)] for name, text in ARRAY.findall(source)}
    return {"tables": tables, "defined": {name: float(value) for name, value in DEFINE.findall(source)}}


def written_units() -> Any:
    """Functional mock-up units of whole winches and of their parts, moved at the tip, by the wire and by the vessel."""
    usual = {"load": "100 t", "s_w": "100 m", "mode": "ssc", "duration": "20 s", "warm_up": "5 s"}
    boom = stillhook.VesselTip(BOOM, heave="sine 1 m 9 s", roll="sine 2 deg 12 s", pitch="sine 1 deg 8 s")
    sine = stillhook.Sine(height="1 m", period="10 s")
    found = {}
    for fmi, name, contents, coupling, tip in (
        ("3", "nov-250t", "plant+controller", "tip", sine),
        ("2", "nov-250t", "plant+controller", "vessel", boom),
        ("2", "nov-100t-pure-active", "plant", "wire", sine),
        ("2", "nov-250t", "controller", "tip", sine),
    ):
        crane = stillhook.load_crane(name)
        case = stillhook.Scenario(tip=tip, **usual | {"load": "60 t"})
        made = export(crane, case, contents, coupling)
        members = {n: data.decode() for n, data in fmu_members(made, fmi=fmi, platforms=("source",)).items()}
        model = _model(members.pop("sources/model.c"))
        kept = {n: lines(text) for n, text in members.items() if n.endswith((".xml", ".json")) and "manifest" not in n}
        found[f"{name} {contents} {coupling} {fmi}"] = model | kept
    return found


def written_externals() -> Any:
    return {
        host: [
            printed("external", host, "nov-250t", "--platforms", "source", "--out", host, verbose=False),
            texts(host, ".txt", ".yml", ".py"),
        ]
        for host in ("orcaflex", "simo")
    }


def _table(name: str, heading: str, rows: Any) -> str:
    np.savetxt(name, np.array(list(rows), dtype=float), fmt="%.9g", delimiter=",", header=heading, comments="")
    return name


def _flows() -> Iterator[tuple[float, ...]]:
    """Motors: D [cm^3/rev], n [rev/min], dp [bar], Q [L/min], with a leak that bends a little with pressure."""
    for D in (250.0, 190.0, 130.0):
        for n in (300.0, 900.0, 1500.0, 2100.0):
            for dp in (50.0, 150.0, 250.0, 350.0):
                yield D, n, dp, D * n / 1000.0 + (0.02 + 4e-6 * n) * dp * (1.0 + 0.02 * np.sin(n + dp))


def _swivel() -> Iterator[tuple[float, ...]]:
    """Steps of a motor's displacement, of 5 rad/s and 0.9, two hundredths above its command."""
    u = np.repeat(np.random.default_rng(3).uniform(0.2, 0.95, 16), 250)
    A, B = np.array([[0.0, 1.0], [-25.0, -9.0]]), np.array([[0.0], [25.0]])
    *system, _ = cont2discrete((A, B, np.array([[1.0, 0.0]]), np.zeros((1, 1))), 0.01)
    alpha = dlsim((*system, 0.01), u, x0=[u[0], 0.0])[1][:, 0] + 0.02 + 1e-3 * np.sin(np.arange(len(u)) ** 2)
    return zip(0.01 * np.arange(len(u)), u, alpha, strict=True)


def _lines() -> str:
    """Log of a winch with resistance in its lines."""
    crane = changed(
        stillhook.load_crane("nov-100t-pure-active"),
        {"active": {"lines": {"R_1": "0.002 bar/(L/min)", "R_2": "4e-6 bar/(L/min)^2"}}},
    )
    case = stillhook.Scenario(load="40 t", s_w="200 m", tip="sine 1.5 m 12 s", mode="ssc", duration="60 s")
    data = stillhook.simulate(crane, case, every="0.05 s", threads=1)
    names = ("p_a_pump", "p_a_motor", "p_b_pump", "p_b_motor", "alpha_m", "omega_m")
    units = ("Pa", "Pa", "Pa", "Pa", "1", "rad/s")
    heading = ",".join(["time [s]", *(f"{name} [{unit}]" for name, unit in zip(names, units, strict=True))])
    return _table("lines.csv", heading, np.column_stack([data.time, *(data[name] for name in names)]))


def printed_components() -> Any:
    Path("base.toml").write_text('[component]\nbase = "nov-250t"\n', encoding="utf-8")
    Path("pure.toml").write_text('[component]\nbase = "nov-100t-pure-active"\n', encoding="utf-8")
    flows = _table("flows.csv", "D [cm^3/rev],n [rev/min],dp [bar],Q [L/min]", _flows())
    swivel = _table("swivel.csv", "time [s],u_m [1],alpha_m [1]", _swivel())
    with figures() as pictures:
        found = {
            kind: printed("identify", "component", kind, data, "--mapping", mapping, "--out", kind)
            for kind, data, mapping in (
                ("motor-leakage", flows, "base.toml"),
                ("servo", swivel, "base.toml"),
                ("lines", _lines(), "pure.toml"),
            )
        }
    return {"printed": found, "figures": numbered(pictures)}


def reports_of_plans() -> Any:
    """The report of a made-up plan as a page, its figures, and the answer in brief; without a typesetter."""
    found = {}
    for name, plan in {"assumed": made_up(), "certified": made_up(certificate=True, synthetic=False)}.items():
        with figures() as pictures, patch.object(document, "can_set", lambda: False):
            document.save_report(plan, name, figures=True)
        out = io.StringIO()
        with columns(), contextlib.redirect_stdout(out):
            print_document(document.brief(plan))
        found[name] = {"brief": lines(out.getvalue()), "figures": numbered(pictures)}
    return found | {"page": texts("certified", ".html")}


WRITTEN: tuple[Callable[[], Any], ...] = (written_units, written_externals, printed_components, reports_of_plans)
