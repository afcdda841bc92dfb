"""The tables of the map store, as the newest migration leaves them."""

from __future__ import annotations

from sqlalchemy import Boolean, Column, Float, Integer, LargeBinary, MetaData, String, Table, false

metadata = MetaData()

# Compared byte by byte whatever the database's collation, so that the order of a listing is one.
MAP_ID = String(128).with_variant(String(128, collation="C"), "postgresql")

# What a map is, short enough to be looked at before every search. A deleted map keeps its row, with an empty sha256:
# its next revision is a new number, so that an old ETag never matches a new map.
maps = Table(
    "maps",
    metadata,
    Column("map_id", MAP_ID, primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("sha256", String(64), nullable=False),
    Column("segments", Integer, nullable=False),
    Column("min_x", Float, nullable=False),
    Column("min_y", Float, nullable=False),
    Column("max_x", Float, nullable=False),
    Column("max_y", Float, nullable=False),
    Column("sigma", Float, nullable=True),
    Column("oriented", Boolean, nullable=True),
    Column("seal", String(64), nullable=False, server_default=""),
    Column("quarantined", Boolean, nullable=False, server_default=false()),
)

# The content. Id and revision stand here a second time: where damage hides a row of `maps`, this one tells.
documents = Table(
    "map_documents",
    metadata,
    Column("map_id", MAP_ID, primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("document", LargeBinary, nullable=False),
)
