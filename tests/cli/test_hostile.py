"""Answers without end, control characters in files, text with a byte-order mark."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from linefix_client import Client, ProblemError, UnreachableError
from linefix_client import asking as requests

from cli import asking
from tests.batch.logs import ROOM
from tests.formats.bags import BEGUN, Recording
from tests.running import sending

from .running import Linefix, refused

MARK = b"\xef\xbb\xbf"


ENDLESS = b"HTTP/1.1 200 OK\r\nContent-Type: application/json\r\n\r\n"
REFUSAL = b"HTTP/1.1 503 No\r\nContent-Type: application/json\r\n\r\n"
CHUNKED = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
PIECE = b" " * 4096


@pytest.mark.parametrize(
    ("head", "piece"), [(ENDLESS, PIECE), (REFUSAL, PIECE), (CHUNKED, b"1000\r\n" + PIECE + b"\r\n")]
)
def test_an_answer_without_end_is_refused(
    linefix: Linefix, monkeypatch: pytest.MonkeyPatch, head: bytes, piece: bytes
) -> None:
    monkeypatch.setattr(requests, "MAX_ANSWER_BYTES", 2**20)
    with sending(head, piece=piece) as (url, _):
        line = refused(linefix("locate", "hall", "scan.json", "--server", url), 4)
        assert "the answer is longer than 1 MB; check the URL" in line
        with Client(url, retries=0) as client, pytest.raises(UnreachableError, match="longer than 1 MB"):
            client.version()


def test_an_answer_that_takes_for_ever_is_refused(linefix: Linefix, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(asking, "SECONDS", 0.2)
    with sending(ENDLESS, piece=b" ") as (url, _):
        line = refused(linefix("locate", "hall", "scan.json", "--server", url), 4)
        assert "the answer has not ended after 0.2 s; check the URL" in line
        with Client(url, timeout=0.2) as client, pytest.raises(UnreachableError, match=r"not ended after 0.2 s"):
            client.version()


@pytest.mark.parametrize("body", [b"<html>", b"[" * 100_000])
def test_what_is_no_json_is_no_linefix(linefix: Linefix, body: bytes) -> None:
    with sending(b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body) + body) as (url, _):
        assert "is no Linefix" in refused(linefix("locate", "hall", "scan.json", "--server", url), 4)
        with Client(url) as client, pytest.raises(UnreachableError, match="is no Linefix"):
            client.version()


@pytest.mark.parametrize("body", [b"{}", b'{"status": "ok"}', b'{"segments": 5, "maps": 3, "findings": null}'])
@pytest.mark.parametrize(
    "command",
    [
        ("locate", "hall", "scan.json"),
        ("vectorize", "points.json"),
        ("map", "list"),
        ("map", "get", "hall"),
        ("map", "put", "hall", "room.json"),
        ("map", "check", "hall"),
        ("analyze", "hall"),
    ],
)
def test_an_answer_of_another_shape_is_named(
    linefix: Linefix, folder: Path, body: bytes, command: tuple[str, ...]
) -> None:
    (folder / "points.json").write_text(json.dumps({"points": [[0.1 * k, -1.0] for k in range(20)]}))
    head = b"HTTP/1.1 200 OK\r\nConnection: close\r\nContent-Length: %d\r\n\r\n"
    with sending(head % len(body) + body) as (url, _):
        line = refused(linefix(*command, "--server", url), 4)
        assert f"the answer of {url} does not match this version of Linefix: /" in line
        assert "check the URL" in line


@pytest.mark.parametrize(
    "body", [b"{}", b"[]", b'{"errors": 5}', b'{"errors": [1, {"pointer": "/a"}]}', b'{"detail": []}', b"<html>"]
)
def test_a_refusal_of_another_shape_ends_a_command_and_is_a_problem(linefix: Linefix, body: bytes) -> None:
    head = b"HTTP/1.1 %d No\r\nConnection: close\r\nRetry-After: \xb2\r\nContent-Length: %d\r\n\r\n"
    with sending(head % (422, len(body)) + body) as (url, _):
        refused(linefix("locate", "hall", "scan.json", "--server", url), 3)
    with sending(head % (429, len(body)) + body) as (url, _), Client(url, retries=0) as client:
        with pytest.raises(ProblemError) as told:
            client.version()
        assert told.value.status == 429


def test_what_terminals_obey_is_escaped(linefix: Linefix, folder: Path) -> None:
    title = "\x9b31m\x7f\u202e\U000e0001end"
    (folder / "odd.json").write_text(json.dumps({"segments": ROOM, "meta": {"title": title}, "frame_id": title}))
    linefix.done("map", "put", "odd", "odd.json")
    told = linefix("map", "get", "odd")
    assert told.out.strip().isprintable()
    assert told.answer["meta"] == {"title": title}
    recording = Recording(folder / "a.mcap")
    recording.scans(2, f"/{title}")
    recording.scans(1, "/\x9bother")
    recording.put("/j\x9b", BEGUN, b"", "odd\x9b", "json\x9b", "odd")
    recording.done()
    for arguments in (("replay", "a.mcap", "--map", "room.json"), ("map", "import", "a.mcap")):
        ended = linefix(*arguments)
        assert (ended.out + ended.err).replace("\n", "").isprintable()


def test_a_byte_order_mark_is_passed_over(linefix: Linefix, folder: Path) -> None:
    for name in ("room.json", "scan.json"):
        (folder / name).write_bytes(MARK + (folder / name).read_bytes())
    linefix.done("locate", "room.json", "scan.json")


def test_a_description_that_stands_for_too_much_is_refused(linefix: Linefix, folder: Path) -> None:
    lines = ["a0: &a0 {k: v}"] + [f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 9)}]}}" for k in range(1, 12)]
    (folder / "map.yaml").write_text("\n".join([*lines, "image: map.pgm", "resolution: 0.05", "origin: [0, 0, 0]"]))
    assert "expected at most 100000 values" in refused(linefix("map", "import", "map.yaml"), 3)


def test_all_misspelt_names_are_listed_with_the_names_that_are_meant(linefix: Linefix, folder: Path) -> None:
    (folder / "wrong.json").write_text(json.dumps({"segmnts": ROOM, "sgima": 0.1}))
    line = refused(linefix("locate", "wrong.json", "scan.json"), 3)
    for named in (
        "wrong.json: /segments: expected this field",
        "a similar name is segments",
        "a similar name is sigma",
    ):
        assert named in line
