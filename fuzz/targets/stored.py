"""What Stillhook stored itself: runs, plans, certificates, sessions, states of twins and hosts, residual models."""

from __future__ import annotations

import functools
import hashlib
import json
import math
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import stillhook
from fuzz.targets.registry import Form, Target, text
from stillhook.base.kept.checked import Kept, read_checked, write_checked
from stillhook.base.kept.sealed import EXACT, sealed
from stillhook.engine.session import Session
from stillhook.engine.store import KEY, SUFFIX, Store, Summary
from stillhook.export.hosts import Exchange, Sample
from stillhook.export.plc.block import controller_block
from stillhook.export.plc.text import structured_text, verify
from stillhook.formats.case_file import stored_cases
from stillhook.formats.lift_file import stored_lift
from stillhook.formats.results import load_run, lowerings_of, origin, stored_steps
from stillhook.library.certificate import certified_of, read_certificate
from stillhook.live.residual.model import code, content, read_model
from stillhook.live.runtime.state import LiveState
from stillhook.plan.report.document import document
from stillhook.plan.result import FACTS, NUMBERS, OF_FACTS, OF_NUMBERS, load_plan_result
from stillhook.spec.lift.stored import lowerings_text, stored_lowerings
from stillhook.validate.certificate.certificate import load_certificate

KEPT = Path(__file__).with_name("kept")
"""Results that take minutes to compute, as small as they can be."""


def _kept(name: str) -> Callable[[], Iterator[bytes]]:
    return lambda: iter(((KEPT / name).read_bytes(),))


CRANE = stillhook.load_crane("nov-250t")
CASE = stillhook.Scenario(load="100 t", s_w="100 m", tip="still", mode="ssc")


@functools.cache
def session() -> Session:
    return Session(CRANE, CASE)


@functools.cache
def state() -> bytes:
    """Of a session that has made some steps."""
    of = session()
    for _ in range(5):
        of.step({"v_op": 0.1})
    return of.save()


def _restore(data: bytes) -> None:
    state()
    session().restore(data)
    session().step({})


@functools.cache
def exchange() -> Exchange:
    of = Exchange(CRANE, CASE)
    for i in range(4):
        of.at(Sample(0.013 * i, 1.01e6, 20.0 + 0.01 * i, 0.1, 0.0), new_step=True)
    return of


def _exchange(data: bytes) -> None:
    """The body of a stored state, in an envelope that fits."""
    body = text(data)
    digest = hashlib.sha256(body.encode("utf-8", "replace")).hexdigest()
    form = json.loads(exchange().save())["format"]
    exchange().restore(json.dumps({"format": form, "sha256": digest, "body": body}))


def _exchange_seeds() -> Iterator[bytes]:
    yield json.loads(exchange().save())["body"].encode()


def _samples(data: bytes) -> None:
    """Rows of numbers that a host gives, one after another."""
    of = Exchange(CRANE, CASE)
    for i, row in enumerate(text(data).split("|")[:6]):
        try:
            numbers = [float(x) for x in row.split()]
        except ValueError:
            numbers = [math.nan]
        of.at(Sample(*(numbers + [0.0] * 5)[:5]), new_step=i % 2 == 0)


def _inputs(data: bytes) -> None:
    """Requests of a session: [verb, what, value], ...; what is not such a list asks for nothing."""
    state()
    session().restore(state())
    for verb, *given in _requests(data):
        if verb == "step":
            session().step(*given[:1])
        elif verb == "set":
            session().set(*given[:2])
        elif verb == "states":
            session().set_states(*given[:1])
        elif verb == "get":
            session().get(*given[:1])


def _requests(data: bytes) -> Iterator[list[Any]]:
    count = {"step": 1, "set": 2, "states": 1, "get": 1}
    try:
        rows = json.loads(text(data))
    except (ValueError, RecursionError):
        return
    for row in rows[:20] if isinstance(rows, list) else ():
        if isinstance(row, list) and row and isinstance(row[0], str) and len(row) > count.get(row[0], 99):
            yield row


INPUTS = (
    [
        ["step", {"v_op": 0.1}],
        ["set", "s_tip", 0.5],
        ["get", "s_w"],
        ["step", {"s_tip": 0.1, "v_tip": 0.0, "a_tip": 0.0}],
    ],
    [["set", "K_p", 0.5], ["set", "mode", "ns"], ["set", "override", 1], ["set", "u_p", 0.3], ["step", {}]],
    [["states", {"p_a": 2.0e7}], ["step", {"mode": "hs", "brake": 1.0}], ["get", "p_a"]],
)


LOWERING = stillhook.Lowering(
    payload=stillhook.read_payload("mud-mat-25t"),
    programme=[{"mode": "ahc", "time": "20 s"}],
    h_tip="36 m",
    depth="500 m",
    start_depth="50 m",
    duration="30 s",
)


FEW = ("status", "notes", "e_c_pp", "p_max", "s_w", "h_load")
"""Numbers and signals of a file of runs, which has forty of them that are read alike."""


@functools.cache
def _runs(lowering: bool) -> bytes:
    """A file of two cases, or of a lowering, as small as it can be."""
    short = CASE.model_copy(update={"duration": 40.0})
    run = stillhook.simulate(CRANE, LOWERING if lowering else [short, short])
    few = run[[name for name in run if name in FEW]].isel(time=slice(0, 20), missing_dims="ignore")
    with tempfile.TemporaryDirectory() as folder:
        return stillhook.save_run(few, Path(folder) / "run.nc").read_bytes()


def _lowerings_text() -> Iterator[bytes]:
    yield lowerings_text([LOWERING]).encode()


def _results(path: Path) -> None:
    """Everything that is asked of a file of runs before it is run again."""
    run = load_run(path)
    origin(run)
    stored_steps(run)
    stored_cases(path)


def _lowerings(path: Path) -> None:
    lowerings_of(load_run(path))
    stored_lift(path)


def _facts(path: Path) -> None:
    """The facts of a plan with hashes that fit, and its report."""
    folder = path.parent
    try:
        facts = json.loads(path.read_bytes())
        if isinstance(facts, dict):
            facts.pop(OF_FACTS, None)
            facts[OF_NUMBERS] = hashlib.sha256((folder / NUMBERS).read_bytes()).hexdigest()
            facts[OF_FACTS] = hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()
            path.write_text(json.dumps(facts), encoding="utf-8")
    except (ValueError, RecursionError):
        pass
    document(load_plan_result(folder), {})


def _certificate(path: Path) -> None:
    certified_of(read_certificate(path), path.name)
    load_certificate(path)


def _model(path: Path) -> None:
    """A residual model of this code and crane, whatever else it says."""
    try:
        data = json.loads(path.read_bytes())
        if isinstance(data, dict):
            path.write_text(sealed({**data, "code": code(), "content": content(CRANE)}, EXACT), encoding="utf-8")
    except (ValueError, RecursionError):
        pass
    read_model(path, CRANE)


def _store(path: Path) -> None:
    """A file of a store, its checksum made to fit; the store forgets it as soon as it is not there."""
    write_checked(path, path.read_bytes())
    store = Store(path.parent)
    store.find(CASES, lambda place: NUMBERS_STORED)
    path.unlink()
    store.find(CASES, lambda place: NUMBERS_STORED)


CASES, NUMBERS_STORED = [bytes([i]) * KEY for i in range(3)], ("F_w", "s_w")


def _stored() -> Iterator[bytes]:
    """Two cases as a store writes them, without their checksum."""
    with tempfile.TemporaryDirectory() as folder:
        of = [Summary(NUMBERS_STORED, "ok", [1.0, 2.0], ["note"]) for _ in CASES[:2]]
        Store(Path(folder)).put(CASES[:2], of)
        (file,) = Path(folder).glob(f"*{SUFFIX}")
        yield read_checked(file, Kept.CASES) or b""


def _block() -> Iterator[bytes]:
    yield structured_text(controller_block(CRANE, "ns")).encode()


TARGETS = (
    Target("results", Form.NETCDF, _results, "run.nc", share=0.5, seeds=lambda: iter((_runs(False),))),
    Target("lowerings", Form.NETCDF, _lowerings, "run.nc", share=0.5, seeds=lambda: iter((_runs(True),))),
    Target(
        "lowerings-text",
        Form.JSON,
        lambda d: stored_lowerings(text(d)),
        seeds=_lowerings_text,
    ),
    Target(
        "plan-facts",
        Form.JSON,
        _facts,
        FACTS,
        seeds=_kept(FACTS),
        beside={NUMBERS: (KEPT / NUMBERS).read_bytes()},
        share=2,
    ),
    Target(
        "plan-numbers",
        Form.NETCDF,
        lambda p: load_plan_result(p.parent),
        NUMBERS,
        seeds=_kept(NUMBERS),
        beside={FACTS: (KEPT / FACTS).read_bytes()},
    ),
    Target("certificate", Form.SEALED, _certificate, "certificate.json", seeds=_kept("certificate.json"), share=2),
    Target("session-state", Form.STATE, _restore, seeds=lambda: iter((state(),)), share=2),
    Target("session-inputs", Form.JSON, _inputs, seeds=lambda: (json.dumps(x).encode() for x in INPUTS), share=2),
    Target(
        "live-state",
        Form.STATE,
        LiveState.from_bytes,
        seeds=lambda: iter((LiveState(state(), {"s_tip": (0.5, 0.1)}, 3).to_bytes(),)),
    ),
    Target("exchange-state", Form.JSON, _exchange, seeds=_exchange_seeds, share=2),
    Target(
        "exchange-samples",
        Form.WORDS,
        _samples,
        seeds=lambda: iter((b"0 1e6 20 0 0|0.013 1.02e6 20.001 0.1 0.5|0.026 1.0e6 20.01 0.1 0",)),
    ),
    Target("residual-model", Form.JSON, _model, "model.json", seeds=_kept("model.json")),
    Target("store", Form.NPZ, _store, f"{'0' * KEY}{SUFFIX}", seeds=_stored),
    Target("plc-text", Form.TABLE, verify, "block.st", seeds=_block, share=0.5),
)
