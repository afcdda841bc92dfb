"""Nothing that is not finite leaves."""

from __future__ import annotations

import numpy as np
import pytest

from service.schemas.encoding import NotFiniteError, encode


@pytest.mark.parametrize("answer", [np.nan, {"a": [1.0, {"b": np.inf}]}, {"a": np.array([[1.0, -np.inf]])}, (np.nan,)])
def test_nothing_that_is_not_finite_leaves(answer: object) -> None:
    with pytest.raises(NotFiniteError):
        encode(answer)
    assert encode({"a": np.array([1.0]), "b": None}) == b'{"a":[1.0],"b":null}'
