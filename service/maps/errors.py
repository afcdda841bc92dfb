"""Errors of the store of maps.

::

    StoreError
    ├── UnknownMapError        nothing is stored under the id
    ├── CorruptMapError        the stored map is damaged
    ├── RevisionConflictError  the map is not as the writer demands
    ├── StoreFullError         there is no room for it
    ├── ReadOnlyStoreError     nothing can be written
    ├── BusyStoreError         others write for too long
    ├── StoreAwayError         the database does not answer, or cannot be used
    └── IndexNotReadyError     another request indexes the map, and is not done in time
"""

from __future__ import annotations


class StoreError(Exception):
    """The store does not complete a request; the message gives the caller the reason."""


class UnknownMapError(StoreError):
    """Nothing is stored under the id."""

    def __init__(self) -> None:
        super().__init__("no map is stored under this id; GET /v1/maps lists the ids")


class CorruptMapError(StoreError):
    """The stored map is damaged."""

    def __init__(self, message: str = "the stored map does not match its checksum; send it again with PUT") -> None:
        super().__init__(message)


class RevisionConflictError(StoreError):
    """The map is not as the writer demands.

    Parameters
    ----------
    revision : int, or None
        The present one, None where there is no map.
    """

    def __init__(self, revision: int | None) -> None:
        now = "no map is stored under this id" if revision is None else f"the map's present revision is {revision}"
        super().__init__(f"{now}; If-Match or If-None-Match expects another state. Read the map again, then write")
        self.revision = revision


class StoreFullError(StoreError):
    """The disk is full, or the maps take all that they may."""

    def __init__(
        self, message: str = "the disk that stores the maps is full; delete maps, or enlarge the disk"
    ) -> None:
        super().__init__(message)


class ReadOnlyStoreError(StoreError):
    """Nothing can be written."""

    def __init__(self, message: str = "the store of maps is read-only; make its database writable") -> None:
        super().__init__(message)


class BusyStoreError(StoreError):
    """Others write for too long."""

    def __init__(self) -> None:
        super().__init__("the store is busy with other writes; send the request again")


class StoreAwayError(StoreError):
    """The database does not answer, or cannot be used."""

    def __init__(self, message: str = "the database does not respond; check that it runs and is reachable") -> None:
        super().__init__(message)


class IndexNotReadyError(StoreError):
    """Another request indexes the map, and is not done in time."""

    def __init__(self) -> None:
        super().__init__("the map is being indexed for another request; send the request again")
