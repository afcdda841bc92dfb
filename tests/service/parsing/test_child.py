"""Another process parses as this one would, and can be lost."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import registration
from linefix.documents.errors import BodyTooLargeError, Fault, InvalidRequestError, NotJsonError, TooManyError
from linefix.documents.parts import MapDocument
from linefix.documents.reading import read_map, read_model
from service.errors import ParserEndedError
from service.parsing.child import NICE, Child

from .bodies import LIMITS, large_map


@pytest.fixture(scope="module")
def parser() -> Iterator[Child]:
    made = Child()
    yield made
    made.close()
    assert made.pid is None


def test_searches_go_before_it(parser: Child) -> None:
    assert parser.call(os.nice, 0) == os.nice(0) + NICE


def test_what_stands_in_the_working_folder_is_not_taken_for_the_service(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a checkout, while another `linefix` is installed."""
    for package in ("service", "registration"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "__init__.py").write_text("raise SystemExit(3)")
    monkeypatch.chdir(tmp_path)
    made = Child()
    try:
        assert made.call(find_spec, "registration").origin == registration.__file__  # type: ignore[union-attr]
    finally:
        made.close()


def test_the_other_process_reads_as_this_one_does(parser: Child) -> None:
    body = large_map()
    for data in (body, bytearray(body)):
        there, here = parser.call(read_map, data, LIMITS), read_map(body, LIMITS)
        assert parser.pid not in (None, os.getpid())
        assert np.array_equal(there[0].segments, here[0].segments)
        assert there[1] == here[1]


def _raise(error: Exception) -> None:
    raise error


def test_what_is_wrong_crosses_whole(parser: Child) -> None:
    with pytest.raises(InvalidRequestError) as invalid:
        parser.call(read_model, MapDocument, b'{"segments": [[0, 0, 1]]}', LIMITS)
    assert invalid.value.faults == (Fault("/segments/0", "expected 4 numbers, found 3"),)
    for error in (TooManyError("/scans", 2, "scans"), BodyTooLargeError(7), NotJsonError("not"), ParserEndedError()):
        with pytest.raises(type(error)) as caught:
            parser.call(_raise, error)
        assert (str(caught.value), vars(caught.value)) == (str(error), vars(error))
    assert parser.call(len, b"after that it works on") == 22


def test_an_end_of_the_process_is_one_refusal(parser: Child) -> None:
    before = parser.call(os.getpid)
    with pytest.raises(ParserEndedError):
        parser.call(os._exit, 1)
    after = parser.call(os.getpid)
    assert after != before
    os.kill(after, signal.SIGKILL)
    # Found dead before the next call, or in it: then that is the one refusal.
    try:
        assert parser.call(os.getpid) != after
    except ParserEndedError:
        assert parser.call(os.getpid) != after


def test_closing_ends_what_it_works_at() -> None:
    made = Child()
    assert made.call(os.getpid) == made.call(os.getpid) == made.pid
    ended: list[BaseException] = []

    def call() -> None:
        try:
            made.call(signal.pause)
        except ParserEndedError as error:
            ended.append(error)

    waiting = threading.Thread(target=call)
    waiting.start()
    made.close()
    waiting.join(10)
    made.close()  # whether or not the call came before: nothing is left
    assert not waiting.is_alive()
    assert made.pid is None
