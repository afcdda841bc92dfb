"""Options that describe a file: fields of a form, or options of the command line, to options of `formats`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from linefix.documents.errors import Fault, InvalidRequestError

if TYPE_CHECKING:
    from formats import ImportOptions

Fields = Mapping[str, Sequence[str]]
"""Values as text; a field may be there several times."""

POINT = "point"
_TRUTHS = {"true": True, "1": True, "yes": True, "false": False, "0": False, "no": False}


def options_of(fields: Fields) -> ImportOptions:
    """Return the import options that the fields of a form state.

    Raises
    ------
    InvalidRequestError
        When a field is not known, is there twice, or is out of its range.
    """
    from formats import ImportOptions, InvalidOptionError

    unknown = [
        Fault(f"/{name}", f"unknown field; expected one of {', '.join(KNOWN)}") for name in fields if name not in KNOWN
    ]
    if unknown:
        raise InvalidRequestError(unknown)
    said: dict[str, Any] = {}
    for name, values in fields.items():
        try:
            said["inside" if name == POINT else name] = KNOWN[name](values)
        except ValueError as error:
            raise InvalidRequestError([Fault(f"/{name}", str(error))]) from None
    try:
        return ImportOptions(**said)
    except InvalidOptionError as error:
        raise InvalidRequestError([Fault(pointer_of(error.argument), error.message)]) from None


def pointer_of(option: str) -> str:
    """Return the pointer to an option of `formats`."""
    return f"/{POINT}" if option == "inside" else f"/{option}"


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


KNOWN: dict[str, Callable[[Sequence[str]], Any]] = {
    "units": _units,
    "layers": _patterns,
    POINT: _places,
    "drawn": _text,
    "thickness": _number,
    "directions": _text,
    "local_metres": _truth,
    "topic": _text,
    "unknown": _unknown,
    "where": tuple,
    "level": _text,
    "surface": _number,
}
