"""Nothing that is not finite leaves."""

from __future__ import annotations

import numpy as np
import pytest

from linefix.documents.encoding import BLOCK, NotFiniteError, encode, encode_list


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
