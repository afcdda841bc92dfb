"""ROS 2 without ROS: scans in and poses out over DDS, in the messages that robots speak. The extra ``linefix[ros2]``.

::

    bridge       Bridge: waits for scans, answers them, until it is told to end
    locating     one scan to the robot's pose: mounts, frames, covariance
    reporting    an answer as messages
    wire         topics, their quality of service, readers and writers
    messages     the messages, byte for byte as ROS has them
"""

from .bridge import Bridge, BridgeOptions

__all__ = ["Bridge", "BridgeOptions"]
