"""Table 1 of the paper, row by row: what the tests of both middlewares have in common.

Two plugins of test/data/table_1.yaml: Speaker receives and commands the simulated CENTAURO, and publishes its state;
Listener receives nothing but that. The values of Listener's Robot are compared with those of the simulation.
"""

import abc
from pathlib import Path

import numpy as np
from numpy.testing import assert_allclose

from solfer.components import Component, Port
from solfer.components.joint_states import JointStates
from solfer.numerics.rotations import quaternion_from_rotation
from solfer.plugins import Plugin

FILE = Path(__file__).parents[1] / "data" / "table_1.yaml"
WHEELS = ("wheel_1", "wheel_2", "wheel_3", "wheel_4")
WHEEL_JOINTS = tuple(f"j_{wheel}" for wheel in WHEELS)
HAND = "arm1_7"
PUSH = (1.0, -2.0, 3.0, 0.1, 0.2, -0.3)  # [N, Nm]
GRAVITY = 9.81  # [m/s^2]
KNEE_SPRING = 80000.0
"""Stiffness of the spring in a knee [Nm/rad]."""

ARM = {"j_arm1_1": 0.6, "j_arm1_2": 0.3, "j_arm1_4": -1.5}
ELBOW = "j_arm1_4"
"""A joint that carries a load in the posture `ARM` [rad]."""

ELBOW_SPRING = 6000.0
"""Stiffness of the spring in it [Nm/rad]."""

STILL = 1e-3
"""How far anything moves between two messages of a robot that stands [m, rad]."""


class Speaker(JointStates):
    """Moves joints on request, and publishes Points of the measured Robot."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.outputs |= {"hand": Port("pose"), "wheels": Port("position", len(WHEELS)), "push": Port("wrench")}
        self.outputs["push"].value[:] = PUSH

    def send(self):
        """See `Component.send`."""
        super().send()
        kinematics, hand = self.model.kinematics, self.outputs["hand"].value
        hand[:3], hand[3:] = kinematics.position(HAND), quaternion_from_rotation(kinematics.rotation(HAND))
        for wheel, position in zip(WHEELS, self.outputs["wheels"].value, strict=True):
            position[:] = kinematics.position(wheel)


class Listener(Component):
    """Receives."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.inputs |= {
            "hand": Port("pose", required=True),
            "wheels": Port("position", len(WHEELS), required=True),
            "push": Port("wrench", required=True),
        }


class Table1System(abc.ABC):
    """The simulated robot, Speaker and Listener on one middleware.

    Attributes:
        listener: The plugin that receives from the other one.
        spring: The plugin that commands the stiffness of an arm, and nothing else.
        weight: Weight of the robot [N].
    """

    listener: Plugin
    spring: Plugin
    weight: float

    @abc.abstractmethod
    def ask(self, **request) -> float:
        """Request a motion of Speaker, and return its duration [s]."""

    @abc.abstractmethod
    def run(self, duration: float) -> None:
        """Let time pass [s]."""

    @abc.abstractmethod
    def joint(self, name: str) -> tuple[float, float]:
        """Read the position and velocity of a joint in the simulation [rad, rad/s]."""

    def sag(self, joint: str, stiffness: float) -> tuple[float, float]:
        """Command the stiffness of a joint [Nm/rad]; return how far its load bends it [rad], and the load [Nm]."""
        robot, dof = self.spring.robot, self.spring.robot.dof(joint)
        robot.command["stiffness"][dof] = stiffness
        self.run(1.0)
        for _ in range(20):  # on a busy machine the plugin may hold meanwhile, and the stiffness with it
            before = self.joint(joint)[0]
            self.run(0.4)
            if abs(self.joint(joint)[0] - before) < 1e-4:
                break
        return ARM[joint] - self.joint(joint)[0], float(robot.state.torque[dof])

    def check_sag(self) -> None:
        """Check that an arm gives way as stiffness and spring say, and only where stiffness is commanded."""
        self.run(self.ask(joints=tuple(ARM), positions=tuple(ARM.values())) + 1.0)
        before = [self.joint(joint)[0] for joint in ARM if joint != ELBOW]
        own = self.spring.robot.command["stiffness"][self.spring.robot.dof(ELBOW)]  # as the lower level reports it
        soft, hard = self.sag(ELBOW, 300.0), self.sag(ELBOW, 600.0)
        after = [self.joint(joint)[0] for joint in ARM if joint != ELBOW]
        held = self.sag(ELBOW, own)
        assert abs(soft[1]) > 2.0  # [Nm]
        for (sag, torque), stiffness in ((soft, 300.0), (hard, 600.0), (held, own)):
            assert_allclose(sag, torque / stiffness + torque / ELBOW_SPRING, rtol=0.05)
        assert_allclose(after, before, atol=2e-3)

    @abc.abstractmethod
    def pose(self, link: str) -> tuple[np.ndarray, np.ndarray]:
        """Read the position [m] and orientation (x, y, z, w) of a link in the simulation."""

    @abc.abstractmethod
    def ground(self) -> tuple[np.ndarray, np.ndarray]:
        """Compute the force of the ground on the robot, shape (3,) [N], and where it acts, shape (2,) [m]."""


class Table1:
    """The rows; `system` is that of a middleware."""

    system: Table1System

    def robot(self):
        """Return the Robot of the listener."""
        return self.system.listener.robot

    def of(self, array, *joints):
        """Select the numbers of some joints."""
        return array[[self.robot().dof(joint) for joint in joints]]

    def test_table_1_row_1_positions_to_lower_level(self):
        goal = 0.2
        duration = self.system.ask(joints=("torso_yaw", "j_arm1_4"), positions=(goal, -1.5 + goal))
        self.system.run(duration + 1.0)
        assert_allclose(self.system.joint("torso_yaw")[0], goal, atol=0.02)
        assert_allclose(self.system.joint("j_arm1_4")[0], -1.5 + goal, atol=0.02)
        published = self.of(self.robot().command.position, "torso_yaw", "j_arm1_4")
        assert_allclose(published, (goal, -1.5 + goal), atol=1e-9)

    def test_stiffness_of_row_1_bends_an_arm(self):
        self.system.check_sag()

    def test_table_1_row_2_speeds_to_lower_level(self):
        speeds = (1.0, -1.0, 1.0, -1.0)
        self.system.ask(joints=WHEEL_JOINTS, velocities=speeds)
        self.system.run(1.5)
        turning = [self.system.joint(wheel)[1] for wheel in WHEEL_JOINTS]
        published = self.of(self.robot().command.velocity, *WHEEL_JOINTS)
        self.system.ask(joints=WHEEL_JOINTS, velocities=(0.0,) * 4)
        self.system.run(1.5)
        assert_allclose(turning, speeds, atol=0.05)
        assert_allclose(published, speeds, atol=1e-9)
        assert_allclose([self.system.joint(wheel)[1] for wheel in WHEEL_JOINTS], 0.0, atol=0.02)

    def test_table_1_row_3_state_from_lower_level(self):
        names = ("hip_yaw_1", "knee_pitch_3", "torso_yaw", "j_arm2_7")
        expected = [self.system.joint(name)[0] for name in names]
        assert np.abs(expected).max() > 0.1
        assert_allclose(self.of(self.robot().state.position, *names), expected, atol=STILL)
        loaded = ("knee_pitch_1", "knee_pitch_3")
        torque = self.of(self.robot().state.torque, *loaded)
        assert np.abs(torque).min() > 10.0  # it stands
        # seen behind the gear, a spring of a series elastic joint carries the torque of the joint
        motor, link = (self.of(state.position, *loaded) for state in (self.robot().motor, self.robot().state))
        assert_allclose(motor - link, torque / KNEE_SPRING, rtol=0.05)

    def test_table_1_row_4_floating_base(self):
        position, orientation = self.system.pose("pelvis")
        kinematics = self.robot().kinematics
        assert position[2] > 0.5
        assert_allclose(kinematics.position("pelvis"), position, atol=STILL)
        published = quaternion_from_rotation(kinematics.rotation("pelvis"))
        assert abs(np.dot(published, orientation)) > np.cos(STILL)

    def test_table_1_row_5_contact_forces(self):
        force, center = self.system.ground()
        robot, weight = self.robot(), self.system.weight
        assert_allclose(force, (0.0, 0.0, weight), atol=1e-3 * weight)
        assert_allclose(robot.contacts.forces.sum(axis=0), (0.0, 0.0, weight), atol=1e-3 * weight)
        assert_allclose(robot.contacts.forces[4:], 0.0, atol=1e-9)  # the hands are in the air
        assert robot.contacts.forces[:4, 2].min() > 0.1 * weight
        assert_allclose(robot.center_of_pressure.value[:2], center, atol=1e-3)
        assert inside(center, robot.contacts.positions[[0, 1, 3, 2], :2])

    def test_table_1_row_6_robot_points(self):
        inputs = self.system.listener.component.inputs
        position, orientation = self.system.pose(HAND)
        assert_allclose(inputs["hand"].value[:3], position, atol=STILL)
        assert abs(np.dot(inputs["hand"].value[3:], orientation)) > np.cos(STILL)
        wheels = [self.system.pose(wheel)[0] for wheel in WHEELS]
        assert_allclose(inputs["wheels"].value, wheels, atol=STILL)
        assert_allclose(inputs["push"].value, PUSH, atol=1e-12)

    def test_table_1_row_7_joint_state_between_plugins(self):
        joints = [dof for dof in self.robot().dofs if dof not in ("x", "y", "z", "rx", "ry", "rz")]
        assert len(joints) == 42
        before = self.of(self.robot().state.position, *joints).copy()
        goal = 0.2 if before[joints.index("neck_pitch")] < 0.1 else 0.0
        self.system.run(self.system.ask(joints=("neck_pitch",), positions=(goal,)) + 1.0)
        now = self.of(self.robot().state.position, *joints)
        assert abs(now - before)[joints.index("neck_pitch")] > 0.15
        assert_allclose(now, [self.system.joint(joint)[0] for joint in joints], atol=STILL)
        assert_allclose(self.of(self.robot().state.velocity, *joints), 0.0, atol=0.02)


def inside(point: np.ndarray, corners: np.ndarray) -> bool:
    """Return whether a point lies in a convex polygon with corners in their order, shape (k, 2)."""
    edges, ways = np.roll(corners, -1, axis=0) - corners, point - corners
    turns = edges[:, 0] * ways[:, 1] - edges[:, 1] * ways[:, 0]
    return bool((turns > 0.0).all() or (turns < 0.0).all())
