"""Which entities of a drawing are walls of the wanted floor, by their layers and properties."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable, Mapping
from typing import Any

LEVELS = ("level", "level_id", "floor", "floor_id", "storey", "story", "etage", "geschoss")
MOST_LEVELS = 200  # that one entity may be on
RANGE = re.compile(r"(-?\d+)\s*-\s*(-?\d+)")  # of levels, as OpenStreetMap writes it

# Beginnings of the names of layers and groups that are storeys, in some languages of drawings.
STOREY = re.compile(
    r"((level|floor|storey|story|etage|geschoss|stock|niveau|nivel|piano|planta|piso)([\s_.:-]*-?\d+|[\s_.:-]+[a-z])"
    r"|(-?\d+(st|nd|rd|th|er|e|\.)?|ground|first|second|third|fourth|upper|lower)[\s_.-]*"
    r"(level|floor|storey|story|etage|étage|stock|obergeschoss|untergeschoss|og|ug|piano|planta)"
    r"|eg|dg|kg|(og|ug)[\s_.-]*\d*|(erd|keller|ober|unter|dach)geschoss|basement|mezzanine|rez.de.chauss[ée]e)"
    r"(?![a-z0-9])",
    re.IGNORECASE,
)

# Properties whose entities no laser sees, with patterns of their values: tags of OpenStreetMap, types of IMDF.
KINDS = ("door", "doors", "doorway", "opening", "openings", "footway", "path", "ifcdoor", "ifcopeningelement")
NOT_SEEN = {
    **dict.fromkeys(("highway", "footway", "railway", "waterway", "landuse", "door", "entrance"), ("*",)),
    **dict.fromkeys(("type", "kind", "class", "category", "element", "ifc_type"), KINDS),
    "indoor": ("area", *KINDS),
    "feature_type": ("geofence", "section", "venue", "relationship", "occupant", "address", *KINDS),
}
NO = ("no", "none", "false", "0", "")


def matches(names: Iterable[str], patterns: Iterable[str]) -> bool:
    """Tell whether one of some names fits one of some patterns, without regard to case."""
    lower = [pattern.casefold() for pattern in patterns]
    return any(fnmatch.fnmatchcase(name.casefold(), pattern) for name in names for pattern in lower)


def text_of_value(value: Any) -> str:
    """Return the value of a property as an option names it: true, 2 for 2.0."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.12g}" if isinstance(value, int | float) else str(value)


def excluded_by(properties: Mapping[str, Any], where: tuple[str, ...]) -> tuple[str, str] | None:
    """Return why an entity is not wanted, as the code of a note and a property; None for one that is."""
    wanted: dict[str, list[str]] = {}
    for key, _, pattern in (one.partition("=") for one in where):
        wanted.setdefault(key.strip(), []).append(pattern.strip())
    for key, patterns in wanted.items():
        value = None if properties.get(key) is None else text_of_value(properties[key])
        if value is None or not matches((value,), patterns):
            return "other_value", f"no {key}" if value is None else f"{key}={value}"
    for key in () if where else sorted(NOT_SEEN.keys() & properties.keys()):
        value = "" if properties[key] is None else text_of_value(properties[key])
        if value.casefold() not in NO and matches((value,), NOT_SEEN[key]):
            return "not_seen", f"{key}={value}"
    return None


def levels_of(layers: Iterable[str], properties: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the floors of an entity: by a property, which may name several, else by the name of a layer."""
    value = next((told for key in LEVELS if (told := properties.get(key)) not in (None, "", [])), None)
    if value is None:
        return next(((found[0].strip(),) for name in layers if (found := STOREY.match(name.strip()))), ())
    names: list[str] = []
    for one in map(text_of_value, value) if isinstance(value, list) else text_of_value(value).split(";"):
        ends = RANGE.fullmatch(one.strip())
        low, high = sorted(map(int, ends.groups())) if ends else (0, MOST_LEVELS)
        names += map(str, range(low, high + 1)) if high - low < MOST_LEVELS else [one.strip()]
    return tuple(dict.fromkeys(names[:MOST_LEVELS]))
