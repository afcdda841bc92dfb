"""One key's flood, over HTTP: it is reported so, and leaves the others their share."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable

from service.http.middleware import LATER
from tests.running import RunningService, client_of, until
from tests.service.searches import POST, searched_a_while, searched_briefly, searched_for, searching, store_hard_map


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
                    # Requests that are answered after the last counted one had no competition.
                    if begun.is_set() and not enough.is_set():
                        answers[key, answer.status_code] += 1
                    if answer.status_code == 429:
                        assert answer.json()["code"] == "rate_limited"
                        waits.add(answer.headers.get("retry-after"))
                    if answers["flood", 200] + answers["robot", 200] >= 60:
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


def test_who_keeps_others_waiting_is_told_so_a_little_later(start_service: Callable[..., RunningService]) -> None:
    """Told at once it would ask at once; one that does not wait for it is no defect."""
    running = start_service(searches=1, queue=1)
    store_hard_map(running)
    long, asked = post(searched_for(30.0)), post(searched_briefly())
    with searching(running), running.connection(source="127.0.0.2") as another:
        another.sendall(long)
        until(lambda: running.count("linefix_searches_running") == 2.0)  # the first goes on behind it
        begun = time.monotonic()
        assert running.client.post("/v1/associate", content=searched_briefly()).status_code == 429
        assert time.monotonic() - begun >= LATER
        probed = time.monotonic()
        assert running.client.get("/livez").status_code == 200
        assert time.monotonic() - probed < LATER, "on the same connection"
        for _ in range(10):
            with running.connection() as connection:
                connection.sendall(asked)
        with running.connection() as connection:
            connection.sendall(asked)
            assert connection.recv(65_536).startswith(b"HTTP/1.1 429 ")
        with running.connection() as connection:
            connection.sendall(POST + b"Transfer-Encoding: chunked\r\n\r\nno number\r\n")
            heard = b""
            while data := connection.recv(65_536):
                heard += data
            assert heard.count(b"HTTP/1.1 ") == 1
        time.sleep(2 * LATER)
    log = running.log()
    assert "a defect" not in log
    assert "Exception" not in log


def post(body: bytes) -> bytes:
    return POST + b"Content-Length: %d\r\n\r\n" % len(body) + body
