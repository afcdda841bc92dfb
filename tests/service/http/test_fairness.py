"""One key's flood, over HTTP: it is told so, and leaves the others their share."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable

from tests.running import RunningService, client_of
from tests.service.searches import searched_a_while, searched_briefly


def test_a_flood_leaves_the_others_their_share(start_service: Callable[..., RunningService]) -> None:
    running = start_service(keys="flood,robot", searches=1, queue=8)
    body = searched_a_while()
    answers: Counter[tuple[str, int]] = Counter()
    waits: set[str | None] = set()
    lock, begun, enough = threading.Lock(), threading.Event(), threading.Event()

    def ask(key: str) -> None:
        with client_of(running.url, authorization=f"Bearer {key}") as client:
            while not enough.is_set():
                answer = client.post("/v1/associate", content=body)
                with lock:
                    if key == "robot":
                        begun.set()
                    if begun.is_set():
                        answers[key, answer.status_code] += 1
                    if answer.status_code == 429:
                        assert answer.json()["code"] == "rate_limited"
                        waits.add(answer.headers.get("retry-after"))
                    if answers["flood", 200] + answers["robot", 200] >= 30:
                        enough.set()
                if answer.status_code != 200:
                    enough.wait(0.03)  # these clients share a processor with the service

    threads = [threading.Thread(target=ask, args=(key,)) for key in ["flood"] * 20 + ["robot"] * 4]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    served = answers["flood", 200] + answers["robot", 200]
    assert answers["robot", 200] >= 0.9 * served / 2, answers
    assert answers["flood", 429] > 0
    assert waits == {"1"}
    # A key with less than its share is never sent away.
    assert answers["robot", 429] + answers["robot", 503] == 0, answers


def test_a_key_alone_has_all_of_the_service(start_service: Callable[..., RunningService]) -> None:
    running = start_service(keys="one,other", searches=2, queue=8)
    body = searched_briefly()
    answers: list[int] = []

    def ask() -> None:
        with client_of(running.url, authorization="Bearer one") as client:
            answers.append(client.post("/v1/associate", content=body).status_code)

    threads = [threading.Thread(target=ask) for _ in range(10)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert answers == [200] * 10
