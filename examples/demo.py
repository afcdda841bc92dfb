"""Start the service, post a drawn building and four scans to it, print and draw its answers, stop it.

``python -m examples.demo`` or ``make demo``.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from typing import Any

from cli.printing import compile_first
from registration import Segments
from simulation import SimulatedScan

from .building import Case, draw_cases
from .call import call
from .picture import Exhibit, draw
from .running import StartError, running_service
from .words import comparison_in_words, pose_in_words, verdict_in_words

OUT = Path("out")
PICTURE = """
   map of walls            one laser scan             pose and verdict
  +-----+   +-----+            . . . .               +-----+   +-----+
  |     |   |     |          .         .             |     |   |  R  |
  |     +---+     |    +     .    R    .      =      |     +---+     |   usable: yes or no,
  |               |          .       . .             |               |   and why
  +---------------+            . . .                 +---------------+
"""
NEXT = """Try next:
  make serve                           the service; open http://127.0.0.1:8000 and drag the robot
  .venv/bin/python examples/call.py    one request to it, from Python
  docs/tutorials/map-and-log.md        your own map and log"""


def main() -> int:
    """Run the demo; the status is 1 when a verdict is not the honest one."""
    print(PICTURE, flush=True)
    compile_first()
    building, cases = draw_cases()
    begun = time.monotonic()
    with running_service() as (url, pid):
        print(f"ready at {url} after {time.monotonic() - begun:.1f} s, process {pid}\n")
        stored = call(url, "PUT", "/v1/maps/demo", {"segments": building.endpoints.tolist(), "frame_id": "building"})
        print(f"PUT /v1/maps/demo: {stored['segment_count']} segments, revision {stored['revision']}\n")
        exhibits = [ask(url, case) for case in cases]
    print(f"picture of the four answers: {_picture(building, exhibits)}\n\n{NEXT}")
    wrong = [exhibit.case.title for exhibit in exhibits if exhibit.answer["status"] != exhibit.case.expected]
    for title in wrong:
        print(f"not the expected verdict: {title}", file=sys.stderr)
    return 1 if wrong else 0


def ask(url: str, case: Case) -> Exhibit:
    """Post a scan and print the answer next to the truth."""
    answer = call(url, "POST", "/v1/associate", {"map": {"map_id": "demo"}, "scan": as_laser(case.scan)})
    print(f"{case.title}: {answer['status']}, {'usable' if answer['usable'] else 'not usable'}")
    print(f"  in words {verdict_in_words(answer)}")
    print(f"  answer   {pose_in_words(answer['pose'])}")
    print(f"  truth    {'elsewhere' if case.truth is None else pose_in_words(case.truth)}")
    print(f"  compared {comparison_in_words(answer, case.truth)}")
    seen, matched = len(answer["segments"]), len(answer["correspondences"])
    print(f"  matched  {matched} of {seen} segments seen, in {answer['timing_ms']['total']:.1f} ms\n", flush=True)
    return Exhibit(case, answer)


def as_laser(scan: SimulatedScan) -> dict[str, Any]:
    """Return a scan as the service takes it: beams without a return are null."""
    scanner = scan.scanner
    return {
        "laser": {
            "angle_min": scanner.angle_min,
            "angle_increment": scanner.angle_increment,
            "range_max": scanner.range_max,
            "ranges": [round(r, 4) if math.isfinite(r) else None for r in scan.ranges.tolist()],
        },
        "frame_id": "laser",
    }


def _picture(building: Segments, exhibits: list[Exhibit]) -> Path:
    path = OUT / "demo.png"
    draw(building, exhibits, path)
    return path


if __name__ == "__main__":
    try:
        sys.exit(main())
    except StartError as error:
        sys.exit(f"demo: {error}")
