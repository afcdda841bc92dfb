"""``linefix map``: maps of other tools in, maps checked, updated, drawn, stored."""

from __future__ import annotations

import typer

from .checking import check
from .drawing import draw
from .importing import import_map
from .storing import get, list_maps, put, remove
from .updating import update

app = typer.Typer(name="map", rich_markup_mode=None, help="Import, check, update, draw and store maps.")
app.command("import")(import_map)
app.command()(check)
app.command()(update)
app.command()(draw)
app.command()(put)
app.command("list")(list_maps)
app.command()(get)
app.command("rm")(remove)
