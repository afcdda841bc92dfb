"""``linefix vectorize``: ranges or points to segments."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from .asking import ask
from .options import AsJson, ScanArgument, Server
from .printing import Json, print_json, print_rows, print_table, write_json
from .scans import read_scan

TAKEN = ("laser", "points", "viewpoint")  # of a scan; its frame and stamp make no difference to its segments


def vectorize(
    scan: ScanArgument,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the segments to this file, as a scan for locate.")
    ] = None,
    sigma: Annotated[
        float | None,
        typer.Option(metavar="METRES", help="Standard deviation of single ranges. Default: estimated from the scan."),
    ] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Cut ranges or points into segments; the answer is that of /v1/vectorize."""
    told = read_scan(scan)
    asked: Json = {name: told[name] for name in TAKEN if name in told}
    sigma = told.get("sigma") if sigma is None else sigma
    if sigma is not None:
        asked["options"] = {"sigma": sigma}
    answer = ask("vectorize", asked, server)
    if out is not None:
        write_json(_scan_of(told, answer), out)
    if as_json:
        print_json(answer)
        return
    columns = ("", "x1", "y1", "x2", "y2", "length", "points")
    rows = [
        (number, *segment, math.hypot(segment[2] - segment[0], segment[3] - segment[1]), points)
        for number, (segment, points) in enumerate(zip(answer["segments"], answer["point_counts"], strict=True))
    ]
    print_table(columns, rows)
    warnings = [("warning", f"{one['code']}: {one['message']}") for one in answer["warnings"]]
    print_rows([("sigma", f"{answer['sigma']:.4f} m"), *warnings])


def _scan_of(told: Json, answer: Json) -> Json:
    """Return the segments as a scan, with the frame, stamp and viewpoint of the input."""
    kept: Json = {name: told[name] for name in ("frame_id", "stamp", "viewpoint") if name in told}
    found = {name: answer[name] for name in ("segments", "point_counts", "centroids", "spreads")}
    return {**kept, **found, "sigma": answer["sigmas"]}
