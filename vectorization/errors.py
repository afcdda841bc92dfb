"""What vectorization refuses.

::

    VectorizationError (ValueError)
    ├── InvalidScanError         ranges, angles or points that are no scan
    └── InvalidOptionError       an option out of its range
"""


class VectorizationError(ValueError):
    """Root of this package's errors: the input is wrong, and says where.

    Attributes
    ----------
    argument : str
        Which argument.
    index : int or None
        The row that is at fault, where there is one.
    message : str
        What was expected.
    """

    def __init__(self, message: str, *, argument: str, index: int | None = None) -> None:
        where = argument if index is None else f"{argument}[{index}]"
        super().__init__(f"{where}: {message}")
        self.message = message
        self.argument = argument
        self.index = index


class InvalidScanError(VectorizationError):
    """Ranges, angles or points are no scan."""


class InvalidOptionError(VectorizationError):
    """An option is out of its range."""
