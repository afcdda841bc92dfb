"""Readiness of the service for requests."""

from __future__ import annotations

import pytest

from service.admission.errors import NotReadyError
from service.admission.readiness import Readiness


def test_it_takes_requests_from_warm_until_it_goes_down() -> None:
    readiness = Readiness()
    assert not readiness.takes_requests
    for compiled, told in ((None, "loaded"), (0.613, "compiled, 61% so far")):
        readiness.compiled = compiled
        for require in (readiness.require_warm, readiness.require_all):
            with pytest.raises(NotReadyError, match=told):
                require()
    readiness.warm = True
    readiness.require_warm()
    readiness.require_all()
    assert readiness.takes_requests
    readiness.draining = True
    assert not readiness.takes_requests
    readiness.require_warm()  # what was let in goes on
    with pytest.raises(NotReadyError, match="shutting down"):
        readiness.require_all()
