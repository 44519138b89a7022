"""The node with its topics: ros2 launch clearway_ros clearway.launch.py agent:=/path/bathroom.onnx image:=/camera."""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    "agent": (None, "a file that clearway export wrote, a run folder, or generalist"),
    "target": ("", "a picture file to walk to from the start"),
    "image": ("/camera/image_raw", "topic of the camera's pictures"),
    "cmd_vel": ("/cmd_vel", "topic of the base's velocities"),
    "odom": ("/odom", "topic of the base's odometry"),
    "config": (None, "a file of parameters; by default the package's own"),
}


def generate_launch_description() -> LaunchDescription:
    """The node, with its topics and parameters."""
    own = str(Path(get_package_share_directory("clearway_ros")) / "config" / "clearway.yaml")
    usual = {name: value for name, (value, _) in ARGUMENTS.items()} | {"config": own}
    declared = [
        DeclareLaunchArgument(name, description=what, **({} if usual[name] is None else {"default_value": usual[name]}))
        for name, (_, what) in ARGUMENTS.items()
    ]
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    topics = [(name, given[name]) for name in ("image", "cmd_vel", "odom")]
    topics.append(("image/compressed", [given["image"], "/compressed"]))
    node = Node(
        package="clearway_ros",
        executable="clearway_node",
        name="clearway",
        output="screen",
        parameters=[
            given["config"],
            {name: ParameterValue(given[name], value_type=str) for name in ("agent", "target")},
        ],
        remappings=topics,
    )
    return LaunchDescription([*declared, node])
