"""``linefix key``: a new key for a file of keys."""

from __future__ import annotations

import hashlib
import secrets
from typing import Annotated

import orjson
import typer

from service.admission.grants import Role
from service.admission.key_file import parse_keys

from .errors import WrongUseError


def key(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Whose it is to be; not secret.")],
    role: Annotated[
        list[Role] | None, typer.Option(help="What it is good for; may be repeated; all by default.")
    ] = None,
    maps: Annotated[str, typer.Option(metavar="PREFIX", help="How the ids of the maps begin that it sees.")] = "",
) -> None:
    """Make a key: it goes to stderr, once, and the lines for LINEFIX_KEYS_FILE, which hold its digest, to stdout."""
    made = secrets.token_urlsafe(32)
    described = {"name": name, "sha256": hashlib.sha256(made.encode()).hexdigest(), "roles": role or list(Role)}
    if maps:
        described["maps"] = maps
    # A string or a list of them is the same in TOML as in JSON.
    lines = ["[[key]]", *(f"{field} = {orjson.dumps(value).decode()}" for field, value in described.items())]
    try:
        parse_keys("\n".join(lines))
    except ValueError:
        raise WrongUseError("a name has 1 to 64 letters; ids begin with letters, digits, dots, dashes") from None
    for line in lines:
        print(line)
    typer.echo(made, err=True)
