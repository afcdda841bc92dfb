"""Two processes on one database, and many callers at the same time."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from typing import Any

import httpx
import pytest

from linefix.documents import examples
from tests.running import RunningService, asked_again, running
from tests.service.conftest import empty_database

WRITERS = 8


class Pair:
    """Two services on one database."""

    def __init__(self, services: list[RunningService]) -> None:
        self.services = services
        self.clients = [each.client for each in services]


@pytest.fixture(scope="module", params=["sqlite", pytest.param("postgresql", marks=pytest.mark.long)])
def pair(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pair]:
    folder = tmp_path_factory.mktemp("pair")
    with ExitStack() as stack:
        url = stack.enter_context(empty_database(request.param, folder))
        services = []
        for name in ("one", "two"):
            (folder / name).mkdir()
            services.append(stack.enter_context(running(folder / name, database_url=url)))
        yield Pair(services)
        for each in services:
            assert "a defect" not in each.log()
            assert "postgres@" not in each.log()


@pytest.fixture
def url(request: pytest.FixtureRequest) -> str:
    """A map of each test's own."""
    return f"/v1/maps/{request.function.__name__}"


def at_once(calls: list[Callable[[], httpx.Response]]) -> list[httpx.Response]:
    barrier = threading.Barrier(len(calls))

    def wait_and(call: Callable[[], httpx.Response]) -> httpx.Response:
        barrier.wait()
        return call()

    with ThreadPoolExecutor(len(calls)) as threads:
        return list(threads.map(wait_and, calls))


def a_map(number: int) -> dict[str, Any]:
    return {"segments": examples.WALLS, "meta": number}


def put(client: httpx.Client, url: str, number: int, **headers: str) -> Callable[[], httpx.Response]:
    sent = {name.replace("_", "-"): value for name, value in headers.items()}
    return lambda: client.put(url, json=a_map(number), headers=sent)


def test_one_writer_wins(pair: Pair, url: str) -> None:
    def writers(**headers: str) -> list[Callable[[], httpx.Response]]:
        return [put(pair.clients[i % 2], url, i, **headers) for i in range(WRITERS)]

    revision = 0
    for _ in range(2):
        answers = at_once(writers(if_none_match="*"))
        assert sorted(answer.status_code for answer in answers) == [201] + [412] * (WRITERS - 1)
        for _ in range(3):
            winner = next(i for i, answer in enumerate(answers) if answer.is_success)
            revision += 1
            assert answers[winner].headers["etag"] == f'"{revision}"'
            for client in pair.clients:
                got = client.get(url)
                assert (got.json(), got.headers["etag"]) == (a_map(winner), f'"{revision}"')
            answers = at_once(writers(if_match=f'"{revision}"'))
            assert sorted(answer.status_code for answer in answers) == [200] + [412] * (WRITERS - 1)
        revision += 1
        # One deletes or one writes, and the second one gets an error.
        tag = f'"{revision}"'
        gone = [partial(client.delete, url, headers={"if-match": tag}) for client in pair.clients]
        codes = sorted(answer.status_code for answer in at_once([*gone, *writers(if_match=tag)[:2]]))
        assert codes in ([204, 412, 412, 412], [200, 412, 412, 412])
        if codes[0] == 200:
            revision += 1
            assert pair.clients[0].delete(url).status_code == 204


def test_readers_see_whole_revisions_while_others_write(pair: Pair, url: str) -> None:
    one, two = pair.clients
    assert put(one, url, 1)().status_code == 201
    numbers = itertools.count(2)

    def write() -> None:
        number = next(numbers)
        assert put(one, url, number)().json()["revision"] == number

    with asked_again(1, write):
        for _ in range(100):
            got = two.get(url)
            assert got.status_code == 200, got.text
            assert got.headers["etag"] == f'"{got.json()["meta"]}"'
