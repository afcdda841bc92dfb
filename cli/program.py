"""All commands, put together."""

from __future__ import annotations

from typing import Annotated

import typer
from typer.exceptions import TyperException
from typer.main import get_command

from . import maps
from .analyze import analyze
from .batch import batch
from .errors import WrongUseError
from .explain import explain
from .key import key
from .locate import locate
from .register import register
from .replay import replay
from .ros2 import ros2
from .vectorize import vectorize

# Plain help: what is printed in boxes cannot be searched or copied. Errors are one line, which `entry` prints.
app = typer.Typer(name="linefix", rich_markup_mode=None, pretty_exceptions_enable=False)
for command in (locate, explain, replay, analyze, batch, register, vectorize, key, ros2):
    app.command()(command)
app.add_typer(maps.app)


def _tell_version(asked: bool) -> None:
    if asked:
        from service.version import VERSION

        print(f"linefix {VERSION}")
        raise typer.Exit


@app.callback()
def linefix(
    version: Annotated[
        bool, typer.Option("--version", callback=_tell_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Find the pose of a robot on a map of walls from a laser scan.

    Exit codes: 0 done, whatever the verdict; 1 a defect, or a service that cannot start; 2 wrong use;
    3 rejected input; 4 no server.
    """


@app.command(
    "serve",
    add_help_option=False,
    context_settings={"allow_extra_args": True, "ignore_unknown_options": True},
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
        wrong = " ".join(error.format_message().split()).rstrip(".")
        raise WrongUseError(f"{wrong}; {path} --help lists the options") from None
    return code if isinstance(code, int) else 0
