"""An FMU as a file: libraries, source, what it was made of, its manifest; and its reference results."""

from __future__ import annotations

import html
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from stillhook import units
from stillhook.base.arrays import FloatArray
from stillhook.base.atomic import atomic_files
from stillhook.base.gateway.inputs import inputs
from stillhook.base.kept.leftovers import temporary_folder
from stillhook.engine.certificate import envelope_line, objections, twin_line
from stillhook.engine.inputs import CycleInputs
from stillhook.engine.simulate import simulate
from stillhook.export.fmu.description import SOURCE, build_description, fmi2, fmi3, osp, terminals, title
from stillhook.export.twin import PLATFORMS, Export, ExportError, check_platform, compile_library
from stillhook.export.twin.ports import MOTION
from stillhook.library import crane_toml
from stillhook.spec.crane import identity
from stillhook.trust.manifest import IN_ARCHIVE, Made, Manifest, Part
from stillhook.trust.results import own_key

FMI_VERSIONS = ("2", "3")
SOURCE_ONLY = "source"
"""Name among the platforms of the source, which every FMU holds."""
FOLDERS: Mapping[str, Mapping[str, str]] = {
    "2": {"linux64": "linux64", "win64": "win64", "macos-arm64": "darwin64"},
    "3": {"linux64": "x86_64-linux", "win64": "x86_64-windows", "macos-arm64": "aarch64-darwin"},
}
"""Folders of libraries. FMI 2 has no name for Macs with ARM processors; hosts look for theirs in darwin64."""
DATE = (1980, 1, 1, 0, 0, 0)
"""Of every member, so that the same export is the same file."""
RELATIVE = 1e-9
"""Part of a signal's largest value within which another compiler's results are those of a reference."""
HERE = Path(__file__).parent


def source_of(export: Export, fmi: str) -> str:
    """The whole C source of an FMU."""
    own = (HERE / name for name in ("instance.c", f"fmi{fmi}.c"))
    return "\n".join([export.source, *(file.read_text(encoding="utf-8") for file in own)])


def check_choice(fmi: str, platforms: Sequence[str]) -> None:
    """Errors: ExportError for an unknown version or platform, and a compiler that is absent."""
    if fmi not in FMI_VERSIONS:
        raise ExportError(f"fmi = {units.quote(fmi)}: choose {' or '.join(FMI_VERSIONS)}.")
    for platform in platforms:
        if platform != SOURCE_ONLY:
            check_platform(platform)


def write_fmu(export: Export, file: str | Path, *, fmi: str = "2", platforms: Sequence[str] = ()) -> tuple[Path, ...]:
    """Write an FMU, which holds its source and the libraries of these platforms, and next to it its interface file of
    the Open Simulation Platform. Gives the paths of both.

    Parameters: file: its name ends in .fmu; fmi: "2" or "3"; platforms: names of `PLATFORMS`, and "source".
    Errors: ExportError, one line, for an unknown version or platform, a compiler that is absent or fails, and a name
    that does not end in .fmu; SimulationError where the file cannot be written. Nothing is left half-written.
    """
    target = Path(file)
    if target.suffix != ".fmu":
        raise ExportError(f"{target.name}: the name of an FMU ends in .fmu.")
    members = fmu_members(export, fmi=fmi, platforms=platforms)
    beside = target.with_name(f"{target.stem}_OspModelDescription.xml")
    with atomic_files(target, beside) as (part, description):
        write_zip(part, members)
        description.write_text(osp(export), encoding="utf-8")
    return target, beside


def fmu_members(export: Export, *, fmi: str, platforms: Sequence[str]) -> dict[str, bytes]:
    """The members of an FMU by name."""
    check_choice(fmi, platforms)
    source = source_of(export, fmi)
    members: dict[str, str | bytes] = {
        "modelDescription.xml": fmi2(export) if fmi == "2" else fmi3(export),
        f"sources/{SOURCE}": source,
        "documentation/index.html": documentation(export),
        "resources/crane.toml": crane_toml(export.crane),
        "resources/case.json": json_text(export.case.to_dict()),
        "resources/envelope.json": json_text(validity(export)),
    }
    if fmi == "3":
        members["sources/buildDescription.xml"] = build_description(export)
        members["terminalsAndIcons/terminalsAndIcons.xml"] = terminals(export)
    if export.crane.certified is not None:
        members["resources/certificate.json"] = export.crane.certified.model_dump_json(indent=2)
    with temporary_folder("fmu") as folder:
        for platform in dict.fromkeys(p for p in platforms if p != SOURCE_ONLY):
            name = f"{export.identifier}{PLATFORMS[platform].suffix}"
            compile_library(source, platform, Path(folder) / name)
            members[f"binaries/{FOLDERS[fmi][platform]}/{name}"] = (Path(folder) / name).read_bytes()
    made = {name: text.encode() if isinstance(text, str) else text for name, text in members.items()}
    return with_manifest(made, "FMU", export)


def with_manifest(members: Mapping[str, bytes], what: str, export: Export) -> dict[str, bytes]:
    """Members of an archive with their manifest, which has a hash of every other."""
    parts = {name: Part.of(data) for name, data in members.items()}
    manifest = Manifest({Made.of(what, [identity(export.crane)], inputs()): parts}).signed(own_key())
    return {**members, IN_ARCHIVE: manifest.text().encode()}


def write_zip(file: Path, members: Mapping[str, bytes]) -> None:
    """A zip file of these members, the same bytes whenever it is written."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(members.items()):
            info = zipfile.ZipInfo(name, DATE)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            archive.writestr(info, data)


def json_text(data: Any) -> str:
    return json.dumps(data, indent=2, default=str) + "\n"


def validity(export: Export) -> dict[str, Any]:
    """For what the twin is validated [SI], nothing where its certificate does not hold; and who vouches for that."""
    crane = export.crane
    certified = crane.certified
    envelope = None if certified is None or objections(crane) else certified.envelope
    return {
        "twin": twin_line(crane),
        "signature": None if certified is None else certified.judgement.to_dict(),
        "in_words": envelope_line(crane),
        "ranges": None if envelope is None else envelope.ranges(),
        "modes": None if envelope is None else list(envelope.modes),
    }


def documentation(export: Export) -> str:
    """The page that hosts show."""
    rows = "\n".join(
        f"<tr><td>{html.escape(p.name)}</td><td>{p.causality}</td><td>{html.escape(p.unit)}</td>"
        f"<td>{html.escape(p.description)}</td></tr>"
        for p in export.ports
    )
    modes = ", ".join(f"{code} {name}" for code, name in export.modes.items())
    paragraphs = [
        f"{title(export)}. {twin_line(export.crane)}. {envelope_line(export.crane) or 'No envelope of validity.'}",
        f"A step is a whole number of PLC cycles of {export.t_cycle:g} s and begins where the last one ended; any other"
        " is refused. Hosts may multiply or add up their time. NaN and infinity are refused. What is refused changes"
        " nothing. States are checked whole before they are taken, by a checksum and by what each number may be.",
        "Numbers are SI. Tip: up positive. Speeds of wire and operator: hoisting positive. Wire out: paid out"
        f" positive. Modes: {modes}.",
        "Parameter input_time: 1 (default), inputs are those of the start of a step: the acceleration of the tip is"
        " held over the step, all else too; in a sine of 1 m and 12 s the control error is then off by 1e-7 m. 0,"
        " inputs are those of the end of a step: the tip moves on a quintic through both ends, operator's speed and"
        " tension change linearly: the run of Stillhook itself, to rounding. Commands to a winch without PLC are in"
        " force from the point at which they are set.",
        f"{IN_ARCHIVE} has the SHA-256 of every other member, and who signed: stillhook manifest FILE.fmu compares.",
    ]
    text = "\n".join(f"<p>{html.escape(p)}</p>" for p in paragraphs)
    name = html.escape(export.crane.name)
    head = f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}</title>'
    table = f"<table><tr><th>name</th><th>causality</th><th>unit</th><th>meaning</th></tr>\n{rows}\n</table>"
    return f"{head}</head><body>\n<h1>{name}</h1>\n{text}\n{table}\n</body></html>\n"


def facts(export: Export) -> dict[str, Any]:
    """What a command says of an export."""
    ports = [asdict(p) for p in export.ports]
    for port in ports:
        del port["place"]
    return {
        "crane": export.crane.name,
        "contents": export.contents,
        "coupling": export.coupling,
        "t_cycle": export.t_cycle,
        "identity": export.identity,
        "modes": export.modes,
        "variables": ports,
    }


def write_reference(export: Export, folder: str | Path) -> tuple[Path, ...]:
    """Write NAME_in.csv (motion of the tip), NAME_ref.csv (signals of `stillhook.simulate` on the export's case) and
    NAME_ref.opt. A row holds for the end of a step, `input_time` 0.

    Errors: ExportError for another export than of a whole winch coupled at the tip.
    """
    if (export.contents, export.coupling) != ("plant+controller", "tip"):
        raise ExportError("A reference is that of plant+controller with the coupling tip.")
    case, t_cycle = export.case, export.t_cycle
    if case.modes or case.operator.profile or case.operator.steps:
        raise ExportError("A reference is of a case in one mode and without an operator. Leave them out.")
    run = simulate(export.crane, case, every=f"{t_cycle!r} s", series=True)
    t = np.asarray(run["time"].values)
    drive = CycleInputs(export.crane, case)
    tip = np.array([drive.full_row(k)[:3] for k in range(len(t))])
    outputs = [p.name for p in export.ports if p.causality == "output"]
    names = [name for name in outputs if name in run and run[name].dims == ("time",)]
    base = Path(folder) / export.identifier
    files = tuple(base.with_name(f"{base.name}_{end}") for end in ("in.csv", "ref.csv", "ref.opt"))
    with atomic_files(*files) as (one, two, three):
        one.write_text(csv(t, MOTION, tip), encoding="utf-8")
        two.write_text(csv(t, names, np.column_stack([run[n].values for n in names])), encoding="utf-8")
        times = f"StartTime, 0.0\nStopTime, {float(t[-1])!r}\nStepSize, {t_cycle!r}\n"
        three.write_text(f"{times}RelTol, {RELATIVE!r}\n", encoding="utf-8")
    return files


def csv(t: FloatArray, names: object, values: FloatArray) -> str:
    """A table with its times; numbers read back to the same doubles."""
    head = ",".join(f'"{name}"' for name in ["time", *names])  # type: ignore[misc]
    rows = (",".join(repr(float(x)) for x in (time, *row)) for time, row in zip(t, values, strict=True))
    return "\n".join([head, *rows]) + "\n"
