"""The properties of a map in addition to its identity: its sigma, and whether directions mean anything.

The document holds them; these columns give them without reading it.
"""

from contextlib import suppress
from typing import Any

import orjson
import sqlalchemy as sa
from alembic import op

from service.maps.records import digest, seal

revision = "0003"
down_revision = "0002"
OLD = ("map_id", "revision", "sha256", "segments", "min_x", "min_y", "max_x", "max_y")


def upgrade() -> None:
    """Add the columns and seal the rows again; a row that was damaged stays so."""
    op.add_column("maps", sa.Column("sigma", sa.Float, nullable=True))
    op.add_column("maps", sa.Column("oriented", sa.Boolean, nullable=True))
    maps = sa.table("maps", *(sa.column(name) for name in (*OLD, "sigma", "oriented", "seal")))
    connection = op.get_bind()
    for row in connection.execute(sa.select(maps)).all():
        what = tuple(getattr(row, name) for name in OLD)
        if row.seal != seal(*what):
            continue
        sigma = _sigma(connection, row)
        values = {"sigma": sigma, "seal": seal(*what, sigma, None)}  # no map could say yet whether it is oriented
        connection.execute(sa.update(maps).where(maps.c.map_id == row.map_id).values(**values))


def _sigma(connection: sa.Connection, row: Any) -> float | None:
    documents = sa.table("map_documents", sa.column("map_id"), sa.column("document", sa.LargeBinary))
    query = sa.select(documents.c.document).where(documents.c.map_id == row.map_id)
    document = connection.execute(query).scalar()
    if document is None or digest(document) != row.sha256:
        return None
    with suppress(orjson.JSONDecodeError, AttributeError):
        said = orjson.loads(document).get("sigma")
        return float(said) + 0.0 if isinstance(said, int | float) else None
    return None
