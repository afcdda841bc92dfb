"""The strictness that every request model shares, and the scalar types of the contract."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from inspect import cleandoc
from itertools import chain, islice
from typing import Annotated, Any, Literal, Self, get_args

import orjson
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from .limits import MAX_FAULTS

MAX_MAGNITUDE = 1e9
MAX_FREE_BYTES = 16_384
MAX_FREE_DEPTH = 32
LIKE = 0.7  # of two names, 0 to 1; from there on one is taken for the other misspelt
_ATTRIBUTES = "Attributes\n----------\n"
_ATTRIBUTE = re.compile(r"^(\w.*)\n((?: {4}.*\n?)+)", re.MULTILINE)
SEAL = ("client_ref", "request_id", "timing_ms")  # of each request or answer, the last of its fields
_names: set[str] = set()


def nearest_name(name: str) -> str | None:
    """Return the field of the contract with the most similar name; None where none is similar, or it is one itself."""
    return None if name in _names else next(iter(get_close_matches(name, sorted(_names), 1, LIKE)), None)


def descriptions_of(kind: type) -> dict[str, str]:
    """Return the descriptions of the attributes in the docstring of a class, by their names."""
    attributes = cleandoc(kind.__doc__ or "").partition(_ATTRIBUTES)[2]
    return {
        name: " ".join(text.split()) for names, text in _ATTRIBUTE.findall(attributes) for name in names.split(", ")
    }


class Described(BaseModel):
    """Has the descriptions of its fields in its docstring, as other classes; the schema reads them there."""

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the schema, with the descriptions of the model and of its fields."""
        schema = handler(core)
        model = handler.resolve_ref_schema(schema)
        for kind in reversed(cls.__mro__[: cls.__mro__.index(Described)]):
            model["description"] = cleandoc(kind.__doc__ or "").partition(_ATTRIBUTES)[0].strip()
            for name, text in descriptions_of(kind).items():
                model["properties"][cls.model_fields[name].alias or name]["description"] = text
        last = [name for name in SEAL if name in cls.model_fields]
        model.get("properties", {}).update({name: model["properties"].pop(name) for name in last})
        return schema


class Strict(Described):
    """Takes numbers for numbers only, and no field that it does not know."""

    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True, defer_build=True)

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Note the names of the fields."""
        _names.update(cls.model_fields)

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """Return itself: it is frozen, and as a default it would be copied for every request that leaves it out."""
        return self

    @model_validator(mode="before")
    @classmethod
    def _few_unknown(cls, value: Any) -> Any:
        """Leave out unknown fields beyond the reported number: each would become an error before any is looked at."""
        if not isinstance(value, dict) or len(value) <= len(cls.model_fields) + MAX_FAULTS:
            return value
        unknown = islice((name for name in value if name not in cls.model_fields), MAX_FAULTS)
        return {name: value[name] for name in chain(cls.model_fields.keys() & value.keys(), unknown)}


class Answer(Described):
    """Model of an answer: documents the JSON, is never built for an answer."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, defer_build=True)  # seldom asked for


@dataclass(frozen=True, slots=True)
class OneOf:
    """Chooses a model of a union by the fields of a value, so that its faults are those of this model alone.

    Attributes
    ----------
    expected : str
        The fields, in words.
    fields : tuple of str
        Of each model, in the order of the union, the names that decide for it, with spaces between.
    """

    expected: str
    fields: tuple[str, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the union of the models, each with its number in brackets, which no pointer has."""
        models: tuple[type[BaseModel], ...] = get_args(source)
        known = {name for model in models for name in model.model_fields}

        def choose(value: Any) -> str | None:
            if not isinstance(value, dict):
                return next((f"<{k}>" for k, model in enumerate(models) if isinstance(value, model)), "<0>")
            found = [k for k, names in enumerate(self.fields) if value.keys() & names.split()]
            if not found and value.keys() - known:
                return "<0>"  # which names the fields that it does not know, a misspelt one among them
            return f"<{found[0]}>" if len(found) == 1 else None

        return core_schema.tagged_union_schema(
            {f"<{k}>": handler.generate_schema(model) for k, model in enumerate(models)},
            choose,
            custom_error_type="one_of",
            custom_error_message=f"expected exactly one of {self.expected}",
        )


def _free_json(value: Any) -> Any:
    try:
        size = len(orjson.dumps(value))
    except orjson.JSONEncodeError:  # it is nested more than 254 levels deep
        raise _TOO_DEEP from None
    if size > MAX_FREE_BYTES:
        raise PydanticCustomError(
            "json_too_long", f"expected at most {MAX_FREE_BYTES} bytes of JSON, found {size}; send less"
        )
    if _depth(value) > MAX_FREE_DEPTH:
        raise _TOO_DEEP
    return value


_TOO_DEEP = PydanticCustomError(
    "too_deep", f"expected at most {MAX_FREE_DEPTH} levels of nesting, found more; flatten it"
)


def _depth(value: Any) -> int:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return 1 + max(map(_depth, inner), default=0)


FreeJson = Annotated[Any, PlainValidator(_free_json), WithJsonSchema({})]
"""Anything, given back as it was sent."""


def in_radians(low: float, high: float, said: str) -> Callable[[float], float]:
    """Return what refuses an angle beyond its limits, `said` in words: most who send one mean degrees."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise PydanticCustomError("radians", f"expected radians, {said}; check whether it is in degrees")
        return value

    return check


class Referenced(Strict):
    """A request with a reference.

    Attributes
    ----------
    client_ref
        returned as it was sent
    """

    client_ref: FreeJson = None


Coordinate = Annotated[float, Field(ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)]
# Two turns either way. Beyond that it is in degrees, and would choose a wrong place without a word.
_TURNS = 4.0 * math.pi
Angle = Annotated[
    float,
    AfterValidator(in_radians(-_TURNS, _TURNS, "within 4 pi (two turns) of 0")),
    Field(json_schema_extra={"minimum": -_TURNS, "maximum": _TURNS}),
]
Sigma = Annotated[float, Field(ge=0.0, le=1e3)]
FrameId = Annotated[str, Field(max_length=256)]
DeadlineMs = Annotated[float, Field(ge=0.0, le=600_000.0)]
MapId = Annotated[str, Field(pattern=r"^[A-Za-z0-9._-]{1,128}$", min_length=1, max_length=128)]
Point = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
Row4 = Annotated[list[float], Field(min_length=4, max_length=4)]
Row3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Row2 = Annotated[list[float], Field(min_length=2, max_length=2)]
Matrix = Annotated[list[Row3], Field(min_length=3, max_length=3)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Index = Annotated[int, Field(ge=0)]
Milliseconds = Annotated[float, Field(ge=0.0)]
Verdict = Literal["ok", "ambiguous", "degenerate", "no_match"]


class Pose(Strict):
    """The scan frame's pose in the map frame: ``p_map = R(theta) p_scan + [x, y]``.

    Attributes
    ----------
    x, y
        metres
    theta
        radians, counter-clockwise
    """

    x: Coordinate
    y: Coordinate
    theta: Angle
