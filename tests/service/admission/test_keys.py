"""Bearer keys."""

from __future__ import annotations

import pytest
from pydantic import SecretStr

from service.admission.errors import MissingKeyError, UnknownKeyError
from service.admission.keys import Keyring

RING = Keyring([SecretStr("sesame"), SecretStr("open")])


def sent(*values: bytes) -> list[tuple[bytes, bytes]]:
    return [(b"host", b"x"), *((b"authorization", value) for value in values)]


def test_each_key_is_a_holder_of_its_own() -> None:
    sesame, opened = RING.holder(sent(b"Bearer sesame")), RING.holder(sent(b"Bearer open"))
    assert sesame is not None
    assert opened is not None
    assert sesame != opened
    for same in (b"bearer sesame", b"BEARER   sesame  "):
        assert RING.holder(sent(same)) == sesame
    # Nobody can tell the key from what is kept of it.
    assert b"sesame" not in sesame


@pytest.mark.parametrize(
    "values",
    [
        (),
        (b"",),
        (b"sesame",),
        (b"Bearer",),
        (b"Bearer ",),
        (b"Basic sesame",),
        # Which of two would count is for each server to guess: neither.
        (b"Bearer sesame", b"Bearer sesame"),
        (b"Bearer nothing", b"Bearer sesame"),
        (b"Bearer sesame", b"Basic x"),
    ],
)
def test_no_key(values: tuple[bytes, ...]) -> None:
    with pytest.raises(MissingKeyError):
        RING.holder(sent(*values))


@pytest.mark.parametrize("value", [b"Bearer sesam", b"Bearer sesame2", b"Bearer SESAME", b"Bearer sesame open"])
def test_a_key_that_is_none(value: bytes) -> None:
    with pytest.raises(UnknownKeyError):
        RING.holder(sent(value))


def test_without_keys_whoever_comes_is_nobody_in_particular() -> None:
    for values in ((), (b"Bearer sesame",), (b"x", b"y")):
        assert Keyring([]).holder(sent(*values)) is None
