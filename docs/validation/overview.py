"""The front page: numbers that follow from printed equations, the claims of every page, and the list of pages."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from blocks import HERE, table
from trials.reduced_model import simulate_reduced

from stillhook import Sine, load_crane
from stillhook.analysis.loop_stability.stability import eigenfrequency, gain_limit
from stillhook.analysis.steady.steady_state import reduction_lead, steady
from stillhook.engine.pack.winch import gains, wire_speed_max
from stillhook.library import changed

PAGE = "index.md"
CRANE = load_crane("nov-250t")
ERRATUM = changed(CRANE, {"control": {"K_1": "0.68 s/m"}})


def numbers() -> Iterator[tuple[str, str, str, str]]:
    """Rows of quantity, from where, expected, ours."""
    v, K_1, omega_0 = 60.0 * wire_speed_max(CRANE), gains(CRANE).K_1, eigenfrequency(CRANE).omega_0
    yield "highest wire speed at 1075 cm³/rev", "E tables 1, 2", "72.47127 m/min", f"{v:.5f} m/min"
    yield "ideal `K_1`, its inverse", "the same", "0.8279 s/m", f"{K_1:.4f} s/m"
    yield "eigenfrequency at full displacement", "C 9, E table 2", "12.526991 rad/s", f"{omega_0:.6f} rad/s"
    for D, expected in ((1075, "2.026039"), (645, "0.998272")):
        ours = f"{gain_limit(CRANE, D / 1075).K_p_ms:.6f} 1/m"
        yield f"`K_p` of marginal stability at {D} cm³/rev", "E figure 5", f"{expected} 1/m", ours
    s = steady(CRANE, 80.0 / 60.0, "ssc")
    yield "SSC at a steady 80 m/min: motors", "2.9, 2.10; E figure 4", "0.760498", f"{s.alpha_m:.6f}"
    yield "SSC at a steady 80 m/min: pumps", "the same", "0.839502", f"{s.u_p:.6f}"
    lead = reduction_lead(CRANE, 110.0 / 60.0, 6.0)
    yield "time to stroke the motors at 110 m/min", "E section 5.1.1", "1.1 s", f"{lead:.2f} s, for a period of 6 s"
    tip = Sine(amplitude="2.8 m", period="12 s", phase="-90 deg")
    run, printed = (simulate_reduced(crane, tip) for crane in (CRANE, ERRATUM))
    e_c, e_printed, dp = run.e_c_pp(12.0), printed.e_c_pp(12.0), run.dp_max(12.0) / 1e5
    yield "reduced model, SSC, 2.8 m and 12 s: error", "E 1 to 11", "0.0292 m", f"{e_c:.4f} m peak-to-peak"
    yield "the same: highest `p_a − p_b`", "E 1 to 11", "60.87 bar", f"{dp:.2f} bar"
    what = "the same with the printed `K_1` 0.68 s/m: error"
    yield what, "E table 2", "an erratum", f"{e_printed:.3f} m peak-to-peak"


def title(page: str) -> str:
    return (HERE / page).read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")


def claims_of(text: str) -> list[list[str]]:
    """Cells of a page's table of claims: claim, theirs, ours, verdict."""
    block = re.search(r"<!-- claims -->\n(.*?)<!-- end -->", text, flags=re.DOTALL)
    assert block is not None
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in block[1].splitlines()[2:]]


def compute(texts: Mapping[str, str]) -> dict[str, str]:
    """Blocks of the front page; text of every page with claims, by file name."""
    rows = []
    for page, text in texts.items():
        found = claims_of(text)
        links = [f"[{title(page)}]({page})"] + [""] * (len(found) - 1)
        rows += [(link, *cells) for link, cells in zip(links, found, strict=True)]
    pages = sorted(p.name for p in HERE.glob("*.md") if p.name != PAGE)
    return {
        "numbers": table(("quantity", "follows from", "expected", "ours"), numbers()),
        "claims": table(("page", "claim", "theirs", "ours", "verdict"), rows),
        "pages": "\n".join(f"- [{title(page)}]({page})" for page in pages),
    }
