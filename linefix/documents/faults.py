"""Faults that pydantic finds, in words of the contract, without an echo of the request."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .errors import Fault
from .limits import MAX_FAULTS
from .strict import nearest_name

_PLAIN = re.compile(r"^[A-Za-z0-9_.-]{1,40}$")
# pydantic's own messages for these types repeat the request, or use terms of Python.
_MESSAGES: dict[str, str] = {
    "extra_forbidden": "unknown field; correct its name or remove it",
    "missing": "expected this field, found none",
    "model_type": "expected an object",
    "model_attributes_type": "expected an object",
    "union_tag_invalid": "expected an object",
    "dict_type": "expected an object",
    "list_type": "expected an array",
    "float_type": "expected a number",
    "finite_number": "expected a number",
    "int_type": "expected an integer",
    "int_from_float": "expected an integer",
    "bool_type": "expected true or false",
    "string_type": "expected a string",
    "literal_error": "expected {expected}",
    "greater_than_equal": "expected at least {ge}",
    "greater_than": "expected more than {gt}",
    "less_than_equal": "expected at most {le}",
    "less_than": "expected less than {lt}",
    "string_too_short": "expected at least {min_length} characters",
    "string_too_long": "expected at most {max_length} characters",
    "too_short": "expected at least {min_length} items, found {actual_length}",
    "too_long": "expected at most {max_length} items, found {actual_length}",
    # All patterns of the contract are those of ids.
    "string_pattern_mismatch": "expected only letters (A to Z, a to z), digits and the characters . _ -",
}


def faults_of(items: Iterable[Mapping[str, Any]]) -> list[Fault]:
    """Return the first places that pydantic complained of."""
    faults: list[Fault] = []
    for item in items:
        place = _pointer(item["loc"])
        rows = item.get("ctx", {}).get("rows")
        if rows is None:
            faults.append(Fault(place, _message(item)))
        else:
            faults.extend(Fault(f"{place}/{index}", message) for index, message in rows)
        if len(faults) >= MAX_FAULTS:
            break
    return faults[:MAX_FAULTS]


def _message(item: Mapping[str, Any]) -> str:
    message = _MESSAGES.get(item["type"])
    if message is None:
        return str(item["msg"])
    name = str(item["loc"][-1]) if item["type"] == "extra_forbidden" else ""
    known = nearest_name(name) if _PLAIN.match(name) else None
    return message.format_map(item.get("ctx", {})) + (f"; a similar name is {known}" if known else "")


def _pointer(parts: Sequence[object]) -> str:
    """Return a JSON pointer; a name that is not plain ends it, since it came from the caller."""
    pointer = ""
    for part in parts:
        name = str(part)
        if name.startswith("<"):
            continue  # of a union, the model that was chosen; or of the caller, which is not repeated
        if not _PLAIN.match(name):
            break
        pointer += f"/{name}"
    return pointer
