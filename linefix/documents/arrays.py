"""Long arrays of numbers, checked by the thousand instead of row by row.

pydantic takes some 50 ms for 10,000 rows and makes a megabyte of complaints of them; here a good array costs one pass
in C, and only a bad one is gone through, for its first `MAX_FAULTS` rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, islice
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, PlainValidator, ValidationInfo, WithJsonSchema
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from .limits import MAX_FAULTS, require_within
from .strict import MAX_MAGNITUDE

Floats = NDArray[np.float64]
NUMBERS = frozenset((int, float))
NUMBERS_OR_NULL = frozenset((int, float, type(None)))
INTEGERS = frozenset((int,))


KINDS = {type(None): "null", int: "an integer", float: "a decimal number", str: "a string", list: "an array"}


def _kind(value: Any) -> str:
    """Return the type of a JSON value in words; the value itself is not repeated."""
    return "true or false" if isinstance(value, bool) else KINDS.get(type(value), "an object")


def _not_an_array(value: Any) -> PydanticCustomError:
    return PydanticCustomError("not_an_array", f"expected an array, found {_kind(value)}")


def _number(low: float = -MAX_MAGNITUDE, high: float = MAX_MAGNITUDE) -> dict[str, Any]:
    return {"type": "number", "minimum": low, "maximum": high}


@dataclass(frozen=True, slots=True)
class _Array:
    """An array of numbers, or of rows of so many: how it is checked, and its JSON schema.

    Attributes
    ----------
    counted : (str, str)
        The name of its limit in `Limits`, and what that counts.
    width : int, or None
        Numbers in a row.
    types : frozenset of type
        That a number may have.
    low, high : float
        Bounds of a number.
    least : float, or None
        Of a number that is not 0.
    """

    counted: tuple[str, str]
    width: int | None = None
    types: frozenset[type] = NUMBERS
    low: float = -MAX_MAGNITUDE
    high: float = MAX_MAGNITUDE
    least: float | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Check by `validate` alone."""
        return core_schema.with_info_plain_validator_function(self.validate)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the schema of the array."""
        item = _number(self.low if self.least is None else self.least, self.high)
        if self.types is INTEGERS:
            item["type"] = "integer"
        elif self.types is not NUMBERS or self.least is not None:
            item = {"anyOf": [item, {"type": "null"}] if self.least is None else [{"const": 0}, item]}
        if self.width is not None:
            item = {"type": "array", "items": item, "minItems": self.width, "maxItems": self.width}
        return {"type": "array", "items": item}

    def validate(self, value: Any, info: ValidationInfo) -> Floats:
        """Return the numbers; stored arrays are read without limits, which may have changed since.

        In the same process an array of NumPy is taken, too; NaN in it is null.
        """
        if isinstance(value, np.ndarray):
            value = value.tolist()
        if type(value) is not list:
            raise _not_an_array(value)
        name, what = self.counted
        require_within(info, name, len(value), what)
        return self.numbers(value)

    def numbers(self, value: list[Any]) -> Floats:
        """Return the numbers of a list; raises an error with the first wrong rows."""
        flat, width = value, self.width
        in_rows = width is None or (set(map(type, value)) <= {list} and set(map(len, value)) <= {width})
        if in_rows and width is not None:
            flat = list(chain.from_iterable(value))
        if in_rows and set(map(type, flat)) <= self.types:
            array = np.array(flat, dtype=np.float64)  # null is NaN
            fits = (array >= self.low) & (array <= self.high)
            if (fits | np.isnan(array) if self.types is NUMBERS_OR_NULL else fits).all():
                return array if width is None else array.reshape(-1, width)
        faults = ((i, fault) for i, one in enumerate(value) if (fault := self._fault(one)))
        raise PydanticCustomError("rows", "some rows are wrong", {"rows": list(islice(faults, MAX_FAULTS))})

    def _fault(self, one: Any) -> str | None:
        if self.width is None:
            return self.number_fault(one)
        if type(one) is not list:
            return f"expected an array of {self.width} numbers, found {_kind(one)}"
        if len(one) != self.width:
            return f"expected {self.width} numbers, found {len(one)}"
        return next((fault for item in one if (fault := self.number_fault(item))), None)

    def number_fault(self, item: Any) -> str | None:
        """Return what is wrong with a number."""
        if type(item) not in self.types:
            return f"expected {'an integer' if self.types is INTEGERS else 'a number'}, found {_kind(item)}"
        if item is not None and not self.low <= item <= self.high:
            return f"expected a number from {self.low:g} to {self.high:g}"
        return None


SIGMA_MAX = 1e3
_MAP, _SCAN = ("map_segments", "map segments"), ("scan_segments", "scan segments")
_BEAMS = ("beams", "ranges or points")
_SIGMAS = _Array(_SCAN, low=0, high=SIGMA_MAX)

MapSegmentRows = Annotated[Floats, _Array(_MAP, 4)]
ScanSegmentRows = Annotated[Floats, _Array(_SCAN, 4)]
MapPointRows = Annotated[Floats, _Array(("map_segments", "map points"), 2)]
PointRows = Annotated[Floats, _Array(_BEAMS, 2)]
CentroidRows = Annotated[Floats, _Array(_SCAN, 2)]
PairRows = Annotated[Floats, _Array(("pairs", "correspondences"), 2, INTEGERS, 0)]
Ranges = Annotated[Floats, _Array(_BEAMS, types=NUMBERS_OR_NULL)]
PointCounts = Annotated[Floats, _Array(_SCAN, low=1)]
Spreads = Annotated[Floats, _Array(_SCAN, low=0, high=1e8)]
# The library refuses values next to 0 that are not 0: their squares would be 0.
Weights = Annotated[Floats, _Array(("pairs", "weights"), low=0, high=1e100, least=1e-100)]


def _sigma(value: Any, info: ValidationInfo) -> Floats | float:
    if type(value) is list:
        return _SIGMAS.validate(value, info)
    if fault := _SIGMAS.number_fault(value):
        raise PydanticCustomError("sigma", fault)
    return float(value)


SigmaOrSigmas = Annotated[
    Any,
    PlainValidator(_sigma),
    WithJsonSchema({"anyOf": [_number(0, SIGMA_MAX), {"type": "array", "items": _number(0, SIGMA_MAX)}]}),
]
"""One standard deviation for all segments of a scan, or one each."""


@dataclass(frozen=True, slots=True)
class _Covariance(_Array):
    """The rows of a covariance of x, y and theta.

    Attributes
    ----------
    definite : bool
        False: a direction may be exact.
    """

    definite: bool = True

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the schema of the rows."""
        return {**_Array.__get_pydantic_json_schema__(self, schema, handler), "minItems": 3, "maxItems": 3}

    def validate(self, value: Any, info: ValidationInfo) -> Floats:
        """Return the matrix."""
        if type(value) is not list:
            raise _not_an_array(value)
        if len(value) != 3:
            raise _wrong_covariance(
                f"expected 3 rows of 3 numbers, of x, y and yaw, found {len(value)} items; of the 36 in ROS send rows "
                "and columns 0, 1, 5"
            )
        matrix = self.numbers(value)
        if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
            raise _wrong_covariance("expected a symmetric matrix, found different numbers in it; symmetrize it")
        least = np.linalg.eigvalsh(matrix).min()
        if least <= 0.0 if self.definite else least < -1e-9 * np.abs(matrix).max():
            expected = "a positive definite matrix" if self.definite else "a covariance"
            raise _wrong_covariance(
                f"expected {expected}, found the eigenvalue {least:.3g}; for an unknown direction send a large variance"
            )
        return matrix


def _wrong_covariance(message: str) -> PydanticCustomError:
    return PydanticCustomError("covariance", message)


Covariance = Annotated[Floats, _Covariance(_SCAN, 3)]
StepCovariance = Annotated[Floats, _Covariance(_SCAN, 3, definite=False)]
"""Of a step; a direction may be exact."""
