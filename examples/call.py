"""Ask a running service where a scan was taken; needs nothing but Python.

python examples/call.py [http://127.0.0.1:8000]; a key, where the service wants one, in LINEFIX_KEY.
"""

from __future__ import annotations

import json
import os
import sys
import urllib.error
import urllib.request
from typing import Any

# An L-shaped room, walked round counter-clockwise: free space on the left of every wall. Metres.
WALLS = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
# The same walls as a robot sees them that stands at (1, 1) and looks along the map's y axis.
SEEN = [[y1 - 1, 1 - x1, y2 - 1, 1 - x2] for x1, y1, x2, y2 in WALLS]


class RefusedError(Exception):
    """The service refused a request; the message is its own."""


def call(url: str, method: str, path: str, body: Any = None) -> dict[str, Any]:
    """Send one request and return the answer.

    Raises
    ------
    RefusedError
        With the code and the detail of the problem document.
    """
    headers = {"Content-Type": "application/json"}
    if key := os.environ.get("LINEFIX_KEY"):
        headers["Authorization"] = f"Bearer {key}"
    data = None if body is None else json.dumps(body, allow_nan=False).encode()
    request = urllib.request.Request(url.rstrip("/") + path, data, headers, method=method)
    try:
        with urllib.request.urlopen(request, timeout=60) as response:
            answer: dict[str, Any] = json.load(response)
            return answer
    except urllib.error.HTTPError as error:
        problem = json.load(error)
        raise RefusedError(f"{error.code} {problem['code']}: {problem['detail']}") from error


def main() -> None:
    """Find the robot in the room."""
    url = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8000"
    answer = call(url, "POST", "/v1/associate", {"map": {"segments": WALLS}, "scan": {"segments": SEEN, "sigma": 0.02}})
    print(f"{answer['status']}, usable: {answer['usable']}, probability {answer['probability']}")
    if answer["usable"]:  # the one thing to check before moving
        print("x {x:.3f} m, y {y:.3f} m, theta {theta:.4f} rad".format(**answer["pose"]))
    for pair in answer["correspondences"]:
        print(f"scan segment {pair['scan']} lies on map segment {pair['map']}")


if __name__ == "__main__":
    main()
