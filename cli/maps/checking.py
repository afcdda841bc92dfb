"""``linefix map check``: doubtful parts of a map."""

from __future__ import annotations

import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..asking import server_at
from ..contract import Json
from ..here import check as check_here
from ..inputs import read_map_or_id
from ..logs import TfNamespace, Topic, opened, options_of, print_notes, scans_of, sent, spread
from ..options import AsJson, MapArgument, Server
from ..printing import print_json, print_rows
from ..scans import read_scan

if TYPE_CHECKING:
    from formats import LoggedScan

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
    scans, logged = (
        [read_scan(name) for name in scan or []],
        [] if log is None else samples_of(log, topic, tf_namespace),
    )
    target = read_map_or_id(on)
    if server is None:
        answer = check_here(target, scans, logged)
    else:
        scans += [sent(replace(one, mount=None)) for one in logged]
        with closing(server_at(server)) as remote:
            answer = remote.check(target, {"scans": scans} if scans else None)
    if as_json:
        print_json(answer)
    else:
        print_rows(check_rows(answer))


def samples_of(log: Path, topic: str | None, tf_namespace: str | None = None) -> list[LoggedScan]:
    """Return some scans of a log, spread over all of it; print on stderr what was made of the log.

    Raises
    ------
    RefusedError
        When it cannot be read.
    """
    source = opened(log, options_of(topic, tf_namespace))
    taken = spread(list(scans_of(source)), SAMPLES)
    print_notes(source, sys.stderr)
    return taken


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
