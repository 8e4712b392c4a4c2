"""A robot that MuJoCo has loaded."""

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import SubElement

import numpy as np

from solfer.errors import SimulationError
from solfer.model.urdf.description import Description
from solfer.numerics.rotations import quaternion_from_rotation, rotation_onto
from solfer.simulation.loading.body_urdf import body_urdf
from solfer.simulation.loading.friction import coefficients
from solfer.simulation.loading.meshes import MeshReader
from solfer.simulation.loading.wheels import TorusWheel
from solfer.simulation.mujoco.motors import RIGID
from solfer.simulation.mujoco.shapes import box_around, closest_points
from solfer.simulation.mujoco.touching import BODY, LINK, ROBOT, Touching
from solfer.simulation.mujoco.world import MujocoWorld, Push
from solfer.simulation.physics import (
    STEP,
    ClosestPoint,
    ContactPoint,
    JointGroup,
    RobotInEngine,
)
from solfer.simulation.world.records import Friction

READER = MeshReader("MuJoCo", ((".obj", rb"(?m)^\s*v\s"),), converted=(".dae",))


class MujocoJoints(JointGroup):
    """Joints that are driven together.

    Args:
        world: The world.
        dofs: Their numbers in MuJoCo, shape (n,).
    """

    def __init__(self, world: MujocoWorld, dofs: np.ndarray):
        self._world = world
        self._dofs = dofs
        self._limited: tuple[object, object] = (None, None)

    def apply_torques(self, torques: np.ndarray) -> None:
        """See `JointGroup.apply_torques`."""
        self._world.data.qfrc_applied[self._dofs] = torques

    def hold_speeds(self, speeds: np.ndarray, efforts: tuple[float, ...]) -> None:
        """See `JointGroup.hold_speeds`."""
        motors = self._world.motors
        known, same = self._limited
        if known is not motors or same is not efforts:
            motors.limit(self._dofs, efforts)
            self._limited = motors, efforts
        motors.hold(self._dofs, speeds)


class MujocoRobot(RobotInEngine):
    """A tree of MuJoCo's bodies, which do not touch each other.

    Args:
        world: The world.
        description: The robot.
        joints: Its moving joints, in the order in which they are read and driven.
        friction: Friction of its links.
        floats: Whether its base moves.
        wheels: Wheels by link.
        draws: Whether it is loaded with the shapes by which it is seen.

    Raises:
        SimulationError: MuJoCo cannot load the robot, or `friction` names a link that it does not have.
    """

    def __init__(
        self,
        world: MujocoWorld,
        description: Description,
        joints: Sequence[str],
        friction: Friction,
        *,
        floats: bool,
        wheels: Mapping[str, TorusWheel],
        draws: bool,
    ):
        # imported here: its compiler takes a while to load
        from solfer.numerics.twist_transport import read_freedom

        self._read_freedom = read_freedom
        self._world = world
        self.number = len(world.bodies)
        with tempfile.TemporaryDirectory() as folder:
            urdf = body_urdf(description, floats, Path(folder), reader=READER._replace(draws=draws))
            text, assets = _with_assets(urdf.text, draws=draws)
        self.owner = urdf.owner
        of_links = coefficients(friction, urdf.owner)
        try:
            spec = self._specification(text, assets, urdf.base, floats=floats)
            turning = {link: wheels[link] for link in wheels if self.owner.get(link) == link != urdf.base}
            self._put_wheels(spec, turning)
            world.change()
            world.spec.attach(spec, prefix=ROBOT, frame=world.spec.worldbody.add_frame())
            world.compile()
        except (ValueError, world.mujoco.FatalError) as error:
            raise SimulationError(
                f"MuJoCo cannot load the robot: {str(error).strip()}",
                where=description.where,
                expected="a robot that MuJoCo can load",
            ) from error
        self._find(urdf.base, joints, floats=floats)
        world.bodies.append(BODY + urdf.base)
        for link in self.links:
            world.set_friction(BODY + link, of_links[link])

    def read_joints(self, position: np.ndarray, velocity: np.ndarray, effort: np.ndarray | None = None) -> None:
        """See `RobotInEngine.read_joints`."""
        data = self._world.data
        data.qpos.take(self._positions, out=position, mode="clip")
        data.qvel.take(self._dofs, out=velocity, mode="clip")
        if effort is not None:
            self._world.motors.effort.take(self._dofs, out=effort, mode="clip")

    def read_base(self, motion: np.ndarray) -> None:
        """See `RobotInEngine.read_base`."""
        data = self._world.data
        if self._floating is None:
            motion[:] = 0.0
            motion[3] = 1.0
        else:
            self._read_freedom(data.qpos, data.qvel, *self._floating, motion)

    def place_joints(self, positions: Sequence[float] | np.ndarray) -> None:
        """See `RobotInEngine.place_joints`."""
        data = self._world.data
        data.qpos[self._positions] = positions
        data.qvel[self._dofs] = 0.0
        self._world.motors.effort[self._dofs] = 0.0

    def place_joint(self, joint: int, position: float, velocity: float) -> None:
        """See `RobotInEngine.place_joint`."""
        data = self._world.data
        data.qpos[self._positions[joint]] = position
        data.qvel[self._dofs[joint]] = velocity

    def place_base(self, position: Sequence[float] | np.ndarray, orientation: Sequence[float] | np.ndarray) -> None:
        """See `RobotInEngine.place_base`."""
        if self._floating is None:
            return
        data = self._world.data
        place, dof = self._floating
        x, y, z, w = orientation
        data.qpos[place : place + 7] = (*position, w, x, y, z)
        data.qvel[dof : dof + 6] = 0.0

    def group(self, joints: Sequence[int]) -> MujocoJoints:
        """See `RobotInEngine.group`."""
        return MujocoJoints(self._world, self._dofs[list(joints)])

    def set_losses(self, damping: Sequence[float], friction: Sequence[float], inertia: np.ndarray) -> None:
        """See `RobotInEngine.set_losses`; damping acts at the speed of a step's end, and needs no bound."""
        self._world.change()
        for joint, damper, brake in zip(self._joints, damping, friction, strict=True):
            made = self._world.spec.joint(joint)
            made.damping[0] = damper
            made.frictionloss = brake

    def add_gear(self, joint: int, leader: int, ratio: float) -> None:
        """See `RobotInEngine.add_gear`; it connects speeds alone."""
        world = self._world
        world.change()
        made = world.spec.add_equality(
            type=world.mujoco.mjtEq.mjEQ_JOINT,
            objtype=world.mujoco.mjtObj.mjOBJ_JOINT,
            name1=self._joints[joint],
            name2=self._joints[leader],
            solref=[0.0, -1.0 / STEP],
            solimp=RIGID,
        )
        made.data[:5] = 0.0, ratio, 0.0, 0.0, 0.0

    def set_friction(self, link: str, coefficient: float) -> None:
        """See `RobotInEngine.set_friction`."""
        self._world.set_friction(BODY + self.owner[link], coefficient)

    def push(self, link: str, force: Sequence[float], torque: Sequence[float], position: Sequence[float]) -> None:
        """See `RobotInEngine.push`."""
        body = self._numbers[self.owner[link]]
        self._world.push(Push(body, np.array(force), np.array(torque), position=np.array(position)))

    def contacts(self) -> list[ContactPoint]:
        """See `RobotInEngine.contacts`."""
        return self._world.contacts()

    def closest_points(self, body: int, reach: float, link: str | None = None) -> list[ClosestPoint]:
        """See `RobotInEngine.closest_points`."""
        only = self.links if link is None else (link,)
        return closest_points(self._world, [BODY + link for link in only], self._world.bodies[body], reach=reach)

    def box_around(self) -> tuple[np.ndarray, np.ndarray]:
        """See `RobotInEngine.box_around`."""
        return box_around(self._world, [BODY + link for link in self.links])

    def center_of_mass(self) -> np.ndarray:
        """See `RobotInEngine.center_of_mass`."""
        bodies = list(self._numbers.values())
        return np.average(self._world.probe().xipos[bodies], axis=0, weights=self._world.model.body_mass[bodies])

    def mass(self) -> float:
        """See `RobotInEngine.mass`."""
        return float(self._world.model.body_mass[list(self._numbers.values())].sum())

    def _specification(self, text: str, assets: dict[str, bytes], base: str, *, floats: bool) -> Any:
        """Read a URDF, for bodies with motors, without contacts among them, with a base that is free."""
        spec = self._world.mujoco.MjSpec.from_string(text, assets=assets)
        if floats:
            spec.body(LINK + base).add_freejoint(name=FREE)
        for joint in spec.joints:
            joint.solref_limit[:] = 2.0 * STEP, 1.0
            joint.solimp_limit[:] = RIGID
            joint.solref_friction[:] = 2.0 * STEP, 1.0  # a motor has its speed after a step
            joint.solimp_friction[:] = RIGID
            joint.actfrclimited = False
        for geom in spec.geoms:
            if geom.contype:
                Touching.ROBOT.prepare(geom)
        return spec

    def _put_wheels(self, spec: Any, wheels: Mapping[str, TorusWheel]) -> None:
        """Let links touch by ellipsoids alone that roll as their wheels do."""
        for link, wheel in wheels.items():
            body = spec.body(LINK + link)
            for geom in body.geoms:
                if geom.contype:
                    spec.delete(geom)
            x, y, z, w = quaternion_from_rotation(rotation_onto(wheel.axis))
            kind = self._world.mujoco.mjtGeom.mjGEOM_ELLIPSOID
            Touching.ROBOT.prepare(body.add_geom(type=kind, size=wheel.half_axes, pos=wheel.center, quat=(w, x, y, z)))

    def _find(self, base: str, joints: Sequence[str], *, floats: bool) -> None:
        """Find the numbers of links and joints, which other bodies do not change."""
        model = self._world.model
        self._joints = [ROBOT + joint for joint in joints]
        places = [model.joint(joint).id for joint in self._joints]
        self._positions = model.jnt_qposadr[places].copy()
        self._dofs = model.jnt_dofadr[places].copy()
        free = model.joint(ROBOT + FREE).id if floats else None
        self._floating = None if free is None else (int(model.jnt_qposadr[free]), int(model.jnt_dofadr[free]))
        own = dict.fromkeys(self.owner.values())
        self.links = (*(link for link in own if link != base), base)
        self._numbers = {link: int(model.body(BODY + link).id) for link in self.links}


FREE = "the base's freedom"
"""Name of the joint of a base that floats; no joint of a URDF has it."""


def _with_assets(text: str, draws: bool) -> tuple[str, dict[str, bytes]]:
    """Read the meshes of a URDF, which it names by numbers then, and add how MuJoCo compiles it.

    Links get a prefix: MuJoCo has a body `world` of its own.
    """
    robot = ElementTree.fromstring(text)
    for link in robot.findall("link"):
        link.set("name", LINK + link.get("name", ""))
    for end in (*robot.iter("parent"), *robot.iter("child")):
        end.set("link", LINK + end.get("link", ""))
    compiler = {"fusestatic": "false", "alignfree": "false", "discardvisual": "false" if draws else "true"}
    SubElement(SubElement(robot, "mujoco"), "compiler", compiler)
    assets = {}
    for number, mesh in enumerate(robot.iter("mesh")):
        path = Path(mesh.get("filename", ""))
        name = f"{number}{path.suffix.lower()}"
        assets[name] = path.read_bytes()
        mesh.set("filename", name)
    return ElementTree.tostring(robot, encoding="unicode"), assets
