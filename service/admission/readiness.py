"""Readiness of the service for requests."""

from __future__ import annotations

from ..errors import ENDING, NotReadyError


class Readiness:
    """Refuse requests before the kernels are warm, and report the end of the service before it closes.

    Attributes
    ----------
    warm : bool
        True when the kernels are loaded.
    draining : bool
        True when the service is to end.
    compiled : float or None
        Compiled fraction of the kernels, 0 to 1; None before and after the compilation.
    """

    def __init__(self) -> None:
        self.warm = False
        self.draining = False
        self.compiled: float | None = None

    @property
    def takes_requests(self) -> bool:
        """Return whether the service is neither warming up nor ending."""
        return self.warm and not self.draining

    def require_warm(self) -> None:
        """Raise `NotReadyError` as long as nothing can be searched."""
        if self.warm:
            return
        if self.compiled is None:
            raise NotReadyError("the kernels are being loaded; send the request again later")
        raise NotReadyError(f"the kernels are being compiled, {self.compiled:.0%} so far; send the request again later")

    def require_all(self) -> None:
        """Raise `NotReadyError` when requests should go elsewhere."""
        if self.draining:
            raise NotReadyError(ENDING)
        self.require_warm()
