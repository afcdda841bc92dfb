"""The warm-up leaves nothing to compile."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from linefix.documents import examples
from linefix.warmup import warm_up
from tests.running import until
from tests.service.asking import answered, scanned
from tests.service.http.test_answers import ANSWERS, BODIES, VIEW

SEGMENTS, AT = examples.SEEN, {"x": 1, "y": 0.5, "theta": 1}
MOMENTS = {
    "centroids": [[0.5 * (a + c), 0.5 * (b + d)] for a, b, c, d in SEGMENTS],
    "spreads": [1] * len(SEGMENTS),
    "point_counts": [20] * len(SEGMENTS),
}
FEW = {"angle_min": -math.pi, "angle_increment": math.tau / 8, "ranges": [4.0, None, 3.0, 3.5, 4.0, 3.0, 3.0, 3.5]}
STEP = {"pose": {"x": 0, "y": 0, "theta": 0}, "covariance": [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]}


def among_people() -> dict[str, Any]:
    """Return ranges in the middle of a square room, two of three cut short: most beams end on no wall."""
    laser = scanned()
    laser["ranges"] = [r if k // 10 % 3 == 0 else (0.3 + k % 7 * 0.1) * r for k, r in enumerate(laser["ranges"])]
    return laser


def requests() -> Iterator[tuple[str, dict[str, Any]]]:
    """Requests of every form that scans, priors, weights and options can take: those of other tests, and more."""
    for path, parts, _ in ANSWERS.values():
        yield path, {**BODIES[path], **parts}
    corner = [k / 40.0 for k in range(40)]  # points on walls as they are listed: a corner is cut, a wall seen twice
    walls = [[a + k * (c - a), b + k * (d - b)] for a, b, c, d in [*examples.WALLS, examples.WALLS[0]] for k in corner]
    whole, views = {"segments": SEGMENTS}, [{"laser": FEW, **STEP, "flipped": True}, {"laser": FEW, **STEP}]
    scans: list[dict[str, Any]] = [
        {**whole, **MOMENTS, "sigma": 0.02, "viewpoint": [0, 0]}, {**whole, "sigma": 0.5, "viewpoint": None},
        {"laser": FEW, "sigma": None}, {"laser": among_people()}, {"points": walls},
        {"points": [[3.0 * math.cos(k / 9.0), 3.0] for k in range(40)], "viewpoint": None},
        {"laser": {**FEW, "time_increment": 0.01}, "twist": {"vx": 1, "vy": 0, "omega": 0.5}},
        {"views": [{**VIEW}, {**whole, **STEP}, {"segments": SEGMENTS[:3], **STEP, "relative_to": 1}]},
        {"views": [{**views[0], "covariance": None}, views[1]]},
    ]  # fmt: skip
    asked: list[dict[str, Any]] = [{"scan": scan} for scan in scans]
    options = ({"oriented": False, "min_overlap": 0}, {"offset_tolerance": 0.2, "seed": 7})
    for parts in (*asked, *({"options": one} for one in options)):
        yield "/v1/associate", {**examples.ASSOCIATE, "options": {}, **parts}
    asked = [{"weighting": "uniform"}, {"weighting": "shorter_length"}, {"weights": [1, 0]}]
    asked += [{"weights": [1, 0], "correspondences": [[0, 0], [0, 1]]}]
    asked += [{"map": {**examples.REGISTER["map"], "sigma": 1}}]
    of_options: list[dict[str, Any]] = [{"evaluate_at": AT, "k_rotation": 2}, {"oriented": False}]
    asked += [{"options": {**one, "estimator": name}} for one in of_options for name in ("joint", "one_step")]
    for parts in asked:
        yield "/v1/register", {**examples.REGISTER, **parts}
    for body in ({"scans": [{**scan} for scan in scans[:6]]}, examples.CHECK):
        yield "/v1/maps/m:check", body
    for body in ({}, examples.ANALYZE):
        yield "/v1/maps/m:analyze", body


def compiled_by_requests() -> list[str]:
    """Return the kernels that requests compile, or load, in a process that was warmed up; runs in one of its own."""
    from fastapi.testclient import TestClient

    from service.app import create_app
    from service.settings import Settings

    warm_up()
    before = signatures()
    app = create_app(Settings(data_dir=sys.argv[1]))
    with TestClient(app, base_url="http://localhost") as client:
        until(lambda: client.get("/readyz").status_code == 200)
        client.put("/v1/maps/m", json=examples.MAP)
        assert client.get("/v1/maps/m:check").status_code == 200
        for path, body in requests():
            answered(client, path, body)
    return [name for name, count in signatures().items() if count != before.get(name, 0)]


def signatures() -> dict[str, int]:
    """Return how many variants of each kernel there are."""
    from numba.core.dispatcher import Dispatcher

    kernels = {
        id(kernel): kernel
        for name, module in sys.modules.items()
        if name.split(".")[0] in ("registration", "vectorization", "association", "simulation")
        for thing in vars(module).values()
        if isinstance(kernel := thing, Dispatcher)
    }
    assert kernels, "there are some"
    return {f"{k.__module__}.{k.__name__}": len(k.signatures) for k in kernels.values()}


def test_no_request_compiles_anything_after_the_warm_up(tmp_path: Path) -> None:
    script = "from tests.service.work.test_warmup import compiled_by_requests; print(compiled_by_requests())"
    run = subprocess.run([sys.executable, "-c", script, str(tmp_path)], capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr
    assert run.stdout.strip() == "[]"
