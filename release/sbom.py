"""The software bill of materials of a release, from the locks and licences.toml alone: the same bytes on every machine.

python release/sbom.py FILE    write CycloneDX 1.6 as JSON

Components are the locked packages that an installation, an extra or the tests bring, with all their hashes, licence,
and whom they are for. What checks the source or builds the documentation site is no part of an installation.
"""

from __future__ import annotations

import json
import re
import sys
import tomllib
import uuid
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
ENTRY = re.compile(r"^(?=[a-z0-9])", re.MULTILINE)
PIN = re.compile(r"([a-z0-9._-]+)==([^\s;\\]+)(?: ; ([^\\\n]+?))?(?: \\)?$", re.MULTILINE)
HASH = re.compile(r"--hash=sha256:([0-9a-f]{64})")
VIA = re.compile(r"^ +#(?: via)? +([a-z0-9._-]+)", re.MULTILINE)
LOCKS = ("requirements.lock", "tests/requirements.lock")
DEVELOPMENT = "dev"
"""The extra that runs the tests."""


class Package(NamedTuple):
    """A pinned package: name and version, environment marker or "", SHA-256 of its files, and who asks for it."""

    name: str
    version: str
    marker: str
    hashes: tuple[str, ...]
    wanted_by: frozenset[str]

    @property
    def purl(self) -> str:
        return f"pkg:pypi/{self.name}@{self.version}"


class Use(NamedTuple):
    """Whom a package is installed for: everybody (core), or the extras that bring it."""

    core: bool
    extras: tuple[str, ...]

    @property
    def text(self) -> str:
        return "core" if self.core else ", ".join(self.extras)


class Materials:
    """Locked packages of a checkout with their licences and uses."""

    def __init__(self, root: Path = ROOT) -> None:
        self.root = root

    @cached_property
    def project(self) -> dict[str, Any]:
        return dict(tomllib.loads((self.root / "pyproject.toml").read_text(encoding="utf-8"))["project"])

    @cached_property
    def version(self) -> str:
        text = (self.root / "src" / "stillhook" / "_version.py").read_text(encoding="utf-8")
        return re.findall(r'"(.+?)"', text)[-1]

    @cached_property
    def packages(self) -> tuple[Package, ...]:
        """By name, one for each version, of those that the core or an extra brings."""
        return tuple(p for p in self._locked if self.use(p) != Use(False, ()))

    @cached_property
    def _locked(self) -> tuple[Package, ...]:
        """By name, one for each version."""
        found: dict[tuple[str, str], Package] = {}
        for lock in LOCKS:
            for entry in ENTRY.split((self.root / lock).read_text(encoding="utf-8"))[1:]:
                pin = PIN.match(entry)
                if pin is None:
                    raise SystemExit(f"{lock}: {entry.splitlines()[0]!r} is not pinned. Write it with: make lock")
                name, version, marker = pin.groups()
                package = Package(
                    name, version, marker or "", tuple(HASH.findall(entry)), frozenset(VIA.findall(entry))
                )
                first = found.get((name, version), package)
                found[name, version] = first._replace(wanted_by=first.wanted_by | package.wanted_by)
        return tuple(found[key] for key in sorted(found))

    @cached_property
    def licences(self) -> dict[str, str]:
        """SPDX expression by package."""
        table = tomllib.loads((self.root / "release" / "licences.toml").read_text(encoding="utf-8"))["licences"]
        return {name: licence for licence, names in table.items() for name in names}

    def licence(self, package: Package) -> str:
        if package.name not in self.licences:
            raise SystemExit(f"release/licences.toml: {package.name} is missing. Add it under its SPDX expression.")
        return self.licences[package.name]

    def use(self, package: Package) -> Use:
        extras = {e for e, names in self._asked.items() if e and package.name in self._with_needs(names)}
        if len(extras) > 1:
            extras.discard(DEVELOPMENT)
        return Use(package.name in self._with_needs(self._asked[""]), tuple(sorted(extras)))

    @cached_property
    def _asked(self) -> dict[str, frozenset[str]]:
        """Names that the core ("") and each extra declare."""
        declared = {"": self.project["dependencies"], **self.project["optional-dependencies"]}
        return {
            extra: frozenset(re.split(r"[\[<>=!~; ]", item)[0].lower().replace("_", "-") for item in items)
            for extra, items in declared.items()
            if extra != "all"
        }

    def _with_needs(self, names: frozenset[str]) -> frozenset[str]:
        """These packages and all that they need."""
        known: frozenset[str] = frozenset()
        while known != names:
            known, names = names, names | {p.name for p in self._locked if p.wanted_by & names}
        return names

    def bill(self) -> dict[str, Any]:
        """CycloneDX. No time and no random serial number: the number follows from the content."""
        own = f"pkg:pypi/stillhook@{self.version}"
        declared = frozenset[str]().union(*self._asked.values())
        depends = {p.purl: sorted({q.purl for q in self.packages if p.name in q.wanted_by}) for p in self.packages}
        depends[own] = sorted({p.purl for p in self.packages if p.name in declared})
        bill: dict[str, Any] = {
            "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
            "bomFormat": "CycloneDX",
            "specVersion": "1.6",
            "version": 1,
            "metadata": {
                "component": {
                    "type": "application",
                    "bom-ref": own,
                    "name": "stillhook",
                    "version": self.version,
                    "description": self.project["description"],
                    "licenses": [{"license": {"id": self.project["license"]}}],
                    "purl": own,
                }
            },
            "components": [self._component(package) for package in self.packages],
            "dependencies": [{"ref": ref, "dependsOn": depends[ref]} for ref in sorted(depends)],
        }
        content = json.dumps(bill, sort_keys=True)
        return bill | {"serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, content)}"}

    def _component(self, package: Package) -> dict[str, Any]:
        use, licence = self.use(package), self.licence(package)
        facts = {"stillhook:for": use.text} | ({"stillhook:where": package.marker} if package.marker else {})
        simple = re.fullmatch(r"[\w.-]+", licence)
        return {
            "type": "library",
            "bom-ref": package.purl,
            "name": package.name,
            "version": package.version,
            "scope": "required" if use.core else "excluded" if use.extras == (DEVELOPMENT,) else "optional",
            "licenses": [{"license": {"id": licence}} if simple else {"expression": licence}],
            "purl": package.purl,
            "externalReferences": [
                {
                    "type": "distribution",
                    "url": f"https://pypi.org/project/{package.name}/{package.version}/",
                    "comment": "SHA-256 of every file of this version, one for each platform",
                    "hashes": [{"alg": "SHA-256", "content": digest} for digest in package.hashes],
                }
            ],
            "properties": [{"name": name, "value": value} for name, value in facts.items()],
        }


def main(file: Path) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(Materials().bill(), indent=1) + "\n", encoding="utf-8")
    print(file)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("python release/sbom.py FILE")
    main(Path(sys.argv[1]))
