"""Identification of callers: by a key, or by an address where the service has no keys.

A file of keys has their digests alone, what each may do, and which maps it sees.

::

    [[key]]
    name = "robots"
    sha256 = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"
    roles = ["associate"]
    maps = "hq-"          # how the ids of its maps begin; left out: all of them. Empty is refused

`linefix key robots` makes a key and these lines.
"""

from __future__ import annotations

import hashlib
import ipaddress
import logging
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field, SecretStr, StringConstraints, ValidationError

from ..errors import MissingKeyError, UnknownKeyError

logger = logging.getLogger("linefix")
Client = tuple[str, int] | None
Holder = bytes | None
"""Whose request it is: the digest of a key, or an address where the service has no keys; None where unknown."""


class Role(StrEnum):
    """A permission of a key; none includes another."""

    READ = "read"
    ASSOCIATE = "associate"
    WRITE = "write"


EVERY_ROLE = frozenset(Role)


@dataclass(frozen=True, slots=True)
class Grant:
    """The permissions of a caller: its roles, and the prefix of the ids of its maps. No other maps exist for it."""

    holder: Holder = None
    roles: frozenset[Role] = EVERY_ROLE
    maps: str = ""


class KeyFileError(Exception):
    """The file cannot be used; the message gives the reason, and repeats nothing of it."""


class Key(BaseModel, extra="forbid", frozen=True):
    """A key, by its digest."""

    name: str = Field(min_length=1, max_length=64)
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")]
    roles: frozenset[Role] = Field(EVERY_ROLE, min_length=1)
    maps: str = Field("", min_length=1, max_length=128, pattern="^[A-Za-z0-9._-]+$")


class _File(BaseModel, extra="forbid", frozen=True):
    key: tuple[Key, ...] = ()


def parse_keys(text: str) -> tuple[Key, ...]:
    """Return the keys that a file's text describes; raises `ValueError` where it is not as it has to be."""
    return _File.model_validate(tomllib.loads(text)).key


def read_keys(path: Path) -> dict[bytes, Grant]:
    """Return the digests of a file's keys, with what each may do; of a directory all of its files together.

    Raises
    ------
    KeyFileError
        When a file cannot be read, is no TOML, or not as described above; when it names a key twice.
    """
    keys, file = list[Key](), path
    try:
        for file in _files(path):
            keys += parse_keys(file.read_text("utf-8-sig"))
    except OSError as error:
        raise KeyFileError(f"{file}: {error.strerror}") from None
    except ValidationError as error:
        # A key in the place of its digest must not appear in a log.
        where = "; ".join(".".join(map(str, fault["loc"])) + ": " + fault["msg"] for fault in error.errors())
        raise KeyFileError(f"{file}: {where}") from None
    except ValueError:
        raise KeyFileError(f"{file}: is not TOML in UTF-8") from None
    digests = [bytes.fromhex(key.sha256) for key in keys]
    if len(set(digests)) < len(keys):
        raise KeyFileError(f"{path}: contains a key twice; remove one")
    return {digest: Grant(digest, key.roles, key.maps) for digest, key in zip(digests, keys, strict=True)}


def _contents_of(path: Path) -> list[bytes] | None:
    try:
        return [file.read_bytes() for file in _files(path)]
    except OSError:
        return None


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    return sorted(file for file in path.iterdir() if file.is_file() and not file.name.startswith("."))


class Keyring:
    """The keys that are known, as digests: those of the settings, with every permission, and those of a file.

    `file` may be a directory of them, as secrets are mounted. Without keys every caller is let in. Raises
    `KeyFileError` where the file cannot be used to begin with.
    """

    def __init__(self, keys: Sequence[SecretStr], file: Path | None = None) -> None:
        digests = [hashlib.sha256(key.get_secret_value().encode()).digest() for key in keys]
        self._whole = {digest: Grant(digest) for digest in digests}
        self._file = file
        self._seen = None if file is None else _contents_of(file)
        self.grants = self._whole if file is None else read_keys(file) | self._whole
        self.guarded = bool(keys) or file is not None

    def grant(self, headers: Iterable[tuple[bytes, bytes]], client: Client = None) -> Grant:
        """Return the permissions of a request; where the service has no keys, all, for the address it comes from.

        Raises
        ------
        MissingKeyError
            When it carries no key, or more than one.
        UnknownKeyError
            When it carries one that is not known.
        """
        if not self.guarded:
            return Grant(address_of(client))
        sent = [value for name, value in headers if name == b"authorization"]
        scheme, _, key = (sent[0] if len(sent) == 1 else b"").partition(b" ")
        key = key.strip()
        if scheme.lower() != b"bearer" or not key:
            raise MissingKeyError
        # Looked up by its digest: the time taken shows nothing of the keys.
        found = self.grants.get(hashlib.sha256(key).digest())
        if found is None:
            raise UnknownKeyError
        return found

    def refresh(self) -> None:
        """Read the file again where it has changed; what cannot be used leaves the keys as they were, and is logged."""
        if self._file is None or (contents := _contents_of(self._file)) == self._seen:
            return
        self._seen = contents
        try:
            self.grants = read_keys(self._file) | self._whole
        except KeyFileError as error:
            logger.error("the keys stay as they were: %s", error)
        else:
            logger.info("keys read", extra={"keys": len(self.grants)})


@lru_cache(maxsize=256)
def address_of(client: Client) -> Holder:
    """Return the holder of an address: of IPv6 the network, since one client has all of its addresses."""
    if client is None:
        return None
    try:
        address = ipaddress.ip_address(client[0].partition("%")[0])
    except ValueError:
        return client[0].encode()
    return (getattr(address, "ipv4_mapped", None) or address).packed[:8]
