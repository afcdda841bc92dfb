"""Lifetime of the elements of arrays of records."""

from __future__ import annotations

from compiled import kernel

from ..layout import Records


@kernel
def keep_alive(records: Records) -> None:
    """Keep an array that a kernel made alive until here.

    An element, ``records[0]``, is a bare pointer. Numba frees an array after the last use of its name, although
    elements of it may be in use still: then others write to that memory. So a kernel that makes an array of records
    ends with this, unless it hands the array itself on or back. Arguments live as long as the call.
    """
