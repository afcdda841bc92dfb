"""Errors of the simulator.

::

    SimulationError (InputError)     an argument of a scanner, a scan or a world is wrong
"""

from registration import InputError


class SimulationError(InputError):
    """The one error of this package."""
