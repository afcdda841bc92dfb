"""Documents in a table of their own, rows sealed and quarantined.

A row of `maps` is looked at before every search, and behind a document of megabytes its last columns are slow to reach.
"""

import sqlalchemy as sa
from alembic import op

from service.maps.records import seal

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Add the columns, move the documents, seal the rows; checksums stay as they are, right or wrong."""
    map_id = sa.String(128).with_variant(sa.String(128, collation="C"), "postgresql")
    op.create_table(
        "map_documents",
        sa.Column("map_id", map_id, primary_key=True),
        sa.Column("revision", sa.Integer, nullable=False),
        sa.Column("document", sa.LargeBinary, nullable=False),
    )
    op.execute(
        "INSERT INTO map_documents (map_id, revision, document) "
        "SELECT map_id, revision, document FROM maps WHERE document IS NOT NULL"
    )
    op.drop_column("maps", "document")
    op.add_column("maps", sa.Column("seal", sa.String(64), nullable=False, server_default=""))
    op.add_column("maps", sa.Column("quarantined", sa.Boolean, nullable=False, server_default=sa.false()))
    if op.get_bind().dialect.name == "postgresql":
        op.alter_column("maps", "map_id", type_=map_id)
    _seal_rows()


def _seal_rows() -> None:
    names = ("map_id", "revision", "sha256", "segments", "min_x", "min_y", "max_x", "max_y")
    maps = sa.table("maps", *(sa.column(name) for name in (*names, "seal")))
    connection = op.get_bind()
    for row in connection.execute(sa.select(maps)).all():
        # SQLite does not keep the sign of zero.
        numbers = tuple(value + 0.0 for value in (row.min_x, row.min_y, row.max_x, row.max_y))
        sealed = seal(row.map_id, row.revision, row.sha256, row.segments, *numbers)
        connection.execute(sa.update(maps).where(maps.c.map_id == row.map_id).values(seal=sealed))
