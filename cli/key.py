"""``linefix key``: a new key for a file of keys."""

from __future__ import annotations

import hashlib
import json
import secrets
from enum import StrEnum
from typing import Annotated

import typer

from .errors import WrongUseError


class Role(StrEnum):
    """A permission of a key."""

    READ = "read"
    ASSOCIATE = "associate"
    WRITE = "write"


def key(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the key, for people; not secret.")],
    role: Annotated[
        list[Role] | None,
        typer.Option(help="Role of the key; repeat for more roles. Default: all."),
    ] = None,
    maps: Annotated[
        str | None,
        typer.Option(metavar="PREFIX", help="Prefix of the ids of the maps that the key may use. Default: all maps."),
    ] = None,
) -> None:
    """Make a key and print it once, on stderr; print the lines for LINEFIX_KEYS_FILE, with its digest, on stdout."""
    from service.admission.key_file import parse_keys

    made = secrets.token_urlsafe(32)
    described = {"name": name, "sha256": hashlib.sha256(made.encode()).hexdigest(), "roles": role or list(Role)}
    if maps is not None:
        described["maps"] = maps
    # A string or a list of them is the same in TOML as in JSON.
    lines = ["[[key]]", *(f"{field} = {json.dumps(value)}" for field, value in described.items())]
    try:
        parse_keys("\n".join(lines))
    except ValueError:
        raise WrongUseError(
            f"the name {name!r} or the prefix {maps!r} is not valid: expected 1 to 64 letters for NAME, and letters, "
            "digits, dots or dashes for --maps"
        ) from None
    for line in lines:
        print(line)
    typer.echo(made, err=True)
