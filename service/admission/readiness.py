"""Whether the service takes requests at all."""

from __future__ import annotations

from .errors import NotReadyError


class Readiness:
    """Nothing is searched before the kernels are warm; a service that goes down says so before it closes.

    Attributes
    ----------
    warm : bool
        Whether the kernels are loaded.
    draining : bool
        Whether the service was told to end.
    """

    def __init__(self) -> None:
        self.warm = False
        self.draining = False

    @property
    def takes_requests(self) -> bool:
        """Whether it is neither warming up nor going down."""
        return self.warm and not self.draining

    def require_warm(self) -> None:
        """Raise `NotReadyError` as long as nothing can be searched."""
        if not self.warm:
            raise NotReadyError("the kernels are being compiled")

    def require_all(self) -> None:
        """Raise `NotReadyError` when requests should go elsewhere."""
        if self.draining:
            raise NotReadyError("the service is going down")
        self.require_warm()
