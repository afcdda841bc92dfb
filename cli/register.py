"""``linefix register``: the pose where it is known which segments belong together."""

from __future__ import annotations

from typing import Annotated

import typer

from .asking import ask
from .inputs import read_json, read_map_file
from .options import AsJson, ScanArgument, Server
from .printing import Json, print_json, print_rows, verdict_rows
from .scans import read_scan


def register(
    on: Annotated[str, typer.Argument(metavar="MAP", help="A map file.")],
    scan: ScanArgument,
    pairs: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="JSON file: [[scan index, map index], ...]. Default: segment i belongs to segment i."
        ),
    ] = None,
    undirected: Annotated[
        bool, typer.Option("--undirected", help="The directions of segments have no meaning.")
    ] = False,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Find the pose from known correspondences; the answer is that of /v1/register."""
    body: Json = {"map": read_map_file(on), "scan": read_scan(scan)}
    if pairs is not None:
        body["correspondences"] = read_json(pairs)
    if undirected:
        body["options"] = {"oriented": False}
    answer = ask("register", body, server)
    if as_json:
        print_json(answer)
        return
    found = answer["diagnostics"]
    chi2 = "none" if found["chi2"] is None else f"{found['chi2']:.2f}"
    fit = f"{found['pairs']} pairs, chi2 {chi2} at {found['dof']} degrees of freedom"
    print_rows([*verdict_rows(answer), ("fit", fit)])
