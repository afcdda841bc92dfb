"""Options of several commands, and options that belong together as one argument of a command."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from inspect import Parameter, Signature
from pathlib import Path
from typing import Annotated, Any

import typer

Server = Annotated[
    str | None,
    typer.Option("--server", metavar="URL", help="Use the service at this URL; the key is read from LINEFIX_KEY."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the complete answer as JSON.")]
MapArgument = Annotated[
    str,
    typer.Argument(
        metavar="MAP",
        help="A map file: json, yaml of map_server, dxf, svg, geojson or csv; or the id of a stored map.",
    ),
]
MapsArgument = Annotated[
    list[str],
    typer.Argument(
        metavar="MAP...",
        help="A map file: json, yaml of map_server, dxf, svg, geojson or csv; a folder of these; or the id of a stored "
        "map. Several are searched together.",
    ),
]
ScanArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCAN",
        help="A scan file: JSON with segments, points, laser or views; a LaserScan "
        "message as JSON or as YAML; - reads stdin.",
    ),
]
Picture = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the result to this PNG file.")]


@dataclass(frozen=True, slots=True)
class UsableOptions:
    """When an answer is usable, as options."""

    on_map: Annotated[
        float,
        typer.Option(
            metavar="PROBABILITY",
            min=0.5,
            max=1.0,
            help="Prior probability that a scan was taken on this map, or on one of these.",
        ),
    ] = 0.9
    usable_from: Annotated[
        float,
        typer.Option(metavar="PROBABILITY", min=0.5, max=0.9999, help="Minimum probability of a usable answer."),
    ] = 0.95


def grouped(command: Callable[..., None]) -> Callable[..., None]:
    """Let each argument of a command that is a dataclass stand for options, one for each of its fields.

    typer makes an option of each argument, and has no groups.
    """
    parameters = inspect.signature(command, eval_str=True).parameters.values()
    groups: dict[str, Any] = {one.name: one.annotation for one in parameters if is_dataclass(one.annotation)}
    flat: list[Parameter] = []
    for one in parameters:
        group = groups.get(one.name)
        flat += [one] if group is None else inspect.signature(group, eval_str=True).parameters.values()

    @wraps(command)
    def called(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = group(**{field.name: values.pop(field.name) for field in fields(group)})
        command(**values)

    called.__signature__ = Signature([one.replace(kind=Parameter.KEYWORD_ONLY) for one in flat])  # type: ignore[attr-defined]
    return called
