"""All commands, put together; and those of the service: its start and its keys."""

from __future__ import annotations

import hashlib
import json
import secrets
from typing import Annotated

import typer
from typer.exceptions import TyperException
from typer.main import get_command

from .analyze import analyze
from .batch import batch
from .errors import WrongUseError
from .maps.checking import check
from .maps.importing import import_map
from .maps.storing import draw, get, list_maps, put, remove
from .maps.updating import update
from .one_scan import explain, locate, register, vectorize
from .options import PlainCommand, argument, flag, grouped, option
from .replay import replay
from .ros2 import RosCommand, ros2

ROLES = "read, associate, write"

# Plain help: what is printed in boxes cannot be searched or copied. Errors are one line, which `entry` prints.
app = typer.Typer(name="linefix", rich_markup_mode=None, pretty_exceptions_enable=False)
maps = typer.Typer(name="map", rich_markup_mode=None, help="Import, check, update, draw and store maps.")
OF_MAPS = {"import": import_map, "check": check, "update": update, "draw": draw}
OF_MAPS |= {"put": put, "list": list_maps, "get": get, "rm": remove}


@grouped
def key(
    name: Annotated[str, argument("Name of the key, for people; not secret.", "NAME")],
    role: list[str] | None = option(None, f"Role of the key: {ROLES}; repeatable. Default: all.", "ROLE"),
    maps: str | None = option(None, "Prefix of the ids of the maps that the key may use. Default: all.", "PREFIX"),
) -> None:
    """Make a key and print it once, on stderr; print the lines for LINEFIX_KEYS_FILE, with its digest, on stdout."""
    from service.admission.keys import parse_keys

    made = secrets.token_urlsafe(32)
    described = {"name": name, "sha256": hashlib.sha256(made.encode()).hexdigest(), "roles": role or ROLES.split(", ")}
    if maps is not None:
        described["maps"] = maps
    # A string or a list of them is the same in TOML as in JSON.
    lines = "\n".join(["[[key]]", *(f"{field} = {json.dumps(value)}" for field, value in described.items())])
    try:
        parse_keys(lines)
    except ValueError:
        expected = f"expected 1 to 64 letters, some of {ROLES}, and letters, digits, dots or dashes"
        raise WrongUseError(f"found NAME {name!r}, --role {role!r} and --maps {maps!r}, {expected}") from None
    print(lines)
    typer.echo(made, err=True)


for command in (locate, explain, replay, analyze, batch, register, vectorize, key):
    app.command(cls=PlainCommand)(command)
app.command(cls=RosCommand)(ros2)
for name, command in OF_MAPS.items():
    maps.command(name, cls=PlainCommand)(command)
app.add_typer(maps)


def _print_version(asked: bool) -> None:
    if asked:
        from service.version import VERSION

        print(f"linefix {VERSION}")
        raise typer.Exit


@app.callback()
@grouped
def linefix(version: bool = flag("Print the version.", "--version", callback=_print_version, is_eager=True)) -> None:
    """Find the pose of a robot on a map of walls from a laser scan.

    Exit codes: 0 done, whatever the verdict; 1 a defect, or a service that cannot start; 2 wrong use;
    3 rejected input; 4 no server.
    """


@app.command(
    "serve", add_help_option=False, context_settings={"allow_extra_args": True, "ignore_unknown_options": True}
)
def run_service(context: typer.Context) -> None:
    """Start the HTTP service; linefix serve --help lists all settings."""
    from service.serving import serve

    raise typer.Exit(serve(context.args))


def call(arguments: list[str]) -> int:
    """Run the command that the arguments name; return its exit code.

    Raises
    ------
    CommandError
        When it cannot be done.
    """
    try:
        code = get_command(app).main(arguments or ["--help"], prog_name="linefix", standalone_mode=False)
    except typer.Abort:
        raise KeyboardInterrupt from None
    except TyperException as error:
        context = getattr(error, "ctx", None)
        path = "linefix" if context is None else context.command_path
        usage = (
            "" if context is None else " ".join(["; expected", path, *context.command.collect_usage_pieces(context)])
        )
        wrong = " ".join(error.format_message().split()).rstrip(".")
        raise WrongUseError(f"{wrong}{usage}; {path} --help lists the options") from None
    return code if isinstance(code, int) else 0
