"""Asks a Linefix service where a robot is: typed, in threads or in an event loop.

::

    client           Client and AsyncClient
    asking           what both send, and when it is sent again
    problems         refusals as exceptions
    frames           poses of the laser and of the robot; covariances of 3 x 3 and ROS's 6 x 6
    scans            ranges as JSON has them
    schema           types of requests and answers
"""

from .client import AsyncClient, Client
from .frames import Covariance, Pose, base_from_laser, covariance_from_ros, covariance_to_ros, laser_from_base
from .problems import BusyError, LinefixError, ProblemError, UnreachableError
from .scans import laser

__all__ = [
    "AsyncClient",
    "BusyError",
    "Client",
    "Covariance",
    "LinefixError",
    "Pose",
    "ProblemError",
    "UnreachableError",
    "base_from_laser",
    "covariance_from_ros",
    "covariance_to_ros",
    "laser",
    "laser_from_base",
]
