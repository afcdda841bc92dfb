"""``linefix map check``: doubtful parts of a map."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from .. import asking
from ..inputs import read_map_or_id
from ..logs import TfNamespace, Topic, opened, options_of, print_notes, scans_of, sent, spread
from ..options import AsJson, MapArgument, Server
from ..printing import Json, print_json, print_rows
from ..scans import read_scan

SAMPLES = 10  # of a log: ten from all over the building give more evidence than a hundred from one room


def check(
    on: MapArgument,
    scan: Annotated[
        list[str] | None, typer.Option(metavar="FILE", help="A scan file from the building; repeat for more scans.")
    ] = None,
    log: Annotated[
        Path | None, typer.Option(metavar="FILE", help=f"A log from the building; {SAMPLES} of its scans are used.")
    ] = None,
    topic: Topic = None,
    tf_namespace: TfNamespace = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Report possible errors of a map; with scans, also whether they fit better mirrored, scaled or moved."""
    scans = [read_scan(name) for name in scan or []]
    scans += [] if log is None else samples_of(log, topic, tf_namespace)
    answer = asking.check(read_map_or_id(on), scans, server)
    if as_json:
        print_json(answer)
    else:
        print_rows(check_rows(answer))


def samples_of(log: Path, topic: str | None, tf_namespace: str | None = None) -> list[Json]:
    """Return some scans of a log, spread over all of it, as a request has them; print on stderr what was made of it.

    Raises
    ------
    RefusedError
        When it cannot be read.
    """
    source = opened(log, options_of(topic, tf_namespace))
    taken = spread(list(scans_of(source)), SAMPLES)
    print_notes(source, sys.stderr)
    return [sent(replace(one, mount=None)) for one in taken]  # the mount does not matter to the map


def check_rows(found: Json) -> list[tuple[str, str]]:
    """Return the findings of a map as text for people."""
    size = found["size"]
    rows = [("size", f"{size['walls']} walls, {size['length']:.1f} m, {size['diagonal']:.1f} m across")]
    rows += [("finding", f"{one['code']}: {one['message']}") for one in found["findings"]]
    if not found["findings"]:
        rows.append(("finding", "none"))
    advice = {name: value for name, value in found["advice"].items() if value is not None}
    rows += [("advice", f'store the map with "{name}": {str(value).lower()}') for name, value in advice.items()]
    samples = found.get("samples")
    if samples is not None:
        tried = sum(one["status"] is not None for one in samples["scans"])
        rows.append(("scans", f"{samples['usable']} of {tried} usable; with the advice {samples['usable_as_advised']}"))
        if tried < len(samples["scans"]):
            rows.append(("note", f"the time limit ended the check before {len(samples['scans']) - tried} more scans"))
    elif not found["complete"]:
        rows.append(("note", "the time limit ended the check; the findings are not complete"))
    return rows
