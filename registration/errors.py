"""Errors of registration, and the base of the input errors of all packages.

::

    InputError (ValueError)
    └── RegistrationError
        ├── InvalidSegmentsError     a segment that no line can be put through
        └── InvalidArgumentError     everything else that is wrong with an argument
"""


class InputError(ValueError):
    """The input is wrong, and this says where.

    Attributes
    ----------
    argument : str
        Which argument, a path in the caller's terms such as ``scan.segments``.
    index : int or None
        The row that is at fault, where there is one.
    message : str
        The expected value, or the fault.
    """

    def __init__(self, message: str, *, argument: str, index: int | None = None) -> None:
        where = argument if index is None else f"{argument}[{index}]"
        super().__init__(f"{where}: {message}")
        self.message = message
        self.argument = argument
        self.index = index


class RegistrationError(InputError):
    """Root of this package's errors."""


class InvalidSegmentsError(RegistrationError):
    """A segment is not finite, too short, too long or too far out."""


class InvalidArgumentError(RegistrationError):
    """An argument other than a segment is wrong."""
