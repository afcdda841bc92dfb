"""Requests from browsers."""

from __future__ import annotations

import pytest

from service.admission.errors import ForeignHostError, ForeignOriginError
from service.admission.origins import Origins

OPEN = Origins(("robots.example", "Linefix"), guarded=False)


def sent(**fields: str) -> list[tuple[bytes, bytes]]:
    return [(name.replace("_", "-").encode(), value.encode("latin-1")) for name, value in fields.items()]


@pytest.mark.parametrize(
    "host",
    [
        "127.0.0.1",
        "127.0.0.1:8000",
        "192.0.2.1:80",
        "[::1]",
        "[::1]:8000",
        "localhost",
        "LOCALHOST:8000",
        "localhost.",
        "robots.example",
        "robots.example:443",
        "linefix:8000",
    ],
)
def test_hosts_that_are_answered(host: str) -> None:
    OPEN.require(sent(host=host))


@pytest.mark.parametrize(
    "host",
    [
        "",
        ":8000",
        "evil.example",
        "127.0.0.1.evil.example",
        "localhost.evil.example",
        "evil.example:8000",
        "sub.robots.example",
        "robots.example.evil.example",
        "127.1",
        "0x7f000001",
        "2130706433",
        "localhost@evil.example",
        "evil.example@localhost:80:80",
        "[::1",
        "[evil]",
        "\xe9",
    ],
)
def test_hosts_that_are_not(host: str) -> None:
    with pytest.raises(ForeignHostError):
        OPEN.require(sent(host=host))


def test_no_browser_leaves_the_host_out() -> None:
    OPEN.require([])


@pytest.mark.parametrize(
    ("origin", "host"),
    [
        ("http://localhost:8000", "localhost:8000"),
        ("http://127.0.0.1", "127.0.0.1:80"),
        ("https://robots.example", "robots.example"),
        ("https://robots.example", "robots.example:443"),
        ("http://[::1]:8000", "[::1]:8000"),
    ],
)
def test_the_own_page_may_ask(origin: str, host: str) -> None:
    for site in ("same-origin", "none", "same-site"):
        OPEN.require(sent(host=host, origin=origin, sec_fetch_site=site))


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://localhost",
        "http://localhost:8001",
        "http://127.0.0.1:8000",
        "http://localhost.evil.example:8000",
        "http://localhost:8000.evil.example",
        "null",
        "",
        "file://",
        "http://[",
    ],
)
def test_pages_of_others_may_not(origin: str) -> None:
    with pytest.raises(ForeignOriginError):
        OPEN.require(sent(host="localhost:8000", origin=origin))


def test_what_a_browser_calls_cross_site_is_refused() -> None:
    for site in ("cross-site", "Cross-Site "):
        with pytest.raises(ForeignOriginError):
            OPEN.require(sent(host="localhost:8000", sec_fetch_site=site))


NAMED = Origins((), guarded=False, named=("https://page.example",))


def test_the_page_of_a_named_origin_may_ask() -> None:
    for site in ("cross-site", "same-origin"):
        NAMED.require(sent(host="localhost:8000", origin="https://page.example", sec_fetch_site=site))
        with pytest.raises(ForeignOriginError):
            NAMED.require(sent(host="localhost:8000", origin="https://other.example", sec_fetch_site=site))
    with pytest.raises(ForeignHostError):
        NAMED.require(sent(host="evil.example", origin="https://page.example"))


def test_with_keys_all_may_ask() -> None:
    guarded = Origins((), guarded=True)
    guarded.require(sent(host="evil.example", origin="http://evil.example", sec_fetch_site="cross-site"))
