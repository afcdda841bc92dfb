"""Conditions of a writer on the present revision."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import RevisionConflictError


@dataclass(frozen=True, slots=True)
class Preconditions:
    """Conditions of a writer on the present revision.

    Attributes
    ----------
    if_match : frozenset of int, or None
        Revisions of which the present one must be.
    any_match : bool
        ``If-Match: *``: there must be a map.
    if_none_match : frozenset of int, or None
        Revisions that the present one must not be.
    none_may_exist : bool
        ``If-None-Match: *``: there must be no map.
    """

    if_match: frozenset[int] | None = None
    any_match: bool = False
    if_none_match: frozenset[int] | None = None
    none_may_exist: bool = False

    def check(self, revision: int | None) -> None:
        """Hold the present revision, None for no map, to the demands.

        Raises
        ------
        RevisionConflictError
            When it is not as demanded.
        """
        present = revision is not None
        refused = (
            (self.any_match and not present)
            or (self.if_match is not None and revision not in self.if_match)
            or (self.none_may_exist and present)
            or (self.if_none_match is not None and present and revision in self.if_none_match)
        )
        if refused:
            raise RevisionConflictError(revision)
