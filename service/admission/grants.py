"""Permissions of a caller (roles and visible maps), and the permissions that each route requires."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

from .fair_queue import Holder

GUARDED = "/v1/"
"""Prefix of the paths that require a key; probes and pages stay open."""
LONGEST = 256
"""Of a route's path, letters: an id has at most 128."""


class Role(StrEnum):
    """A permission of a key; none includes another."""

    READ = "read"
    ASSOCIATE = "associate"
    WRITE = "write"


EVERY_ROLE = frozenset(Role)


@dataclass(frozen=True, slots=True)
class Grant:
    """The permissions of a caller.

    Attributes
    ----------
    holder : Holder
        The caller to whom shares of the service count.
    roles : frozenset of Role
    maps : str
        Prefix of the ids of the maps that it sees; for the caller no other maps exist.
    """

    holder: Holder = None
    roles: frozenset[Role] = EVERY_ROLE
    maps: str = ""

    @property
    def is_whole(self) -> bool:
        """Return whether the grant has every role and sees every map."""
        return self.roles == EVERY_ROLE and not self.maps

    def sees(self, map_id: str) -> bool:
        """Return whether a map is one of those that there are for it."""
        return map_id.startswith(self.maps)


@dataclass(frozen=True, slots=True)
class Access:
    """The permissions that a route requires.

    Attributes
    ----------
    methods : str
        With blanks between them; HEAD goes with GET.
    path : str
        As its router has it.
    role : Role, or None
        None: any key will do.
    searches : bool
        True when it needs a slot at the gate.
    """

    methods: str
    path: str
    role: Role | None
    searches: bool = False


# A route that is missing here needs a whole grant, and a test fails. If two fit, the first counts, as for the router:
# the path of a map's check is also one of a map.
ROUTES = (
    Access("GET", "/v1/limits", None),
    Access("POST", "/v1/associate", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/associate:batch", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/register", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/vectorize", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/maps:import", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/scans:import", Role.ASSOCIATE, searches=True),
    Access("GET", "/v1/maps/{map_id}:check", Role.READ, searches=True),
    Access("POST", "/v1/maps/{map_id}:check", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/analyze", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/maps/{map_id}:analyze", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/maps/{map_id}:update", Role.ASSOCIATE, searches=True),
    Access("POST", "/v1/maps:apply", Role.ASSOCIATE, searches=True),
    Access("GET", "/v1/maps", Role.READ),
    Access("GET", "/v1/maps/{map_id}", Role.READ),
    Access("PUT DELETE", "/v1/maps/{map_id}", Role.WRITE),
)


@dataclass(frozen=True, slots=True)
class Asked:
    """The access that a request needs, as far as its head shows.

    Attributes
    ----------
    access : Access, or None
        None for a path outside the table of routes.
    map_id : str, or None
        Of the map in its path.
    """

    access: Access | None = None
    map_id: str | None = None


def asked_of(method: str, path: str) -> Asked:
    """Return the access that a request needs; `path` with its escapes undone."""
    # Longer paths lead nowhere and are not cached: callers without a key can send them, too.
    return _looked_up(method, path) if len(path) <= LONGEST else Asked()


@lru_cache(maxsize=1024)
def _looked_up(method: str, path: str) -> Asked:
    read_as = "GET" if method == "HEAD" else method
    for access, pattern in _PATTERNS.get(read_as, ()):
        found = pattern.match(path)
        if found is not None:
            return Asked(access, found.groupdict().get("map_id"))
    return Asked()


def _patterns() -> dict[str, list[tuple[Access, re.Pattern[str]]]]:
    found: dict[str, list[tuple[Access, re.Pattern[str]]]] = {}
    for access in ROUTES:
        # As the router has it, a line's end behind the path included: each route of the router has to be one here.
        pattern = re.compile(re.escape(access.path).replace(r"\{map_id\}", "(?P<map_id>[^/]+)") + "$")
        for method in access.methods.split():
            found.setdefault(method, []).append((access, pattern))
    return found


_PATTERNS = _patterns()
