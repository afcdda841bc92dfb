"""From JSON to a checked request, its options, and back to JSON."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import orjson
import pytest

from association import INCLUDED, AssociationOptions
from linefix.documents import examples
from linefix.documents.encoding import BLOCK, NotFiniteError, encode, encode_list
from linefix.documents.errors import InvalidRequestError, NotJsonError, TooManyError
from linefix.documents.inputs import association_options_of
from linefix.documents.limits import Limits
from linefix.documents.parts import MapDocument, SearchOptions
from linefix.documents.reading import parse, read_batch, read_model, read_stored
from linefix.documents.requests import AssociateRequest, BatchItem, RegisterRequest, VectorizeRequest

LIMITS = Limits(values=2_000_000, map_segments=200_000, scan_segments=2_000, beams=20_000, pairs=200_000, batch=256)

FEW = replace(LIMITS, values=10)


@pytest.mark.parametrize(
    ("body", "values"),
    [
        # Where there is a value there is a comma, a colon or a bracket before it, but for the first.
        (b"[" + b"1," * 9 + b"1]", 10),
        (b"{" + b'"a":1,' * 4 + b'"a":1}', 10),
        (b"[" + b"[]," * 4 + b"[]]", 10),
        (b"[" + b"{}," * 4 + b"{}]", 10),
    ],
)
def test_values_are_counted_before_they_take_memory(body: bytes, values: int) -> None:
    for enough in (values, values + 1):
        assert parse(body, replace(LIMITS, values=enough)) is not None
    with pytest.raises(TooManyError) as caught:
        parse(body, replace(LIMITS, values=values - 1))
    assert caught.value.limit == values - 1
    assert str(caught.value) == f"expected at most {values - 1} values, found more; see /v1/limits"


def test_a_body_of_few_bytes_cannot_hold_too_many_values() -> None:
    assert parse(b"[1,2,3,4]", FEW) == [1, 2, 3, 4]
    with pytest.raises(TooManyError):
        parse(b"[" * 11, FEW)
    with pytest.raises(NotJsonError):
        parse(b"[" * 10, FEW)


ROW = [0.0, 0.0, 1.0, 0.0]
SCAN = {"segments": [ROW], "centroids": [[0.0, 0.0]], "spreads": [1.0]}
COUNTED = [
    ("map_segments", AssociateRequest, lambda n: {**examples.ASSOCIATE, "map": {"segments": [ROW] * n}}),
    ("map_segments", MapDocument, lambda n: {"segments": [ROW] * n}),
    ("map_segments", RegisterRequest, lambda n: {**examples.REGISTER, "map": {"segments": [ROW] * n}}),
    ("scan_segments", AssociateRequest, lambda n: {**examples.ASSOCIATE, "scan": {"segments": [ROW] * n}}),
    ("scan_segments", RegisterRequest, lambda n: {**examples.REGISTER, "scan": {"segments": [ROW] * n}}),
    ("beams", VectorizeRequest, lambda n: {"points": [[0.0, 1.0]] * n}),
    ("beams", VectorizeRequest, lambda n: {"laser": {"angle_min": 0, "angle_increment": 0.1, "ranges": [1.0] * n}}),
    ("pairs", RegisterRequest, lambda n: {**examples.REGISTER, "correspondences": [[0, 0]] * n}),
    ("pairs", RegisterRequest, lambda n: {**examples.REGISTER, "weights": [1.0] * n}),
    # Values that come with each segment have the limit of the segments.
    ("scan_segments", AssociateRequest, lambda n: {**examples.ASSOCIATE, "scan": {**SCAN, "point_counts": [1.0] * n}}),
    ("scan_segments", AssociateRequest, lambda n: {**examples.ASSOCIATE, "scan": {**SCAN, "sigma": [1.0] * n}}),
    ("scan_segments", AssociateRequest, lambda n: {**examples.ASSOCIATE, "scan": {**SCAN, "spreads": [1.0] * n}}),
]


@pytest.mark.parametrize(("name", "model", "body"), COUNTED)
def test_every_count_has_its_limit(name: str, model: type, body: object) -> None:
    assert callable(body)
    data = orjson.dumps(body(12))
    read_model(model, data, replace(LIMITS, **{name: 12}))
    with pytest.raises(TooManyError) as caught:
        read_model(model, data, replace(LIMITS, **{name: 11}))
    assert caught.value.limit == 11


@pytest.mark.parametrize(
    ("count", "key", "fault"), [(256, "m%d", None), (257, "m%d", "found 257"), (9999, "m %d", "9999")]
)
def test_weights_of_maps_are_counted_before_they_are_looked_at(count: int, key: str, fault: str | None) -> None:
    """Class of attack: each malformed id of a map became an error."""
    weights = {key % number: 0.0 for number in range(count)}
    body = orjson.dumps({"maps": {"prefix": "m"}, "scan": {"segments": []}, "map_weights": weights})
    if fault is None:
        assert read_model(AssociateRequest, body, LIMITS).map_weights == weights
        return
    with pytest.raises(InvalidRequestError, match=f"^/map_weights: expected at most 256 items, .*{fault}$"):
        read_model(AssociateRequest, body, LIMITS)


def test_a_batch_is_read_scan_by_scan() -> None:
    scans: list[object] = [{"segments": [ROW]}, {"segments": [[1, 2, 3]]}, {"segments": [ROW] * 3}, 5]
    priors = [None, None, None, {"x": 1, "y": 1, "theta": 0, "radius": "far", "angle": 1}]
    body = orjson.dumps({"map": {"segments": examples.WALLS}, "scans": scans, "priors": priors})
    limits = replace(LIMITS, scan_segments=2, batch=4)
    asked, items = read_batch(body, limits)
    assert (asked.scans, asked.priors) == ([], None)
    assert [type(item) for item in items] == [BatchItem, InvalidRequestError, TooManyError, InvalidRequestError]
    with pytest.raises(TooManyError) as caught:
        read_batch(body, replace(limits, batch=3))
    assert (caught.value.pointer, caught.value.limit) == ("/scans", 3)


def test_what_was_stored_is_held_to_no_limit() -> None:
    assert len(read_stored(orjson.dumps({"segments": [ROW] * 300_000})).segments) == 300_000


def test_options_that_nobody_gives_are_not_copied_for_each_request() -> None:
    body = orjson.dumps({name: part for name, part in examples.ASSOCIATE.items() if name != "options"})
    first, second = (read_model(AssociateRequest, body, LIMITS) for _ in range(2))
    assert first.options is second.options


@pytest.mark.parametrize("answer", [np.nan, {"a": [1.0, {"b": np.inf}]}, {"a": np.array([[1.0, -np.inf]])}, (np.nan,)])
def test_nothing_that_is_not_finite_leaves(answer: object) -> None:
    with pytest.raises(NotFiniteError):
        encode(answer)
    assert encode({"a": np.array([1.0]), "b": None}) == b'{"a":[1.0],"b":null}'


@pytest.mark.parametrize("count", [0, 1, BLOCK, BLOCK + 1, 3 * BLOCK])
def test_a_list_that_is_encoded_by_blocks_is_the_same(count: int) -> None:
    items = [{"a": number, "b": [0.1 * number]} for number in range(count)]
    assert encode({"items": encode_list(iter(items))}) == encode({"items": items})


def test_nor_does_anything_in_a_block() -> None:
    with pytest.raises(NotFiniteError):
        encode_list([{"a": 1.0}] * BLOCK + [{"a": np.inf}])


def test_only_parts_that_are_included_are_worked_out() -> None:
    """By default all, as the library does; so are other options."""
    assert association_options_of(SearchOptions(), oriented=True) == AssociationOptions(include=INCLUDED)
    for names, parts in (([], ()), (["segments", "alternatives"], ("alternatives",))):
        asked = SearchOptions.model_validate({"include": names}, strict=False)
        assert association_options_of(asked, oriented=True).include == parts
