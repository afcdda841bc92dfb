"""Options of several commands, options that belong together as one argument of a command, and help."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperArgument, TyperCommand


def option(help: str, metavar: str | None = None, *names: str, **more: Any) -> Any:
    """Describe an option; `names` where they are not that of the argument, `more` as `typer.Option` has it."""
    return typer.Option(*names, metavar=metavar, help=help, **more)


def flag(help: str, name: str, **more: Any) -> Any:
    """Describe an option without a value."""
    return typer.Option(name, help=help, **more)


def argument(help: str, metavar: str) -> Any:
    """Describe an argument."""
    return typer.Argument(help=help, metavar=metavar)


# Each may be left out.
File = Path | None
Number = float | None
Text = str | None
Texts = list[str] | None
A_MAP = "A map file: json, yaml of map_server, dxf, svg, geojson or csv;"
WRITE_MAP = "Write the map to this file: json, dxf, svg, geojson or csv."
LIKELY = "PROBABILITY"

MapArgument = Annotated[str, argument(f"{A_MAP} or the id of a stored map.", "MAP")]
MapsArgument = Annotated[list[str], argument(f"{A_MAP} a folder of these; or the id of a stored map.", "MAP")]
ScanArgument = Annotated[
    str, argument("A scan file: JSON with segments, points, laser or views; or a LaserScan; - reads stdin.", "SCAN")
]
Picture = Annotated[File, option("Draw the result to this PNG file.", "FILE")]
OutMap = Annotated[File, option(WRITE_MAP, "FILE")]
ORIENTED = flag("Free space lies on the left of segments, or directions have no meaning.", "--oriented/--no-oriented")
Oriented = Annotated[bool, ORIENTED]


@dataclass(frozen=True, slots=True)
class UsableOptions:
    """When an answer is usable, as options."""

    on_map: Annotated[
        float, option("Prior probability that a scan was taken on the map.", LIKELY, min=0.5, max=1.0)
    ] = 0.9
    usable_from: Annotated[float, option("Minimum probability of a usable answer.", LIKELY, min=0.5, max=0.9999)] = 0.95


@dataclass(frozen=True, slots=True)
class TopicOptions:
    """What to read of a log, as options."""

    topic: Annotated[
        Text, option("Topic of the scans; for CARMEN the kind of line. Default: that with most scans.", "TOPIC")
    ] = None
    tf_namespace: Annotated[
        Text, option("Namespace of transforms, in a bag of several robots: /robot1.", "NAMESPACE")
    ] = None
    base: Annotated[Text, option("Base frame of the robot. Default: base_link or base_footprint.", "FRAME")] = None
    odom: Annotated[
        Text, option("Topic of odometry, or frame of it in tf. Default: the frame odom, else a topic.", "SOURCE")
    ] = None


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Let each argument of a command that is a dataclass stand for options, one for each of its fields.

    typer makes an option of each argument, and has no groups.
    """
    parameters = inspect.signature(command, eval_str=True).parameters.values()
    groups: dict[str, Any] = {one.name: one.annotation for one in parameters if is_dataclass(one.annotation)}
    flat: list[Parameter] = []
    for one in parameters:
        group = groups.get(one.name)
        flat += [one] if group is None else _options_of(group)

    @wraps(command)
    def called(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group)})
        command(**values)

    called.__signature__ = Signature([one.replace(kind=Parameter.KEYWORD_ONLY) for one in flat])  # type: ignore[attr-defined]
    return called


def _options_of(group: type) -> list[Parameter]:
    """Return a parameter for each field, also for those that a dataclass inherits."""
    hints = get_type_hints(group, include_extras=True)
    return [one.replace(annotation=hints[one.name]) for one in inspect.signature(group).parameters.values()]


class PlainCommand(TyperCommand):
    """A command whose help has arguments as documents do: ``MAP... SCAN``, without braces and types of Python."""

    def __init__(self, *positional: Any, **more: Any) -> None:
        super().__init__(*positional, **more)
        for one in self.params:
            if isinstance(one, TyperArgument):
                one.display_type_rich = lambda ctx: None  # type: ignore[method-assign]

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """Return the parts of the usage line."""
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]
