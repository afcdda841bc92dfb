"""Which entities of a drawing are walls of the wanted floor, by their layers and properties."""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Iterable, Mapping
from typing import Any

from ..report import Notes, listed

LEVELS = (
    "level", "level_id", "level_name", "levelname", "level:ref", "floor", "floor_id", "floor_name", "floornumber",
    "floor_number", "addr:floor", "ordinal", "min_level", "storey", "story", "storey_name", "buildingstorey",
    "ifcbuildingstorey", "etage", "geschoss", "stockwerk", "data-level", "data-floor",
)  # fmt: skip
MOST_LEVELS = 200  # that one entity may be on
RANGE = re.compile(r"(-?\d+)\s*-\s*(-?\d+)")  # of levels, as OpenStreetMap writes it

# Parts of the names of layers, groups and blocks that are storeys, in some languages of drawings.
STOREY = re.compile(
    r"(?<![a-z0-9])"
    r"((level|floor|storey|story|etage|geschoss|stock|niveau|nivel|piano|planta|piso|ebene)"
    r"([\s_.:-]*-?\d+|[\s_.:-]+[a-z])"
    r"|(-?\d+(st|nd|rd|th|er|e|\.)?|ground|first|second|third|fourth|upper|lower)[\s_.-]*"
    r"(level|floor|storey|story|etage|étage|stock|obergeschoss|untergeschoss|og|ug|piano|planta)"
    r"|[lf]\d{1,2}|\d{1,2}f"
    r"|eg|dg|kg|(og|ug)[\s_.-]*\d*|(erd|keller|ober|unter|dach)geschoss|basement|mezzanine|rez.de.chauss[ée]e)"
    r"(?![a-z0-9])",
    re.IGNORECASE,
)

# Of layers, in some languages of drawings; and parts of names of layers that belong to walls and are none.
NAMES_OF_WALLS = (
    "*wall*", "*wand*", "*wänd*", "*mauer*", "*muro*", "*pared*", "*paret*", "*mur", "*murs*", "*cloison*", "*墙*",
    "*стен*",
)  # fmt: skip
NO_WALLS = tuple(
    f"*{part}*" for part in ("open", "door", "demo", "patt", "hatch", "paper", "anno", "iden", "text", "furn")
)

# Properties whose entities no laser sees, with patterns of their values: tags of OpenStreetMap, types of IMDF and IFC.
KINDS = ("door", "doors", "doorway", "opening", "openings", "footway", "path", "ifcdoor", "ifcopeningelement")
TYPES = (
    "type", "kind", "class", "category", "element", "element_type", "entity_type", "object", "object_type",
    "objecttype", "fclass", "ifc_type", "ifctype", "ifcclass", "ifc_class",
)  # fmt: skip
DOORS = ("door", "tuer", "tür", "puerta", "porte", "porta")  # begins of words in names of blocks
NOT_SEEN = {
    "block": [f"{before}{door}*" for door in DOORS for before in ("", "*[/_$ -]")],
    **dict.fromkeys(("highway", "footway", "railway", "waterway", "landuse", "door", "entrance", "area:highway"), "*"),
    **dict.fromkeys(("power", "boundary", "route", "aeroway", "aerialway", "public_transport", "place"), "*"),
    **dict.fromkeys(TYPES, KINDS),
    "indoor": ("area", *KINDS),
    "natural": ("water", "wood", "grassland", "scrub", "tree_row"),
    "leisure": ("park", "pitch", "garden", "playground"),
    "linetype": ("*dash*", "*hidden*", "*strichl*", "*verdeckt*", "acad_iso0[234]*"),  # above the head, or covered
    **dict.fromkeys(("linetype with gaps", "stroke-dasharray"), "*"),  # axes, too
    "feature_type": ("geofence", "section", "venue", "relationship", "occupant", "address", *KINDS),
}
SEEN = (*TYPES, "indoor", "barrier", "building", "feature_type")  # name what an entity is
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


def lower_keys(properties: Mapping[str, Any]) -> dict[str, Any]:
    """Return properties by their names without regard to case; of equal names the first one holds."""
    return {key.casefold(): properties[key] for key in reversed(list(properties))}


def kinds_of(properties: Mapping[str, Any]) -> str:
    """Return what an entity is, by its properties, such as ``indoor=wall``; empty where these do not say."""
    return ", ".join(f"{key}={properties[key]}" for key in SEEN if isinstance(properties.get(key), str))


def excluded_by(properties: Mapping[str, Any], where: tuple[str, ...]) -> tuple[str, str] | None:
    """Return why an entity is not wanted, as the code of a note and a property; None for one that is."""
    wanted: dict[str, list[str]] = {}
    for key, _, pattern in (one.partition("=") for one in where):
        wanted.setdefault(key.strip(), []).append(pattern.strip())
    for key, patterns in wanted.items():
        told = properties.get(key.casefold())
        value = None if told is None else text_of_value(told)
        if value is None or not matches((value,), patterns):
            return "other_value", f"no {key}" if value is None else f"{key}={value}"
    for key in () if where else sorted(NOT_SEEN.keys() & properties.keys()):
        value = "" if properties[key] is None else text_of_value(properties[key])
        if value.casefold() not in NO and matches((value,), NOT_SEEN[key]):
            return "not_seen", f"{key}={value}"
    return None


def walls_first(groups: tuple[str, ...]) -> str:
    """Return the outermost layer that is named after walls, else the outermost one."""
    return next((one for one in groups if _names_walls(one)), groups[0] if groups else "")


def _names_walls(name: str) -> bool:
    return matches((name,), NAMES_OF_WALLS) and not matches((name,), NO_WALLS)


def walls_among(names: Iterable[str], notes: Notes) -> set[str] | None:
    """Return the layers of walls among those of a drawing, by their names, with a note; None: all are taken."""
    every = sorted(set(names))
    walls = {name for name in every if _names_walls(name)}
    others = [name for name in every if name not in walls]
    if len(every) < 2 or not others:
        return None
    if not walls:
        told = f"lines of all layers are walls: {listed(others)}; set the option layers if some are not"
    else:
        told = (
            f"walls are on {listed(sorted(walls))}, by their names, and not on {listed(others)}; set the option layers "
            "for others"
        )
    notes.add_assumed("layers", told)
    return walls or None


def levels_of(layers: Iterable[str], properties: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the floors of an entity: by a property, which may name several, else by the name of a layer or block."""
    value = next((told for key in LEVELS if (told := properties.get(key)) not in (None, "", [])), None)
    if value is None:
        names = (*layers, str(properties.get("block", "")))
        return next(((found[0].strip(),) for name in names if (found := STOREY.search(name))), ())
    found_names: list[str] = []
    for one in map(text_of_value, value) if isinstance(value, list) else text_of_value(value).split(";"):
        ends = RANGE.fullmatch(one.strip())
        low, high = sorted(map(int, ends.groups())) if ends else (0, MOST_LEVELS)
        found_names += map(str, range(low, high + 1)) if high - low < MOST_LEVELS else [one.strip()]
    return tuple(dict.fromkeys(found_names[:MOST_LEVELS]))
