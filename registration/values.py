"""Values that are made for each answer and handed from one part of the packages to another.

Results are frozen at run time, too, except the many correspondences.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as value
else:

    def value(*, frozen: bool, slots: bool = False, eq: bool = True) -> Callable[[type[Any]], type[Any]]:
        """Make an immutable dataclass: as `dataclass`, but only type checkers enforce ``frozen``.

        At run time a frozen one sets each field by way of `object.__setattr__`, and takes five times as long to make.
        """
        return dataclass(slots=slots, eq=eq, unsafe_hash=frozen and eq)


__all__ = ["value"]
