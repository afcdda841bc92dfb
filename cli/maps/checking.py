"""``linefix map check``: doubtful parts of a map."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..asking import Where
from ..inputs import read_map_or_id, read_scan
from ..logs import some_scans
from ..options import MapArgument, TopicOptions, grouped, option
from ..printing import Json, Output, rows

if TYPE_CHECKING:
    from formats import LoggedScan

SHOWN = 3  # places of a finding
SAMPLES = 10  # of a log: ten from all over the building give more evidence than a hundred from one room


@grouped
def check(
    on: MapArgument,
    source: TopicOptions,
    where: Where,
    output: Output,
    scan: list[str] | None = option(None, "A scan file from the building; repeat for more scans.", "FILE"),
    log: Path | None = option(None, f"A log from the building; {SAMPLES} of its scans are used.", "FILE"),
) -> None:
    """Report possible errors of a map; with scans, also whether they fit better mirrored, scaled or moved."""
    scans = {f"/scans/{number}": (name, read_scan(name)) for number, name in enumerate(scan or [])}
    sent = [one for _, one in scans.values()]
    sent += [] if log is None else [of_sensor(one) for one in some_scans(log, SAMPLES, source)]
    names = {place: name for place, (name, _) in scans.items()} | {"": on, "/map": on, "/scans": str(log)}
    target = read_map_or_id(on)
    answer = where.ask("check_map", target, {"scans": sent} if sent else None, names=names)
    output.print(answer, rows(check_rows(answer, where.whole_map(target))))


def of_sensor(one: LoggedScan) -> Json:
    """Return a scan of a log as a request has it, without its mount: it does not matter to a map."""
    from formats import scan_json

    return scan_json(replace(one, mount=None))


def check_rows(found: Json, document: Json) -> Iterator[tuple[str, str]]:
    """Yield the findings of a map, whose document is given, as text for people."""
    size, samples = found["size"], found.get("samples")
    yield "size", f"{size['walls']} walls, {size['length']:.1f} m, {size['diagonal']:.1f} m across"
    for one in found["findings"]:
        walls = [document["segments"][k] for k in one["segments"][:SHOWN]]
        places = ", ".join(f"({0.5 * (x1 + x2):.1f}, {0.5 * (y1 + y2):.1f})" for x1, y1, x2, y2 in walls)
        where = f" Near {places}{' and more' * (len(one['segments']) > SHOWN)}." * bool(walls)
        yield "finding", f"{one['code']}: {one['message']}{where}"
    if not found["findings"]:
        yield "finding", "none"
    for name, value in found["advice"].items():
        if value not in (None, document.get(name, {"oriented": True}.get(name))):
            yield "advice", f'set "{name}" of the map to {str(value).lower()}'
    if samples is not None:
        tried = sum(one["status"] is not None for one in samples["scans"])
        yield "scans", f"{samples['usable']} of {tried} usable; with the advice {samples['usable_as_advised']}"
    if not found["complete"]:
        yield "note", "the time limit ended the check; the findings are not complete"
