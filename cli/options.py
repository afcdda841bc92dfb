"""Options of several commands, options that belong together as one argument of a command, and help."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperArgument, TyperCommand

DESCRIBED = "described"  # in the metadata of a field


def option(default: Any, help: str, metavar: str | None = None, *names: str, **more: Any) -> Any:
    """Return an option, as the default of an argument of a command or of a field of its groups.

    `names` where they are not that of the argument, `more` as `typer.Option` has it.
    """
    return field(default=default, metadata={DESCRIBED: required(help, metavar, *names, **more)})


def flag(help: str, name: str, default: bool | None = False, **more: Any) -> Any:
    """Return an option without a value, likewise."""
    return option(default, help, None, name, **more)


def required(help: str, metavar: str | None = None, *names: str, **more: Any) -> Any:
    """Describe an option that has no default."""
    return typer.Option(*names, metavar=metavar, help=help, **more)


def argument(help: str, metavar: str) -> Any:
    """Describe an argument."""
    return typer.Argument(help=help, metavar=metavar)


A_MAP = "A map file: json, yaml of map_server, dxf, svg, geojson or csv;"
WRITE_MAP = "Write the map to this JSON file."
LIKELY = "PROBABILITY"

MapArgument = Annotated[str, argument(f"{A_MAP} or the id of a stored map.", "MAP")]
MapsArgument = Annotated[list[str], argument(f"{A_MAP} a folder of these; or the id of a stored map.", "MAP")]
ScanArgument = Annotated[
    str, argument("A scan file: JSON with segments, points, laser or views; or a LaserScan; - reads stdin.", "SCAN")
]
DRAW_RESULT = "Draw the result to this PNG file."
ORIENTED = ("Free space lies on the left of segments, or directions have no meaning.", "--oriented/--no-oriented")


@dataclass(frozen=True, slots=True)
class UsableOptions:
    """When an answer is usable, as options."""

    on_map: float = option(0.9, "Prior probability that a scan was taken on the map.", LIKELY, min=0.5, max=1.0)
    usable_from: float = option(0.95, "Minimum probability of a usable answer.", LIKELY, min=0.5, max=0.9999)


@dataclass(frozen=True, slots=True)
class TopicOptions:
    """What to read of a log, as options."""

    topic: str | None = option(
        None, "Topic of the scans; for CARMEN the kind of line. Default: that with most scans.", "TOPIC"
    )
    tf_namespace: str | None = option(
        None, "Namespace of transforms, in a bag of several robots: /robot1.", "NAMESPACE"
    )
    base: str | None = option(None, "Base frame of the robot. Default: base_link or base_footprint.", "FRAME")
    odom: str | None = option(
        None, "Topic of odometry, or frame of it in tf. Default: the frame odom, else a topic.", "SOURCE"
    )


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Let each argument of a command that is a dataclass stand for options, one for each of its fields.

    typer makes an option of each argument, and has no groups.
    """
    flat: list[Parameter] = []
    groups: dict[str, Any] = {}
    for one in inspect.signature(command, eval_str=True).parameters.values():
        if is_dataclass(one.annotation):
            groups[one.name], hints = one.annotation, get_type_hints(one.annotation, include_extras=True)
            flat += [_parameter(each.name, hints[each.name], each) for each in fields(one.annotation)]
        else:
            flat.append(_parameter(one.name, one.annotation, one.default))

    @wraps(command)
    def called(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{each.name: values.pop(each.name) for each in fields(group)})
        command(**values)

    called.__signature__ = Signature(flat)  # type: ignore[attr-defined]
    return called


def _parameter(name: str, hint: Any, default: Any) -> Parameter:
    """Return an argument as typer takes it: with its description at its type."""
    if isinstance(default, Field):
        for described in default.metadata.values():
            hint = Annotated[hint, described]
        default = Parameter.empty if default.default is MISSING else default.default
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)


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
