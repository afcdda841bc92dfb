"""``linefix map``: maps of other tools in, maps checked, updated, drawn, stored."""

from __future__ import annotations

import typer

from .checking import check
from .importing import import_map
from .storing import draw, get, list_maps, put, remove
from .updating import update

app = typer.Typer(name="map", rich_markup_mode=None, help="Import, check, update, draw and store maps.")
app.command("import")(import_map)
for command in (check, update, draw, put):
    app.command()(command)
app.command("list")(list_maps)
app.command()(get)
app.command("rm")(remove)
