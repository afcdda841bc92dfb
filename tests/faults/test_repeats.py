"""The same request has the same answer to the bit: again and again, from any worker, whatever the number of threads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import numpy as np
import orjson
import pytest

from linefix.documents import examples
from simulation import Scanner
from tests.running import RunningService, client_of, until
from tests.service.asking import scanned

LASER = scanned(scanner=Scanner(beams=360, angle_increment=np.pi / 180.0, range_max=30.0))
BODIES = {
    "/v1/associate": [
        examples.ASSOCIATE,
        {
            "map": examples.ASSOCIATE["map"],
            "scan": {"laser": LASER, "sigma": 0.01},
            "options": {"exhaustive": True, "seed": 7},
        },
    ],
    "/v1/associate:batch": [examples.BATCH],
    "/v1/register": [examples.REGISTER],
    "/v1/vectorize": [{"laser": LASER}],
}


def without_times(answer: Any) -> Any:
    """Return an answer without what differs by contract."""
    if isinstance(answer, dict):
        return {name: without_times(value) for name, value in answer.items() if name not in ("request_id", "timing_ms")}
    return [without_times(item) for item in answer] if isinstance(answer, list) else answer


@pytest.mark.parametrize(
    ("repeats", "counts", "workers"), [(10, ("4",), 1), pytest.param(1000, ("1", "2", "4"), 2, marks=pytest.mark.long)]
)
def test_the_same_answer_to_the_bit(
    service: RunningService,
    start_service: Callable[..., Any],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Any,
    repeats: int,
    counts: tuple[str, ...],
    workers: int,
) -> None:
    services: list[RunningService] = [service]
    for count in counts:
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
            monkeypatch.setenv(name, count)
        folder = tmp_path / count
        folder.mkdir()
        services.append(start_service(folder, workers=workers, searches=2, queue=64))
        until(lambda: services[-1].log().count('"ready"') == workers)  # each of them may be asked

    def asked(client: httpx.Client) -> Iterator[tuple[str, bytes]]:
        for path, bodies in BODIES.items():
            for number, body in enumerate(bodies):
                answer = client.post(path, json=body)
                assert answer.status_code == 200, answer.text
                yield f"{path} {number}", orjson.dumps(without_times(answer.json()))

    def ask(turn: int) -> list[tuple[str, bytes]]:
        # A new connection each time: any worker may take it.
        with client_of(services[turn % len(services)].url) as client:
            return list(asked(client))

    with ThreadPoolExecutor(4) as threads:
        seen = Counter(pair for pairs in threads.map(ask, range(repeats)) for pair in pairs)
    kinds = {name for name, _ in seen}
    print(f"\n{repeats} repeats of {len(kinds)} requests, {workers} workers, {', '.join(counts)} threads: ", end="")
    print(f"{len(seen)} different answers")
    assert len(seen) == len(kinds) == sum(map(len, BODIES.values()))
