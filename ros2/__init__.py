"""ROS 2 without ROS: subscribe to scans and publish poses over DDS. The extra ``linefix[ros2]``.

::

    node              Node: the main loop between messages and searches
    options           names of topics and frames; options of the node
    connecting        the DDS domain, within the range that the variables of ROS allow; endpoints of others
    topics            all topics; readers, writers and their quality of service
    messages          the messages, byte for byte as ROS has them
    frames            transforms, checked; the tree of frames; where a laser is mounted
    robot             topics, reports, clock, frames and odometry of one robot, as they are received
    clock             the clock of the robot; stamps that do not fit it
    odometry          the motion of the robot between two times
    looking           messages of scanners to the input of the search; scans that belong together
    searching         scans to the robot's pose, in a thread of its own
    maps              the maps that are searched; an OccupancyGrid to a map, in a process of its own
    localization      results of scans to the published poses
    agreement         several scans that agree through odometry
    lag               whether odometry fits scans by the stamps, or by the times of reception
    deciding          whether the localizer agrees; when initialpose is published; the transform from the map
    health            diagnostics, status, log
    inputs            the watch over ages, contradictions and clocks of what is received
    reporting         results as messages
    tuning            limits and thresholds
"""

from .connecting import ConnectionRefusedError, domain_of
from .maps import Maps
from .node import Node
from .options import NodeOptions, OptionError, checked_namespace, namespace_of, remapping_of

__all__ = [
    "ConnectionRefusedError",
    "Maps",
    "Node",
    "NodeOptions",
    "OptionError",
    "checked_namespace",
    "domain_of",
    "namespace_of",
    "remapping_of",
]
