"""What association refuses.

::

    AssociationError (ValueError)
    ├── InvalidMapError      the map is empty, too wide, or its sigma out of range
    └── InvalidSearchError   a scan, prior or option out of range
"""


class AssociationError(ValueError):
    """Root of this package's errors: the input is wrong, and says where.

    Attributes
    ----------
    argument : str
        Which argument, a path in the caller's terms such as ``options.confidence``.
    index : int or None
        The row that is at fault, where there is one.
    """

    def __init__(self, message: str, *, argument: str, index: int | None = None) -> None:
        where = argument if index is None else f"{argument}[{index}]"
        super().__init__(f"{where}: {message}")
        self.message = message
        self.argument = argument
        self.index = index


class InvalidMapError(AssociationError):
    """The map cannot be searched."""


class InvalidSearchError(AssociationError):
    """The scan, the prior or an option is out of range."""
