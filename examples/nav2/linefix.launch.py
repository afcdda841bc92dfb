"""Start the bridge beside Nav2; run on a machine with ROS 2: ``ros2 launch linefix.launch.py map:=/maps/hq.yaml``.

`linefix` has to be on the PATH, installed with ``linefix[formats,ros2]`` in an environment of its own: nothing of
ROS is needed there.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def generate_launch_description() -> LaunchDescription:
    """Return what is started: the bridge, which AMCL hears by /initialpose."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("map", description="the map that map_server serves, as a file"),
            DeclareLaunchArgument("scan", default_value="/scan"),
            DeclareLaunchArgument("base", default_value="base_link"),
            ExecuteProcess(
                cmd=[
                    "linefix", "ros2",
                    "--map", LaunchConfiguration("map"),
                    "--scan", LaunchConfiguration("scan"),
                    "--base", LaunchConfiguration("base"),
                ],
                output="screen",
                respawn=True,
            ),
        ]
    )  # fmt: skip
