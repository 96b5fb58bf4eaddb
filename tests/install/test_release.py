"""What is released: a bill of materials and licences that are those of the locks, and files that are the same wherever
they are built."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest
from tests.scripts import script

ROOT = Path(__file__).resolve().parents[2]
COPYLEFT = re.compile(r"GPL|MPL|EPL|CDDL|EUPL")
WEAK = re.compile(r"LGPL-[\d.]+-(only|or-later)")
PLACES = ("one", "Bau Ø 起 2")
"""Folders that a release is built in."""


@pytest.fixture(scope="module")
def sbom() -> ModuleType:
    return script(ROOT / "release" / "sbom.py")


def test_every_locked_package_is_in_the_bill_with_its_files_and_licence(sbom: ModuleType):
    bill = sbom.Materials().bill()
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    pins = set(re.findall(r"^([a-z0-9._-]+)==([^\s;]+)", lock, re.M))
    parts = {(c["name"], c["version"]): c for c in bill["components"]}
    assert pins <= parts.keys()
    assert len(parts) == len(bill["components"])
    hashes = [h["content"] for c in parts.values() for ref in c["externalReferences"] for h in ref["hashes"]]
    assert set(re.findall(r"sha256:(\w+)", lock)) <= set(hashes)
    assert all(c["licenses"] for c in parts.values())


def test_every_reference_of_the_bill_leads_to_a_component(sbom: ModuleType):
    bill = sbom.Materials().bill()
    known = {c["bom-ref"] for c in bill["components"]} | {bill["metadata"]["component"]["bom-ref"]}
    assert {d["ref"] for d in bill["dependencies"]} == known
    assert {ref for d in bill["dependencies"] for ref in d["dependsOn"]} <= known


def test_the_bill_has_the_same_bytes_in_every_process(tmp_path: Path):
    for seed in ("1", "2"):
        command = [sys.executable, str(ROOT / "release" / "sbom.py"), f"{seed}.json"]
        subprocess.run(command, cwd=tmp_path, env=os.environ | {"PYTHONHASHSEED": seed}, check=True)
    assert (tmp_path / "1.json").read_bytes() == (tmp_path / "2.json").read_bytes()


def test_the_core_holds_no_copyleft_and_extras_no_more_than_the_lgpl(sbom: ModuleType):
    materials = sbom.Materials()
    uses = {p.name: (materials.use(p), materials.licence(p)) for p in materials.packages}
    assert {name: licence for name, (use, licence) in uses.items() if use.core and COPYLEFT.search(licence)} == {}
    bound = {
        name: licence
        for name, (use, licence) in uses.items()
        if COPYLEFT.search(licence) and use.extras != (sbom.DEVELOPMENT,)
    }
    assert [name for name, licence in bound.items() if not WEAK.fullmatch(licence)] == []
    assert set(bound) == {"asammdf", "asyncua", "nptdms"}


def stated(name: str) -> str:
    """What the metadata of an installed package say of its licence; empty where nothing clear is said."""
    try:
        facts = importlib.metadata.metadata(name)
    except importlib.metadata.PackageNotFoundError:
        return ""
    if facts.get("License-Expression"):
        return str(facts["License-Expression"])
    classes = [c.rpartition(" :: ")[2] for c in facts.get_all("Classifier") or () if c.startswith("License ::")]
    return ", ".join(classes) or str(facts.get("License") or "").partition("\n")[0][:40]


FAMILIES = {"LGPL": "LGPL|Lesser", "GPL": "GPL|General Public", "MPL": "MPL|Mozilla", "MIT": "MIT", "BSD": "BSD"}
FAMILIES |= {"Apache": "Apache", "PSF": "PSF|Python Software|matplotlib", "ISC": "ISC"}


def families(licence: str) -> set[str]:
    found = {family for family, pattern in FAMILIES.items() if re.search(pattern, licence)}
    return found - {"GPL"} if "LGPL" in found else found


def test_licences_are_those_that_the_installed_packages_state(sbom: ModuleType):
    """By their families, as metadata are often free text."""
    table = sbom.Materials().licences
    apart = {}
    for name, licence in table.items():
        of_metadata = stated(name)
        if families(of_metadata) and families(of_metadata) != families(licence):
            apart[name] = (licence, of_metadata)
    assert apart == {}


def test_no_package_has_two_licences_and_none_is_left_over(sbom: ModuleType):
    text = (ROOT / "release" / "licences.toml").read_text(encoding="utf-8")
    names = re.findall(r'(?<=[\[\s,])"([a-z0-9-]+)"(?=[,\]])', text)
    assert [name for name, n in Counter(names).items() if n > 1] == []
    pinned = {
        name
        for lock in sbom.LOCKS
        for name in re.findall(r"^([a-z0-9._-]+)==", (ROOT / lock).read_text(encoding="utf-8"), re.M)
    }
    assert set(names) == pinned


# The same bytes


def digests(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.iterdir()) if p.is_file()}


@pytest.mark.long
def test_a_wheel_and_a_source_archive_have_the_same_bytes_wherever_they_are_built(tmp_path: Path):
    pytest.importorskip("hatchling", reason="hatchling is not installed: nothing can be built")
    if not (ROOT / ".git").exists():
        pytest.skip("not a git checkout: nothing says which files belong to the repository")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    made = []
    for number, name in enumerate(PLACES):
        place = tmp_path / name
        for file in filter(None, sorted(listed.split("\0"), reverse=bool(number))):
            if (ROOT / file).is_file():
                (place / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(ROOT / file, place / file)
        environment = os.environ | {"STILLHOOK_WHEEL": "pure", "PYTHONHASHSEED": str(number), "TZ": f"UTC+{number}"}
        build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-t", "sdist"]
        subprocess.run(build, cwd=place, env=environment, capture_output=True, check=True)
        made.append(digests(place / "dist"))
    assert len(made[0]) == 2
    assert made[0] == made[1]


@pytest.mark.thorough
def test_kernels_have_the_same_bytes_wherever_they_are_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Two kernels for every platform that a wheel holds; no library names a folder of its build."""
    pytest.importorskip("ziglang", reason="Zig is not installed (extra native)")
    hook = script(ROOT / "hatch_build.py")
    from stillhook.identify.component import swash_fit
    from stillhook.kernels import tip_sampling
    from stillhook.kernels.c99.library import FLAGS

    sources = [entry.library.source() for entry in (tip_sampling.kernel(), swash_fit.kernel())]
    made = []
    for name in PLACES:
        place = tmp_path / name
        (place / "work").mkdir(parents=True)
        (place / "out").mkdir()
        monkeypatch.setattr(hook, "ROOT", place)
        files = [place / "work" / f"{n}.c" for n in range(len(sources))]
        for file, source in zip(files, sources, strict=True):
            file.write_text(source, encoding="utf-8")
        for target, of in hook.TARGETS.items():
            library = place / "out" / f"{target}{of.suffix}"
            hook.cross_compile(files, of, library, FLAGS)
            assert name.encode() not in library.read_bytes(), target
        made.append(digests(place / "out"))
    assert made[0] == made[1]
