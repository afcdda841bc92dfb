"""Run by Alembic: migrates over the connection, and in the transaction, that `schema.upgrade` began."""

from alembic import context

from service.maps.schema import VERSION_TABLE

context.configure(
    connection=context.config.attributes["connection"], version_table=VERSION_TABLE, transactional_ddl=True
)
context.run_migrations()
