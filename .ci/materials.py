"""Bill of materials of the service (CycloneDX), and the licences of its packages.

    python .ci/materials.py [BILL [PYTHON]]    of this Python's packages into out/sbom.json, by default

Fails where there is nothing to check, where a pinned package is not installed in that version, and where one is under
the GPL or AGPL or does not say. The LGPL is let through: such a package stays one that can be exchanged.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

PINS, BILL = Path("requirements/runtime.txt"), Path("out/sbom.json")
OURS, CLIENT = "linefix", "linefix-client"
COPYLEFT = re.compile(r"(?<!L)(?<!Lesser )\b(A?GPL|(Affero )?General Public License)", re.IGNORECASE)
# Licences that are free text in the metadata of packages, which the bill leaves out.
DECLARED = {"cyclonedds": "EPL-2.0 OR BSD-3-Clause", "rich-click": "MIT"}
LESSER = re.compile(r"LGPL|Lesser General Public License", re.IGNORECASE)


class MaterialsError(Exception):
    """The packages may not be used, or it cannot be told."""


def pinned(text: str) -> dict[str, str]:
    """Return the versions of the packages that are pinned for this system."""
    whole = text.replace("\\\n", " ")  # hashes follow in lines of their own
    lines = (line.split(" --hash=")[0].strip() for line in whole.splitlines() if not line.startswith("#"))
    wanted = [
        requirement
        for requirement in map(Requirement, filter(None, lines))
        if not requirement.marker or requirement.marker.evaluate()
    ]
    return {canonicalize_name(one.name): str(one.specifier).removeprefix("==") for one in wanted}


def kept(bill: dict[str, Any], pins: dict[str, str]) -> dict[str, Any]:
    """Return a bill of the service, with no more than the pinned packages.

    Raises
    ------
    MaterialsError
        When there are none, or one is not there in its version.
    """
    components = {canonicalize_name(one["name"]): one for one in bill.get("components", [])}
    if not pins:
        raise MaterialsError("no package is pinned: nothing to check")
    wrong = [
        f"{name} {version}" for name, version in pins.items() if components.get(name, {}).get("version") != version
    ]
    if wrong:
        raise MaterialsError(f"not installed in this version: {', '.join(sorted(wrong))}; make clean, and again")
    parts = [with_licence(components[name]) for name in sorted(pins)]
    metadata = dict(bill.get("metadata", {}))
    if OURS in components:
        ours = components[OURS]
        metadata["component"] = {"type": "application", **{key: ours[key] for key in ("bom-ref", "name", "version")}}
        if CLIENT in components:
            client = {key: components[CLIENT][key] for key in ("bom-ref", "name", "version")}
            metadata["component"]["components"] = [{"type": "library", **client}]
    refs = {one["bom-ref"] for one in [*parts, metadata.get("component", parts[0])]}
    needs = [
        {**one, "dependsOn": [ref for ref in one.get("dependsOn", []) if ref in refs]}
        for one in bill.get("dependencies", [])
        if one["ref"] in refs
    ]
    return {**bill, "metadata": metadata, "components": parts, "dependencies": needs}


def with_licence(component: dict[str, Any]) -> dict[str, Any]:
    """Return a package with its licence of `DECLARED`, where the bill has none."""
    found = DECLARED.get(canonicalize_name(component["name"]))
    return component if found is None or licences(component) else {**component, "licenses": [{"expression": found}]}


def licences(component: dict[str, Any]) -> str:
    """Return what a package says of its licence, in one line."""
    said = [
        one.get("expression") or one["license"].get("id") or one["license"].get("name") or ""
        for one in component.get("licenses", [])
    ]
    short = {text.rsplit(" :: ", 1)[-1] for text in said if text and "\n" not in text}
    return "; ".join(sorted(short))


def require_licences(bill: dict[str, Any]) -> None:
    """Raise `MaterialsError` where a package may not be part of this, or does not say."""
    told = {one["name"]: licences(one) for one in bill["components"]}
    wrong = [
        f"{name}: {text or 'says nothing'}"
        for name, text in told.items()
        if not text or COPYLEFT.search(LESSER.sub("", text))
    ]
    if wrong:
        raise MaterialsError("licences that may not be part of it: " + ", ".join(wrong))


def main() -> int:
    """Write the bill and print the licences; return the exit code."""
    given = sys.argv[1:]
    path = Path(given[0]) if given else BILL
    python = given[1] if given[1:] else sys.executable
    command = [
        str(Path(sys.executable).with_name("cyclonedx-py")),
        "environment",
        "--output-reproducible",
        python,
    ]
    whole = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    try:
        bill = kept(whole, pinned(PINS.read_text()))
        require_licences(bill)
    except MaterialsError as error:
        print(f"materials: {error}", file=sys.stderr)
        return 1
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(bill, indent=1) + "\n")
    for one in bill["components"]:
        print(f"{one['name']:24}{one['version']:14}{licences(one)}")
    print(f"{len(bill['components'])} packages, none under the GPL; {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
