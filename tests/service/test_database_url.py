"""Which database a URL names."""

from __future__ import annotations

import pytest

from service.database_location import database_url


@pytest.mark.parametrize("text", ["mysql://u:sesame@h/d", "nothing", "postgresql+asyncpg://u:sesame@h/d", ""])
def test_a_url_that_is_of_no_use(text: str) -> None:
    with pytest.raises(ValueError, match="expected a URL") as caught:
        database_url(text)
    assert "sesame" not in str(caught.value)


@pytest.mark.parametrize("begin", ["postgres", "postgresql", "postgresql+psycopg"])
def test_postgresql_by_any_name(begin: str) -> None:
    assert database_url(f"{begin}://u@h/d").drivername == "postgresql+psycopg"
