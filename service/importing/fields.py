"""Options that describe a file: fields of a form, or options of the command line, to options of `formats`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from linefix.documents.errors import Fault, InvalidRequestError

if TYPE_CHECKING:
    from formats import ImportOptions

Fields = Mapping[str, Sequence[str]]
"""Values as text; a field may be there several times."""

Known = Mapping[str, Callable[[Sequence[str]], Any]]
"""The reader of each field; everything in a form is text."""

MAX_SCANS = 1000
_TRUTHS = {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}


def options_of(fields: Fields) -> ImportOptions:
    """Return the import options that the fields of a form state.

    Raises
    ------
    InvalidRequestError
        When a field is not known, is there twice, or is out of its range.
    """
    from formats import ImportOptions, InvalidOptionError

    said = read_fields(fields, MapForm.fields)
    try:
        return ImportOptions(**said)
    except InvalidOptionError as error:
        raise InvalidRequestError([Fault(f"/{error.argument}", error.message)]) from None


def read_fields(fields: Fields, known: Known) -> dict[str, Any]:
    """Return the values of the fields of a form, of which so many are known.

    Raises
    ------
    InvalidRequestError
        When one is not known, is there twice, or cannot be read.
    """
    told = f"unknown field; expected one of {', '.join(known)}"
    unknown = [Fault(f"/{name}", told) for name in fields if name not in known]
    if unknown:
        raise InvalidRequestError(unknown)
    said = {}
    for name, values in fields.items():
        try:
            said[name] = known[name](values)
        except ValueError as error:
            raise InvalidRequestError([Fault(f"/{name}", str(error))]) from None
    return said


def _text(values: Sequence[str]) -> str:
    if len(values) != 1:
        raise ValueError(f"expected this field once, found it {len(values)} times")
    return values[0].strip()


def _number(values: Sequence[str]) -> float:
    return _numbers(_text(values), 1)[0]


def _unknown(values: Sequence[str]) -> int | str:
    text = _text(values)
    return int(text) if text.isdecimal() and len(text) < 10 else text


def _units(values: Sequence[str]) -> str | float:
    try:
        return _number(values)
    except ValueError:
        return _text(values)  # a name, which `ImportOptions` accepts or refuses


def _truth(values: Sequence[str]) -> bool:
    truth = _TRUTHS.get(_text(values).lower())
    if truth is None:
        raise ValueError("expected true or false, found other text")
    return truth


def _patterns(values: Sequence[str]) -> tuple[str, ...]:
    return tuple(pattern for value in values for one in value.split(",") if (pattern := one.strip()))


def _places(values: Sequence[str]) -> tuple[tuple[float, float], ...]:
    return tuple((x, y) for x, y in (_numbers(value, 2) for value in values))


def _numbers(text: str, count: int) -> list[float]:
    words = re.split(r"[\s,]+", text.strip())
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if len(numbers) != count:
        found = f"{len(numbers)} numbers" if numbers else "text that is not a number"
        raise ValueError(f"expected {'a number' if count == 1 else f'{count} numbers'}, found {found}")
    return numbers


def _count(values: Sequence[str]) -> int:
    text = _text(values)
    if not (text.isascii() and text.isdecimal() and len(text) < 5 and 1 <= int(text) <= MAX_SCANS):
        found = "another integer" if text.removeprefix("-").isdecimal() else "text that is no integer"
        raise ValueError(f"expected an integer from 1 to {MAX_SCANS}, found {found}")
    return int(text)


class MapForm:
    """The map and the files that it names, such as a yaml and its picture; a part with a filename is a file.

    Next to them there are fields, each with its reader.

    Attributes
    ----------
    units
        of a drawing: mm, cm, dm, m, km, in, ft, yd, us-ft, or metres per unit
    layers
        patterns such as *WALL*, comma separated
    point
        a free place, `x y` in metres; may be repeated
    drawn
        whether lines of a drawing are faces or centre lines of walls
    thickness
        of walls drawn as centre lines, metres
    oriented
        whether free space lies on the left of the lines
    local_metres
        whether a GeoJSON is in metres
    topic
        of the grid in a bag
    unknown
        of a grid: the grey value of unknown cells, 0 to 255, or none; left out: recognized
    where
        entities of a drawing to read, as property=value, the value a pattern; may be repeated
    level
        floor of a drawing that has several levels
    surface
        of a grid: cells from the front of occupied cells to the surface of walls, 0 to 10; left out: found from the
        grid
    """

    fields: ClassVar[Known] = {
        "units": _units,
        "layers": _patterns,
        "point": _places,
        "drawn": _text,
        "thickness": _number,
        "oriented": _truth,
        "local_metres": _truth,
        "topic": _text,
        "unknown": _unknown,
        "where": tuple,
        "level": _text,
        "surface": _number,
    }


class ScansForm:
    """A log: a bag of ROS 1 or ROS 2, an mcap, or a CARMEN log; a part with a filename is a file.

    Next to it there are fields, each with its reader.

    Attributes
    ----------
    topic
        of the scans; left out: the one with most of them
    max_scans
        greatest number of scans that are returned, 1 to 1000, by default 100, evenly spread
    """

    fields: ClassVar[Known] = {"topic": _text, "max_scans": _count}


CHOICES = {"drawn": ["faces", "centres"], "oriented": ["true", "false"], "local_metres": ["true", "false"]}
"""Values of those fields that have few."""
