"""ROS 2 without ROS: subscribe to scans and publish poses over DDS. The extra ``linefix[ros2]``.

::

    node              Node: the main loop between messages and searches
    options           names of topics and frames; options of the node
    connecting        the DDS domain, within the range that the variables of ROS allow; endpoints of others
    topics, wire      all topics; readers, writers and their quality of service
    messages          the messages, byte for byte as ROS has them
    frames            the tree of frames
    transforms        a transform, checked; where a laser is mounted
    odometry          the motion of the robot between two times
    looking           messages of scanners to the input of the search; scans that belong together
    searching         scans to the robot's pose, in a thread of its own
    maps              the maps that are searched
    map_conversion    an OccupancyGrid to a map, in a process of its own
    localization      results of scans to the published poses
    agreement         several scans that agree through odometry
    deciding          when initialpose is published; the transform from the map to the odometry frame
    watching          whether the localizer of the robot agrees
    health            diagnostics, status, log
    inputs            the watch over ages, contradictions and clocks of what is received
    requests          requests with an id, and their results
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
