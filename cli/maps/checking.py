"""``linefix map check``: doubtful parts of a map."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ..asking import ask
from ..inputs import read_map_or_id
from ..logs import some_scans
from ..options import AsJson, File, LogTopic, MapArgument, Server, Texts, TfNamespace, option
from ..printing import Json, print_json, print_rows
from ..scans import read_scan

if TYPE_CHECKING:
    from formats import LoggedScan

SAMPLES = 10  # of a log: ten from all over the building give more evidence than a hundred from one room


def check(
    on: MapArgument,
    scan: Annotated[Texts, option("A scan file from the building; repeat for more scans.", "FILE")] = None,
    log: Annotated[File, option(f"A log from the building; {SAMPLES} of its scans are used.", "FILE")] = None,
    topic: LogTopic = None,
    tf_namespace: TfNamespace = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Report possible errors of a map; with scans, also whether they fit better mirrored, scaled or moved."""
    scans = [read_scan(name) for name in scan or []]
    scans += [] if log is None else samples_of(log, topic, tf_namespace)
    answer = checked(read_map_or_id(on), scans, server)
    if as_json:
        print_json(answer)
    else:
        print_rows(check_rows(answer))


def checked(on: Json, scans: list[Json], server: str | None = None) -> Json:
    """Return the answer of ``/v1/maps/{map_id}:check``; without a server also for a map that is not stored."""
    return ask("check", server, on, {"scans": scans} if scans else None)


def samples_of(log: Path, topic: str | None = None, tf_namespace: str | None = None) -> list[Json]:
    """Return some scans of a log as a request has them."""
    return [of_sensor(one) for one in some_scans(log, SAMPLES, topic, tf_namespace)]


def of_sensor(one: LoggedScan) -> Json:
    """Return a scan of a log as a request has it, without its mount: it does not matter to a map."""
    from formats import scan_json

    return scan_json(replace(one, mount=None))


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
