"""``linefix map``: maps of other tools in, maps checked, updated, drawn, stored."""

from __future__ import annotations

import typer

from ..options import PlainCommand
from .checking import check
from .importing import import_map
from .storing import draw, get, list_maps, put, remove
from .updating import update

app = typer.Typer(name="map", rich_markup_mode=None, help="Import, check, update, draw and store maps.")
NAMES = {"import": import_map, "check": check, "update": update, "draw": draw}
NAMES |= {"put": put, "list": list_maps, "get": get, "rm": remove}
for name, command in NAMES.items():
    app.command(name, cls=PlainCommand)(command)
