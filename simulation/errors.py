"""What the simulator refuses.

::

    SimulationError (ValueError)     an argument of a scanner, a scan or a world is wrong
"""


class SimulationError(ValueError):
    """The one error of this package: the input is wrong, and says where.

    Attributes
    ----------
    argument : str
        Which argument.
    message : str
        What was expected, and what came.
    """

    def __init__(self, message: str, *, argument: str) -> None:
        super().__init__(f"{argument}: {message}")
        self.message = message
        self.argument = argument
