"""Which connection is given up for another."""

from __future__ import annotations

import resource
import subprocess
import sys

import pytest

from service.admission.connections import RESERVED, ConnectionLimit, Use, most_connections


class Line:
    """A connection that does nothing."""

    def __init__(self, use: Use = Use.IDLE) -> None:
        self.use = use
        self.given_up = False

    def give_up(self) -> None:
        self.given_up = True


def given_up(lines: list[Line]) -> list[int]:
    return [number for number, line in enumerate(lines) if line.given_up]


def test_there_is_room_for_all_up_to_the_limit() -> None:
    for most in (6, 600):
        limit = ConnectionLimit(most)
        lines = [Line() for _ in range(most)]
        for number, line in enumerate(lines):
            assert limit.add(line, b"%d" % (number // 2))
        assert (len(limit), given_up(lines)) == (most, [])
        assert limit.add(Line(), b"new")
        assert (len(limit), given_up(lines)) == (most, [0])


def test_who_has_the_most_gives_up_what_was_not_used_for_longest() -> None:
    limit = ConnectionLimit(6)
    mine = [Line() for _ in range(3)]
    others = [Line() for _ in range(3)]
    for line in mine:
        limit.add(line, b"mine")
    for number, line in enumerate(others):
        limit.add(line, bytes([number]))
    limit.used(mine[0])
    assert limit.add(Line(), b"new")
    assert (given_up(mine), given_up(others), len(limit)) == ([1], [], 6)


def test_one_address_has_half_and_takes_from_itself() -> None:
    limit = ConnectionLimit(8)
    lines = [Line() for _ in range(20)]
    for line in lines:
        assert limit.add(line, b"one")
    assert (given_up(lines), len(limit)) == (list(range(16)), 4)
    for line in lines:
        limit.remove(line)
    assert len(limit) == 0
    assert limit.add(Line(), b"one")


def test_of_one_connection_the_newest_has_it() -> None:
    limit = ConnectionLimit(1)
    lines = [Line(), Line(Use.BUSY), Line()]
    assert [limit.add(line, b"one") for line in lines] == [True, True, False]
    assert (given_up(lines), len(limit)) == ([0], 1)


def test_the_least_useful_goes_first_and_never_what_is_at_work() -> None:
    limit = ConnectionLimit(8)
    lines = [Line(use) for use in (Use.BUSY, Use.SENDING, Use.RECEIVING, Use.IDLE)]
    for line in lines:
        limit.add(line, b"one")
    for gone in (3, 2, 1):
        assert limit.add(Line(Use.BUSY), b"one")
        assert lines[gone].given_up
    refused = Line()
    assert not limit.add(refused, b"one")
    assert (lines[0].given_up, refused.given_up, len(limit)) == (False, False, 4)
    limit.remove(refused)
    assert len(limit) == 4


def test_descriptors_are_asked_for_and_kept_for_the_rest() -> None:
    for soft, hard, wanted, found in ((64, 4096, 500, 500), (128, 256, 500, 256 - RESERVED), (64, 64, 500, 8)):
        code = (
            "import resource; from service.admission.connections import most_connections;"
            f"resource.setrlimit(resource.RLIMIT_NOFILE, ({soft}, {hard})); print(most_connections({wanted}))"
        )
        told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert int(told.stdout) == found
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    assert most_connections(10) == 10
    assert resource.getrlimit(resource.RLIMIT_NOFILE) == before


@pytest.mark.parametrize(("soft", "asked"), [(resource.RLIM_INFINITY, []), (64, [(500 + RESERVED, -1)])])
def test_a_system_that_sets_no_limit(monkeypatch: pytest.MonkeyPatch, soft: int, asked: list[tuple[int, int]]) -> None:
    """Linux always sets one, so what it says is made up here."""
    set_to: list[tuple[int, int]] = []
    monkeypatch.setattr(resource, "getrlimit", lambda _: (soft, resource.RLIM_INFINITY))
    monkeypatch.setattr(resource, "setrlimit", lambda _, limits: set_to.append(limits))
    assert most_connections(500) == 500
    assert set_to == asked
