"""ROS 2 without ROS: subscribe to scans and publish poses over DDS. The extra ``linefix[ros2]``.

::

    bridge          Bridge: the main loop between messages and searches
    wire            topics, their quality of service, readers and writers
    messages        the messages, byte for byte as ROS has them
    frames          the tree of frames, and where a laser is mounted
    odometry        the motion of the robot between two times
    gathering       scans of several scanners that belong together
    locating        one scan to the robot's pose
    searching       the thread of the searches
    map_conversion  an OccupancyGrid to a map, in a process of its own
    reporting       an answer as messages
    tuning, text    limits; text from outside
"""

from .bridge import Bridge, BridgeOptions, namespace_of

__all__ = ["Bridge", "BridgeOptions", "namespace_of"]
