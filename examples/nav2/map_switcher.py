"""Load the map of the floor that the robot is on into map_server; on a machine with ROS 2, next to Nav2.

::

    linefix ros2 --map /maps/hq-1.yaml --map /maps/hq-2.yaml
    python3 map_switcher.py --ros-args -p folder:=/maps

Linefix publishes the name of the map on `linefix/map_id`. This node requests LoadMap of map_server with the file of
this name in `folder`. AMCL may receive `initialpose` before the map. So the last pose is published again when
the map is loaded.
"""

from pathlib import Path

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav2_msgs.srv import LoadMap
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

RETRY = 5.0  # s
SETTLE = 1.0  # s in which AMCL takes the map


class MapSwitcher(Node):
    """Requests the map of `linefix/map_id` from map_server."""

    def __init__(self):
        super().__init__("map_switcher")
        self.folder = Path(self.declare_parameter("folder", "/maps").value)
        self.suffix = self.declare_parameter("suffix", ".yaml").value
        self.wanted = self.loaded = self.requested = self.pose = None
        self.client = self.create_client(LoadMap, self.declare_parameter("service", "map_server/load_map").value)
        self.poses = self.create_publisher(PoseWithCovarianceStamped, "initialpose", 10)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(String, "linefix/map_id", self.take_map, latched)
        self.create_subscription(PoseWithCovarianceStamped, "initialpose", self.take_pose, 10)
        self.create_timer(RETRY, self.load)
        self.settled = self.create_timer(SETTLE, self.publish)
        self.settled.cancel()

    def take_map(self, message):
        """Take the map that the robot is on."""
        self.wanted = message.data
        self.load()

    def take_pose(self, message):
        """Take a pose of Linefix."""
        self.pose = message

    def load(self):
        """Request the map, unless map_server has it or is loading one."""
        if self.wanted in (None, self.loaded) or self.requested is not None:
            return
        if not self.client.service_is_ready():
            self.get_logger().warning(f"{self.wanted} waits for the service {self.client.srv_name}")
            return
        self.requested = self.wanted
        request = LoadMap.Request(map_url=str(self.folder / f"{self.wanted}{self.suffix}"))
        self.client.call_async(request).add_done_callback(lambda done: self.take_answer(request, done.result()))

    def take_answer(self, request, answer):
        """Take the answer of map_server. A map that failed is requested again by the timer."""
        name, self.requested = self.requested, None
        if answer.result != LoadMap.Response.RESULT_SUCCESS:
            self.get_logger().error(f"{request.map_url} is not loaded: result {answer.result} of LoadMap")
            return
        self.loaded = name
        self.get_logger().info(f"{request.map_url} is loaded")
        self.settled.reset()
        self.load()

    def publish(self):
        """Publish the last pose again: AMCL has the map now."""
        self.settled.cancel()
        if self.pose is not None and self.loaded == self.wanted:
            self.poses.publish(self.pose)


if __name__ == "__main__":
    rclpy.init()
    rclpy.spin(MapSwitcher())
