"""What can be broken: Fig. 4 of the paper and a plugin alone, in ROS and in a real-time layer."""

import os
import time
from collections.abc import Sequence
from pathlib import Path

from breaking.processes import REPOSITORY
from breaking.systems import MOVED, Mover, RosSystem, System, XbotSystem
from solfer.simulation import find_robot, read_bundle
from solfer.simulation.server.publications import robot_parameters

MAIN = REPOSITORY / "config" / "centauro.yaml"


def plugin(name: str) -> tuple[str, ...]:
    """Make the command of a plugin as a node of ROS."""
    return "nodes/plugin", "-p", name, "-c", str(MAIN)


def ros_figure_4(folder: Path) -> System:
    """Make three plugins as nodes: one on each part of the robot, and one that merges."""
    names = ("upper_body", "lower_body", "whole_body")
    commands = {"simulator": ("nodes/simulator",), **{name: plugin(name) for name in names}}
    parts = {"upper": Mover("upper_body", "upper_body"), "lower": Mover("lower_body", "lower_body")}
    return RosSystem(commands, folder, parts, "whole_body")


def ros_alone(folder: Path) -> System:
    """Make one plugin as a node."""
    commands = {"simulator": ("nodes/simulator",), "joint_states": plugin("joint_states")}
    return RosSystem(commands, folder, _alone("joint_states"), "joint_states")


def _alone(process: str) -> dict[str, Mover]:
    """Let the plugin `joint_states` move all of the robot."""
    return {part: Mover("joint_states", process) for part in MOVED}


def layer_file(folder: Path, plugins: Sequence[str], start: Sequence[str] = ()) -> Path:
    """Write the file of a real-time layer that starts by itself, in the ordinary scheduler, for busy machines."""
    file = folder / "layer.yaml"
    file.write_text(f"""XBotRTPlugins: {{plugins: [{", ".join(plugins)}]}}
mwoibn: {{config_file: {{file: {MAIN}}}}}
executor: {{start: [{", ".join(start or plugins)}], blend: 0.2, overruns: 1000000, schedule: {{priority: 0}}}}
""")
    return file


def _layer_commands(name: str, file: Path, watchdog: bool) -> dict[str, tuple[str, ...]]:
    place = ("--namespace", name)
    commands = {"simulator": ("nodes/xbot_simulator", *place), "xbot": ("nodes/xbot", str(file), *place)}
    return commands | ({"watchdog": ("nodes/xbot_watchdog", *place)} if watchdog else {})


def unique() -> str:
    """Make the name of a namespace of its own."""
    return f"breaking-{os.getpid()}-{time.monotonic_ns()}"


def rt_figure_4(folder: Path, watchdog: bool = True) -> System:
    """Make config/xbot_shared_control.yaml's system: the upper body's plugin in ROS, the others in the layer."""
    name, layer = unique(), ("lower_body", "whole_body")
    file = layer_file(folder, layer)
    commands = _layer_commands(name, file, watchdog) | {
        "bridge": ("nodes/xbot_bridge", str(file), "--namespace", name),
        "upper_body": plugin("upper_body"),
    }
    parts = {"upper": Mover("upper_body", "upper_body"), "lower": Mover("lower_body", "xbot")}
    describe_robot()
    return XbotSystem(commands, name, folder, layer, parts, "xbot", ("upper_body",))


def describe_robot() -> None:
    """Set the robot's parameters in ROS, as launch/xbot.launch does: the simulator of a layer knows no ROS."""
    import rospy

    for name, text in robot_parameters(read_bundle(find_robot("centauro"))).items():
        rospy.set_param(name, text)


def rt_alone(folder: Path, watchdog: bool) -> System:
    """Make one plugin in the layer, without ROS."""
    name, layer = unique(), ("joint_states",)
    commands = _layer_commands(name, layer_file(folder, layer), watchdog)
    return XbotSystem(commands, name, folder, layer, _alone("xbot"), "xbot")
