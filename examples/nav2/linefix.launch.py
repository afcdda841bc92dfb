"""Start Linefix next to Nav2; on a machine with ROS 2: ``ros2 launch linefix.launch.py map:=/maps/hq.yaml``.

`linefix` has to be on the PATH, installed with ``linefix[formats,ros2]`` in an environment of its own: nothing of
ROS is needed there. Every option of ``linefix ros2`` can stand in the file of parameters; the arguments below are
those that differ from robot to robot.
"""

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    ExecuteProcess,
    OpaqueFunction,
    RegisterEventHandler,
    TimerAction,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration

OPTIONS = {
    "map": ("", "the map that map_server serves, as a file; with commas, several; empty: the topic map"),
    "map_topic": ("", "topic of an OccupancyGrid, without a map"),
    "scan": ("", "topic of scans; with commas, several"),
    "odom": ("", "topic of odometry"),
    "base": ("", "base frame of the robot"),
    "odom_frame": ("", "odometry frame"),
    "namespace": ("", "namespace of the robot"),
    "frame_prefix": ("", "prefix of all frames of the robot"),
    "together_s": ("", "seconds within which scans of several topics are one"),
    "on_map": ("", "prior probability that a scan was taken on the map"),
    "usable_from": ("", "least probability of a usable scan"),
    "agree": ("", "scans that have to agree"),
    "when": ("", "start, lost or always"),
    "min_sigma": ("", "least standard deviation of initialpose, metres"),
    "min_sigma_theta": ("", "least standard deviation of its heading, radians"),
    "tf_max_age_s": ("", "seconds without scans after which publish_tf stops; 0: never"),
    "surface": ("", "depth of the walls' surfaces in the cells of map_topic; empty: estimated"),
    "hardware_id": ("", "of the diagnostics"),
    "params_file": ("", "a YAML file of parameters"),
}
FLAGS = {
    "motion": ("", "true or false: correct scans for motion"),
    "use_sim_time": ("", "true or false: use the time of /clock"),
    "publish_tf": ("", "true or false: publish the transform from the map to the odometry frame"),
}
SEVERAL = ("map", "scan")
RESPAWN_DELAY = 3.0  # s


def command(context):
    """Return the process with the arguments that are given."""
    words = ["linefix", "ros2"]
    for name in OPTIONS:
        value = LaunchConfiguration(name).perform(context)
        for one in value.split(",") if name in SEVERAL else [value]:
            if one:
                words += [f"--{name.replace('_', '-')}", one]
    for name in FLAGS:
        value = LaunchConfiguration(name).perform(context).lower()
        if value:
            words.append(f"--{'' if value in ('true', '1') else 'no-'}{name.replace('_', '-')}")
    process = ExecuteProcess(cmd=words, name="linefix", output="screen", respawn=False)
    return [process, RegisterEventHandler(OnProcessExit(target_action=process, on_exit=ended))]


def ended(event, context):
    """Start again after a crash; not after a wrong option or map, which a restart does not help."""
    if event.returncode == 0 or context.is_shutdown:
        return []
    if event.returncode in (2, 3):
        return [EmitEvent(event=Shutdown(reason="linefix: a wrong option or map, see above"))]
    return [TimerAction(period=RESPAWN_DELAY, actions=[OpaqueFunction(function=command)])]


def generate_launch_description():
    """Return what is started: the node, whose initialpose AMCL takes."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=description)
        for name, (default, description) in {**OPTIONS, **FLAGS}.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=command)])
