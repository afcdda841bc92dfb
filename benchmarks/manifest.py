"""The manifest of the verdict's models: from which code, data and command they come; it stands in `models.json`.

A digest covers the code that defines the features and the score, without comments and docstrings. When that code
changes, fit the models again, which writes a new manifest, or state why they still hold:

``python -m benchmarks.manifest --accept "REASON"``
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import platform
import subprocess
import sys
import tokenize
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy

import association
from association.verdict.features import Features
from association.verdict.model import FILE, MANIFEST

from .examples import Example
from .queries import DATA, data_found

ROOT = Path(association.__file__).parents[1]
MODELS_FILE = ROOT / "association" / "verdict" / FILE
UNKNOWN = "unknown"
FORMAT = 3  # of the manifest
DEFINITION = (
    "association/verdict/features.py",
    "association/verdict/alternatives.py",
    "association/verdict/null.py",
    "association/verdict/tuning.py",
    "association/consensus/tuning.py",
    "association/consensus/beams.py",
    "association/consensus/kernels/*.py",
    "association/verdict/kernels/*.py",
)
"""The code that gives the features their values, and the score that they depend on."""

_LAYOUT = (
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING,
    tokenize.ENDMARKER,
)  # fmt: skip


def digest() -> str:
    """Return a digest of the code that defines the features; comments, docstrings and line breaks do not count."""
    found = hashlib.sha256()
    for path in sorted(path for pattern in DEFINITION for path in ROOT.glob(pattern)):
        found.update(f"{path.relative_to(ROOT).as_posix()}\n{code_of(path.read_text())}\n".encode())
    return found.hexdigest()


def code_of(text: str) -> str:
    """Return the tokens of a module without comments, docstrings, line breaks and trailing commas."""
    tokens: list[str] = []
    begins = True
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in _LAYOUT:
            begins = begins or token.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
            continue
        if begins and token.type == tokenize.STRING:
            continue
        begins = False
        if token.string in (")", "]", "}") and tokens and tokens[-1] == ",":
            tokens.pop()
        tokens.append(token.string)
    return " ".join(tokens)


def manifest_of(command: str, data: dict[str, Any], metrics: dict[str, dict[str, float]]) -> dict[str, Any]:
    """Return the manifest of a fit.

    Parameters
    ----------
    command : str
        That makes the models again.
    data, metrics : dict
        By form what `data_of` returns, and the metrics of the fit; forms that were not fitted keep their part.
    """
    return {
        "format": FORMAT,
        "commit": commit(),
        "command": command,
        "seed": "none: cases are drawn by their numbers, and the fit is not random",
        "versions": {"python": platform.python_version(), "numpy": np.__version__, "scipy": scipy.__version__},
        "data": {**MANIFEST.get("data", {}), **data},
        "metrics": {**MANIFEST.get("metrics", {}), **metrics},
        "code": {"features": list(Features._fields), "digest": digest(), "at_fit": digest(), "accepted": []},
    }


def data_of(examples: Sequence[Example]) -> dict[str, Any]:
    """Return what is to be known of the answers that a fit used: counts, and a digest of features and truth."""
    used = [example for example in examples if example.told or not example.stranger]
    found = hashlib.sha256()
    for example in used:
        found.update(np.array([*example.features, example.right], np.float64).tobytes())
        found.update(np.array([example.among], np.float64).tobytes())
    away = sum(e.stranger for e in used)
    return {
        "scans_in_map": len(used) - away,
        "scans_out_of_map": away,
        "right": sum(e.right for e in used),
        "groups": dict(sorted(Counter(e.group for e in used).items())),
        "answers_sha256": found.hexdigest(),
        "files_sha256": files_sha256(),
    }


def files_sha256() -> dict[str, str]:
    """Return the digests of the data files, by their names in the data folder; nothing without it."""
    if not data_found():
        return {}
    names = [path for folder in ("floorplans", "queries", "linemaps", "lidar") for path in DATA.glob(f"{folder}/*")]
    return {path.relative_to(DATA).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(names)}


def commit() -> str:
    """Return the commit of the checkout; with ``+changes`` where files differ from it."""
    try:
        sha = _git("rev-parse", "HEAD")
        return sha + ("+changes" if _git("status", "--porcelain", "--untracked-files=no") else "")
    except (OSError, subprocess.CalledProcessError):
        return UNKNOWN


def _git(*arguments: str) -> str:
    return subprocess.run(["git", *arguments], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


def accept(reason: str) -> None:
    """Write that the models hold for the present code, and why."""
    document = json.loads(MODELS_FILE.read_text())
    code = document["manifest"]["code"]
    code["digest"] = digest()
    code["features"] = list(Features._fields)
    code["accepted"].append({"digest": digest(), "reason": reason})
    MODELS_FILE.write_text(json.dumps(document, indent=2) + "\n")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.manifest", description=__doc__)
    parser.add_argument("--accept", metavar="REASON", help="write why the present models hold for the present code")
    args = parser.parse_args()
    if args.accept:
        accept(args.accept)
        return 0
    print(json.dumps(MANIFEST, indent=2))
    if MANIFEST["code"]["digest"] == digest():
        return 0
    print("the code that defines the features differs from that of the manifest", file=sys.stderr)
    return 1


if __name__ == "__main__":
    raise SystemExit(main())
