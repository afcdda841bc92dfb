"""The warm-up leaves nothing to compile."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from typing import Any

from linefix.documents import examples
from linefix.warmup import warm_up
from tests.running import until

LASER = {"angle_min": -math.pi, "angle_increment": math.tau / 8, "ranges": [4.0, None, 3.0, 3.5, 4.0, 3.0, 3.0, 3.5]}
WALLS = examples.WALLS
SEGMENTS = examples.ASSOCIATE["scan"]["segments"]
AT = {"x": 1, "y": 0.5, "theta": 1}


def around(walls: list[list[float]]) -> list[list[float]]:
    """Return points on walls, in the order in which they are listed: a corner is cut, a wall seen twice."""
    return [[a + k / 40.0 * (c - a), b + k / 40.0 * (d - b)] for a, b, c, d in [*walls, walls[0]] for k in range(40)]


def among_people() -> dict[str, Any]:
    """Return ranges in the middle of a square room, two of three cut short: most beams end on no wall."""
    angles = [-math.pi + math.tau * k / 360 for k in range(360)]
    walls = [3.0 / max(abs(math.cos(a)), abs(math.sin(a))) for a in angles]
    ranges = [r if k // 10 % 3 == 0 else (0.3 + k % 7 * 0.1) * r for k, r in enumerate(walls)]
    return {"angle_min": -math.pi, "angle_increment": math.tau / 360, "ranges": ranges}


def views() -> list[dict[str, Any]]:
    """Scans of several views, exact and not, upside down, by segments and by ranges."""
    at: dict[str, Any] = {"pose": {"x": 0, "y": 0, "theta": 0}}
    unsure = {**at, "covariance": [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]}
    whole, part = {"segments": SEGMENTS}, {"segments": SEGMENTS[:3]}
    pairs: list[list[dict[str, Any]]] = [
        [{**whole, **at}, {**part, **at}],
        [{**whole, **at}, {**whole, **unsure}, {**part, **unsure, "relative_to": 1}],
        [{"laser": LASER, **at, "flipped": True}, {"laser": LASER, **unsure}],
    ]
    return [{"views": pair} for pair in pairs]


def associations() -> list[dict[str, Any]]:
    """Requests of every form that a scan, a prior and the options can take."""
    moments = {
        "centroids": [[0.5 * (a + c), 0.5 * (b + d)] for a, b, c, d in SEGMENTS],
        "spreads": [1] * len(SEGMENTS),
        "point_counts": [20] * len(SEGMENTS),
    }
    scans: list[dict[str, Any]] = [
        {"segments": SEGMENTS, "sigma": 0.02, **moments, "viewpoint": [0, 0]},
        {"segments": SEGMENTS, "sigma": 0.5, "viewpoint": None},
        {"segments": SEGMENTS[:1]},
        {"segments": []},
        {"laser": LASER, "sigma": None},
        {"laser": among_people()},
        {"points": [[3.0 * math.cos(k / 9.0), 3.0] for k in range(40)], "viewpoint": None},
        {"points": around(WALLS)},
        {"laser": {**LASER, "time_increment": 0.01}, "twist": {"vx": 1, "vy": 0, "omega": 0.5}},
        *views(),
    ]
    asked: list[dict[str, Any]] = [{"scan": scan} for scan in scans]
    asked += [{"prior": {**AT, "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}}]
    asked += [{"prior": {**AT, "radius": 2, "angle": 1}}]
    options = ({"oriented": False, "min_overlap": 0}, {"estimator": "one_step"}, {"offset_tolerance": 0.2, "seed": 7})
    asked += [{"options": o} for o in options]
    return [{**examples.ASSOCIATE, "options": {}, **parts} for parts in asked]


def registrations() -> list[dict[str, Any]]:
    """Requests of every form that weights and options can take."""
    scan = examples.REGISTER["scan"]
    n = len(scan["segments"])
    asked: list[dict[str, Any]] = [
        {"weighting": "uniform", "scan": {**scan, "sigma": 0}},
        {"weighting": "shorter_length"},
        {"weights": [1] * n},
        {"weights": [1] + [0] * (n - 1), "correspondences": [[0, i] for i in range(n)]},
        {"correspondences": []},
        {"map": {**examples.REGISTER["map"], "sigma": 1}},
    ]
    options: list[dict[str, Any]] = [{"evaluate_at": AT, "k_rotation": 2}, {"oriented": False}]
    asked += [{"options": {**o, "estimator": e}} for o in options for e in ("joint", "one_step")]
    return [{**examples.REGISTER, **parts} for parts in asked]


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
        samples = {"scans": [asked["scan"] for asked in associations()[:6]]}
        checks = ("/v1/maps/m:check", [samples, examples.CHECK])
        analyses = ("/v1/maps/m:analyze", [{}, examples.ANALYZE])
        for path, bodies in (("/v1/associate", associations()), ("/v1/register", registrations()), checks, analyses):
            for body in bodies:
                answer = client.post(path, json=body)
                assert answer.status_code == 200, answer.text
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
