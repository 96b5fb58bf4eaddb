"""The decision page and the limits card say what may be claimed, and nothing that may not, on one sheet each."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from tests.plan.made_up import card_of, made_up, with_synthetic_certificate

from stillhook.cli.runs.plan import _answer
from stillhook.plan.assessments.card.tip_speed import per_metre, share_of_tip
from stillhook.plan.file import LONGEST_NUMBER, LONGEST_REVISION, load_plan
from stillhook.plan.report.decision.bands import bands_of, edges_of, forecast, headline, label, open_bands, stopped
from stillhook.plan.report.decision.card import card, card_parts
from stillhook.plan.report.decision.data import decision
from stillhook.plan.report.decision.page import page, sheet, waiting_words
from stillhook.plan.report.decision.short import short
from stillhook.plan.report.detail import weather
from stillhook.plan.report.document import document, marks
from stillhook.plan.report.figures import CLAIM, claim_curves
from stillhook.plan.report.limits_summary import side_by_side, verdict, waiting
from stillhook.plan.report.words import named
from stillhook.plan.result import PlanResult, cause
from stillhook.report.document import Section, Table, Text, Verdict, walk
from stillhook.report.formatting import DAY
from stillhook.report.kit import printed
from stillhook.report.pdf import pages
from stillhook.response.forcing import forcing_of_seas
from stillhook.sea.vessel.tip import tip_response


@pytest.fixture(scope="module")
def result() -> PlanResult:
    return made_up()


def cells(limits: dict[float, tuple[float | None, float | None]]) -> list[dict]:
    """Cells of one heading: period -> limit and forecast limit."""
    by = {"phase": "deep", "rule": "winch-speed", "tier": "time", "end": ""}
    governing = {f"governing_{key}": text for key, text in by.items()} | {"beta": math.pi}
    return [
        {"T_p": T, "Hs_limit": Hs, "above": False, "alpha": None if op_wf is None else op_wf / Hs, "op_wf": op_wf}
        | governing
        for T, (Hs, op_wf) in limits.items()
    ]


def bands(limits, most=9):
    made = cells(limits)
    return bands_of(made, True, edges_of(made, most))


def test_between_two_periods_the_lower_limit_holds():
    rows = bands({5.0: (1.0, 0.7), 6.0: (2.0, 1.5), 7.0: (1.5, 1.1)})
    assert [(label(band), band["Hs_limit"]) for band in rows] == [
        ("up to 6 s", 1.0),
        ("6 to 7 s", 1.5),
        ("above 7 s", 0.0),
    ]
    assert forecast(rows[-1]) == "NO GO"  # beyond the table


def test_a_band_without_a_factor_or_without_a_result_is_no_go():
    rows = bands({5.0: (0.9, None), 6.0: (2.0, 1.5), 7.0: (1.5, 1.1), 8.0: (None, None)})
    assert [forecast(band) for band in rows] == ["NO GO", "1.10", "NO GO", "NO GO"]
    assert stopped(rows) == "up to 6 s, above 7 s"
    assert headline(rows) == "1.50 m"  # of bands with a go alone


def test_many_periods_are_bands_that_never_promise_more_than_the_table():
    limits = {4.0 + 0.5 * i: (1.0 + 0.1 * ((7 * i) % 11), 0.8) for i in range(30)}
    rows = bands(limits)
    assert len(rows) == 10
    for T, (Hs, _) in limits.items():
        inside = [b for b in rows[:-1] if (b["T_p_from"] or 0.0) <= T <= b["T_p_to"]]
        assert inside
        assert all(b["Hs_limit"] <= Hs for b in inside)


def long_names(result: PlanResult) -> PlanResult:
    """Twelve phases with the longest names, many remarks and notes, all names of the document."""
    data, facts = result.data, result.facts
    name = "Installation of the manifold template with suction anchors, north-western flank"[:80]
    phases = [{**facts["phases"][i % 6], "name": f"{i + 1} {name}"[:80]} for i in range(12)]
    document_ = dict.fromkeys(("field", "prepared_by", "checked_by"), name)
    document_ |= {"number": name[:LONGEST_NUMBER], "revision": name[:LONGEST_REVISION]}
    remarks = [cause("not-assessed", phases=[p["name"]], alternatives=["none", str(i)]) for i, p in enumerate(phases)]
    data = data.copy()
    data["governing_phase"] = data["governing_phase"].astype("<U90")
    data["governing_phase"][:] = phases[3]["name"]
    more = {"name": name, "phases": phases, "document": document_, "remarks": remarks, "notes": [f"{name}, note"] * 12}
    own = card_of(data)
    own["parts"] = [part | {"phases": [p["name"] for p in phases]} for part in own["parts"]]
    return replace(result, data=data, facts={**facts, **more, "card": own})


def assessed(*, ok: bool = True) -> dict:
    """Assessments of failure cases, rigging and quality as they come, with everything that a page has to say."""
    name = "Installation of the manifold template with suction anchors, north-western flank"[:80]
    worst = {"phase": name, "z": None, "rule": "landing-speed", "used": 1.4, "Tp": 9.0}
    bad = {"verdict": "ok" if ok else "not-ok", "worst": worst, "Hs_from": None if ok else 1.44, "rows": []}
    keys = ["ahc-trip", "wave-zone-stop", *(f"case-{i}" for i in range(8))]
    cases = [
        {"key": key, "title": f"Failure {i} of the motion unit and its signal"} | bad for i, key in enumerate(keys)
    ]
    action = {"phase": name, "top": -1475.0, "bottom": -1500.0, "action": "hoist", "time": 250.0, "to": -1475.0}
    cases[-1] |= {"verdict": "not-assessed", "reason": "no-time-allowed"}
    unknown = action | {"action": "not-assessed", "time": None, "to": None}
    page_ = {"loads_to": 2.31, "loads_highest": 4.0, "touch_down_from": 1.44, "touch_down_limit": 0.5}
    failures = {
        "cases": cases,
        "actions": [action, action | {"action": "hold", "time": 0.0, "to": None}, unknown] * 8,
        "page": page_ | {"no_stop_below": 1496.0, "clearance": 4.0},
    }
    row = {"phase": name, "static_low": 8e5, "static_high": 9.1e5, "F_top": 2.1e6, "capacity": 2.48e6}
    item = {"name": name, "utilisation": 0.83 if ok else 1.07}
    weight = {"stated": True, "net": 120e3, "contingency": 1.05, "rigging": 6e3, "added": 0.0, "SHL": 132e3}
    rigging = {
        "SHL": 132e3,
        "weight": weight | {"submerged_low": 84e3, "submerged_high": 98e3},
        "hook_loads": [row | {"capacity_basis": f"chart at 27 m, {name}", "utilisation": 0.85}] * 12,
        "legs": {"n": 4, "skew": 1.25, "DHL": 1.45e6, "T_max": 513e3, "items": [item], "worst": item},
    }
    quality = {
        "checks": [{"check": "cells", "n": 9, "failed": [] if ok else [{}]}],
        "agreement": {"phase": name, "rule": "load-motion", "tier": "frequency", "Tp": 9.0, "factor": 1.4},
        "tiers": [{"reason": "lower"}] * 2 + [{"reason": "wave-zone"}] * 5,
        "steep": {"n": 12, "of": 360},
    }
    row = dict.fromkeys(("what", "value", "where", "moves", "supplier"), name)
    assumed = {"rows": [row] * 5, "n": 12}
    source = {"source": f"{name}.csv", "model": name, "first": "2011-01-01T00", "last": "2013-12-31T23"}
    days = {"value": 11.1 * DAY, "low": 10.4 * DAY, "high": 12.8 * DAY}
    waits = {"waiting": [{"month": 0, "n_years": 3, "wait_p50": days, "wait_p90": days}]}
    hindcast = {**source, "n_years": 3, "n_gaps": 2, "synthetic": False, "window": 2.0 * DAY, **waits}
    hindcast |= {"as_credited": waits}
    return {"failures": failures, "rigging": rigging, "quality": quality, "assumed": assumed, "hindcast": hindcast}


def table_of(result: PlanResult, headings: int, periods: int) -> PlanResult:
    """The made-up result as one of so many headings and periods."""
    i, k = ([round(x) for x in np.linspace(0, n - 1, m)] for n, m in ((3, headings), (10, periods)))
    data = result.data.isel(heading=i, period=k)
    data = data.assign_coords(
        heading=np.radians(np.linspace(0.0, 345.0, headings)), period=np.linspace(4.0, 18.0, periods)
    )
    return replace(result, data=data, facts={**result.facts, "card": card_of(data)})


@pytest.mark.slow
@pytest.mark.parametrize(("headings", "periods"), [(3, 10), (24, 16), (1, 1)])
def test_the_decision_page_is_one_sheet_with_its_sections_in_order(result, headings, periods):
    one = table_of(result, headings, periods)
    assert sheets_of(one) == (1, 1)
    front = document(one, {}).front
    assert isinstance(front[0], Verdict)
    titles = [part.title[0] for part in front if isinstance(part, Section)]
    assert titles == list("1234567")


def sheets_of(result: PlanResult) -> tuple[int, int]:
    """Pages of the decision page and of the card alone, as set on paper."""
    drawn = printed({CLAIM: claim_curves(result)})
    of, about = card(result), decision(result)
    return tuple(
        len(pages(sheet(data, parts, "Stillhook", "Lift plan", marks(result)), 30.0))
        for data, parts in ((about, page(about, drawn[CLAIM])), (of, card_parts(of)))
    )


@pytest.mark.slow
def test_long_names_and_many_remarks_stay_on_one_sheet(result):
    full = long_names(result)
    assert sheets_of(full) == (1, 1)
    assert sheets_of(replace(full, facts={**full.facts, **assessed()})) == (1, 1)
    assert sheets_of(replace(full, facts={**full.facts, **assessed(ok=False)})) == (1, 1)


def test_a_plan_is_not_for_operation_while_anything_that_carries_it_is_missing(result):
    of = decision(result)["status"]
    assert not of["for_approval"]
    codes = [each["code"] for each in of["reasons"]]
    assert codes == ["synthetic-weather", "no-failures", "no-rigging", "no-quality"]
    whole = replace(made_up(synthetic=False), facts={**result.facts, **assessed()})
    assert decision(whole)["status"] == {"for_approval": True, "reasons": []}
    remark = cause("not-assessed", phases=["splash zone"], alternatives=["none"])
    odd = replace(whole, facts={**whole.facts, "remarks": [remark]})
    assert "NOT ASSESSED" in decision(odd)["status"]["reasons"][0]["text"]
    chart = [*whole.facts["inputs"], {"item": "load chart", "file": "SYNTHETIC-load-chart.csv", "sha256": "0"}]
    codes = decision(replace(whole, facts={**whole.facts, "inputs": chart}))["status"]["reasons"]
    assert [each["code"] for each in codes] == ["synthetic-chart"]


def test_what_is_not_within_limits_is_a_reason_against_operation():
    odd = replace(made_up(synthetic=False), facts={**made_up().facts, **assessed(ok=False)})
    codes = [each["code"] for each in decision(odd)["status"]["reasons"]]
    assert codes == ["failure-not-ok", "over-used", "contradicted"]
    bare = assessed()
    bare["rigging"] |= {"weight": None, "legs": None}
    of = decision(replace(odd, facts={**odd.facts, **bare}))
    assert [each["code"] for each in of["status"]["reasons"]] == ["no-weight", "no-legs"]
    line = (
        "Weight contingency and CoG not assessed (no [weight]); slings, shackles and lift points not assessed (no legs"
    )
    assert line in str(page(of, None)[0])


def test_a_hook_load_that_uses_all_of_the_capacity_at_the_limit_says_why_it_is_more_than_all(result):
    full = assessed()
    texts = []
    for used in (0.99, 1.02):
        full["rigging"]["hook_loads"][0] |= {"utilisation": used}
        texts.append(str(page(decision(replace(result, facts={**result.facts, **full})), None)))
    assert ["read between two heights of runs" in text for text in texts] == [False, True]


def test_the_claim_names_the_periods_in_which_there_is_a_go(result):
    bands = decision(result)["claim"]["bands"]
    closed = [{**band, "no_go": "no alpha"} if i in (0, 4) else band for i, band in enumerate(bands)]
    one, last = closed[4], closed[-1]
    assert open_bands(closed).split(", ") == [
        f"{closed[1]['T_p_from']:g} to {one['T_p_from']:g} s",
        f"{one['T_p_to']:g} to {last['T_p_from']:g} s",
    ]
    assert open_bands([last]) == ""


def test_the_page_says_what_happens_where_ahc_is_lost_and_the_card_what_to_do(result):
    full = replace(result, facts={**result.facts, **assessed(ok=False)})
    text = str(page(decision(full), None))
    for line in (
        "Loads are within limits to Hs 2.31 m.",
        "Touch-down over 0.50 m/s from Hs 1.44 m.",
        "No stop below 1496.0 m.",
        "submerged 84 t low, 98 t high",
        "skew load factor 1.25",
        "Methods are at most a factor of 1.40 apart in the limits that govern",
        "7 limits of phase and rule are more than 1.5 apart: the lower counts in 2, the more detailed method for a stated reason in 5",
    ):
        assert line in text
    tables = [part for part in walk(card_parts(card(full))) if isinstance(part, Table)]
    actions = next(table for table in tables if "action" in table.header)
    assert len(actions.rows) == 14
    assert list(actions.rows[0][1:]) == ["1475 m to 1500 m", "hoist to 1475 m", "250 s"]


def test_without_claimable_limits_the_page_says_so_and_is_not_for_approval(result):
    old = replace(result, facts={key: value for key, value in result.facts.items() if key != "card"})
    of = decision(old)
    assert "no-card" in [each["code"] for each in of["status"]["reasons"]]
    assert "Claimable limit: not assessed." in short(old)
    assert "Claimable limits: not assessed. Do not operate with this card." in str(card_parts(card(old)))


def test_page_one_has_no_limit_by_the_twin_alone(result):
    """The simulated limits of the made-up plan are higher than the credited ones: none of them is on the page."""
    twin = result.data["Hs_limit"].sel(credit="twin", alternative="strong-ssc").values
    credited = result.data["Hs_limit"].sel(credit="credited", alternative="strong-ssc").values
    simulated = {f"{x:.2f}" for x in twin[twin > credited + 0.01] if np.isfinite(x)} - {
        f"{x:.2f}" for x in credited.ravel()
    }
    text = str(page(decision(result), None))
    assert simulated
    assert not [x for x in simulated if f"'{x}'" in text or f" {x} m" in text]
    assert "imulated" not in text


def test_what_a_synthetic_certificate_credits_is_not_claimed():
    odd = with_synthetic_certificate()
    Hs, name = odd.data["Hs_limit"].sel(alternative="strong-ssc"), "strong-ssc"
    assert (Hs.sel(credit="credited") > Hs.sel(credit="claimable")).any()
    assert (odd.claim, made_up().claim) == ("claimable", "credited")
    assert "SYNTHETIC certificate" in short(odd)[1]
    least = f"{np.nanmin(Hs.sel(credit='claimable')):.2f}"
    assert verdict(odd).text[0].startswith(f"Claimable limit with {named(name)}: Hs {least} m to ")
    assert verdict(odd).word == verdict(made_up()).word
    assert f"{named(name)}, SYNTHETIC certificate" in [row[0] for row in side_by_side(odd).rows]
    assert not [row for row in side_by_side(made_up()).rows if "SYNTHETIC" in row[0]]
    none = [cell | {"Hs_limit": 0.5, "op_wf": None, "alpha": None} for cell in odd.facts["card"]["cells"]]
    none = replace(odd, facts={**odd.facts, "card": {**odd.facts["card"], "cells": none}})
    assert short(none)[0].startswith("NO GO IN ANY Tp BAND")


def test_the_waiting_of_the_claim_comes_first_and_that_with_the_certificate_beside_it():
    """The first is that of a plan without the certificate, in the report and on the terminal."""
    odd, less = with_synthetic_certificate(), made_up()
    claim, credited = (text.replace("claimable", "credited") for text in waiting(odd))
    assert [claim] == waiting(less)
    assert credited.startswith(
        "With this certificate if it were real (may not be claimed): Waiting for a window of 48 h"
    )
    assert credited.partition("mean")[2] != claim.partition("mean")[2]
    (both,) = waiting(odd, brief=True)
    days = [re.findall(r"P[59]0 [0-9.]+ d", text)[:2] for text in (claim, credited)]
    assert re.findall(r"P[59]0 [0-9.]+ d", both) == [*days[0], *days[1]]
    assert " ".join(_answer(odd, "x").text()).find(both[:90]) > 0
    assert [part.text for part in weather(odd, {}) if isinstance(part, Text)][1].startswith("Waiting for a window")


def test_page_one_has_the_waiting_with_its_sampling_error():
    year = {"month": 0, "n_years": 9, "wait_p50": {"value": 2.0 * DAY, "low": DAY, "high": 3.0 * DAY}}
    year["wait_p90"] = {"value": 9.0 * DAY, "low": math.nan, "high": math.nan}
    credited = {"waiting": [year | {"wait_p50": {"value": DAY, "low": math.nan, "high": math.nan}}]}
    one = {"window": 2.0 * DAY, "waiting": [year]}
    assert waiting_words(one) == ["Waiting for a window of 48 h: P50 2.0 (1.0 to 3.0) d, P90 9.0 d."]
    both = waiting_words(one | {"as_credited": credited})
    assert both == [*waiting_words(one), "With this certificate if it were real: P50 1.0 d, P90 9.0 d."]
    assert waiting_words(one | {"waiting": []}) == ["Waiting for a window of 48 h: never a window."]
    assert waiting_words(None) == waiting_words({"window": DAY, "reason": "no OP_WF"}) == []


def test_page_and_card_are_plain_data_with_revision_and_names(result):
    named_ = {"number": "SH-041", "revision": "B", "field": "Block 7", "prepared_by": "A. Hansen"}
    one = replace(result, facts={**result.facts, "document": named_})
    for of in (decision(one), card(one)):
        assert json.loads(json.dumps(of)) == of
        assert (of["document"]["number"], of["document"]["revision"]) == ("SH-041", "B")
    report = document(one, {})
    assert (report.number, report.revision, report.signatures[0]) == ("SH-041", "B", "Prepared by A. Hansen")


def test_the_card_has_a_tip_speed_only_where_it_protects(result):
    parts = {part["name"]: part["bands"] for part in card(result)["parts"]}
    assert all(band["sigma_v"] is None for band in parts["wave zone"])
    assert [band["sigma_v"] for band in parts["deep"]][:2] == pytest.approx([0.05, 0.06])  # of the lower period
    assert parts["deep"][-1]["sigma_v"] is None  # no go
    table = next(part for part in walk(card_parts(card(result))) if isinstance(part, Table))
    heads = table.heads()
    assert "landing: tip speed [m/s]" in heads
    assert not any(head.startswith("wave zone: tip") for head in heads)


def test_hold_points_are_those_of_the_phases(result):
    assert [each["point"] for each in card(result)["hold_points"]] == [
        "before lift-off",
        "before the wave zone",
        "before landing",
    ]


SIGMA = (0.013, 0.027, 0.043, 0.057, 0.069, 0.081, 0.090, 0.097, 0.101, 0.103)
"""Speed of the example's crane tip per metre of Hs at 5 s to 14 s, 195 deg [m/s]: by hand, from its RAO."""

ROUNDED = 5e-4
"""Half of the last of the three decimals with which they are printed."""


@pytest.fixture(scope="module")
def example():
    return load_plan("template-to-1500m")


def test_the_tip_of_the_example_has_the_speed_of_a_hand_calculation(example):
    rows = [row["sigma_v"] for row in per_metre(example) if math.isclose(row["beta"], math.radians(195.0))]
    assert rows == pytest.approx(SIGMA, abs=ROUNDED)
    sea = example.environment.sea(2.55, 9.0, math.radians(195.0))
    found = tip_response(example.vessel, sea, example.at.x, example.at.y).sigma_v
    assert found == pytest.approx(0.176, abs=2.55 * ROUNDED)  # 2.55 x 0.069


def test_a_tip_speed_protects_where_waves_do_not_reach_and_not_at_the_surface(example):
    sea = example.environment.sea(2.0, 9.0, math.radians(195.0))
    forcing = forcing_of_seas(sea, example.vessel, example.at.x, example.at.y, depth=example.depth)
    shares = [float(share_of_tip(forcing, z, example.depth)[0]) for z in (0.0, -10.0, -30.0, -1000.0)]
    assert shares == sorted(shares)
    assert shares[0] < 0.1
    assert shares[-1] == pytest.approx(1.0)
