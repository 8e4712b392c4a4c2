"""A physics engine: MuJoCo."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from solfer.errors import SimulationError
from solfer.model.urdf.description import Description
from solfer.numerics.rotations import quaternion_from_rotation, rotation_onto
from solfer.simulation.loading.wheels import NO_WHEELS, TorusWheel
from solfer.simulation.mujoco.drawing import SEEN, MujocoCamera
from solfer.simulation.mujoco.robot import MujocoRobot
from solfer.simulation.mujoco.shapes import box_around
from solfer.simulation.mujoco.touching import Touching
from solfer.simulation.mujoco.world import MujocoWorld, SavedState
from solfer.simulation.physics import CameraView, Colour, PhysicsEngine, Picture, Pose, Vector
from solfer.simulation.world.records import Friction


class MujocoEngine(PhysicsEngine):
    """A world of MuJoCo with gravity and a fixed step.

    Args:
        gui: Refused: what is installed of MuJoCo has no window.
        draws: Load the shapes by which robots are seen.

    Raises:
        MissingDependency: MuJoCo is not installed.
        SimulationError: A window is asked for.
    """

    def __init__(self, gui: bool = False, draws: bool = False):
        if gui:
            raise SimulationError("MuJoCo has no window here", expected="the page of `solfer view`, or PyBullet")
        self._world = MujocoWorld()
        self._bodies = self._world.bodies
        self._camera = MujocoCamera(self._world)
        self._draws = draws
        if draws:
            self._camera.light()
        self._states: dict[int, SavedState] = {}
        self._saved = 0

    def load_robot(
        self,
        description: Description,
        joints: Sequence[str],
        friction: Friction,
        *,
        floats: bool,
        wheels: Mapping[str, TorusWheel] = NO_WHEELS,
    ) -> MujocoRobot:
        """See `PhysicsEngine.load_robot`."""
        return MujocoRobot(self._world, description, joints, friction, floats=floats, wheels=wheels, draws=self._draws)

    def add_plane(self, normal: Sequence[float], friction: float) -> int:
        """See `PhysicsEngine.add_plane`."""
        pose = (0.0, 0.0, 0.0), quaternion_from_rotation(rotation_onto(normal))
        return self._add(pose, friction, type=self._mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0))

    def add_box(self, size: Sequence[float], pose: Pose, mass: float, friction: float, colour: Colour) -> int:
        """See `PhysicsEngine.add_box`."""
        return self._add(pose, friction, mass=mass, **self._box(size, colour))

    def add_grid(self, heights: np.ndarray, spacing: float, pose: Pose, friction: float, colour: Colour) -> int:
        """See `PhysicsEngine.add_grid`. MuJoCo begins at the lowest point, and has a plate below it."""
        rows, columns = heights.shape
        name = f"grid {len(self._bodies)}"
        lowest = float(heights.min())
        height = max(float(heights.max()) - lowest, 1e-6)  # [m]; MuJoCo wants one, also where all is level
        plate = 0.1  # [m]; what sinks in by more than half of it comes out below
        half = 0.5 * spacing * (rows - 1), 0.5 * spacing * (columns - 1)
        self._world.spec.add_hfield(
            name=name, size=(*half, height, plate), nrow=columns, ncol=rows, userdata=heights.T.ravel()
        )
        kind = self._mujoco.mjtGeom.mjGEOM_HFIELD
        return self._add(pose, friction, type=kind, hfieldname=name, pos=(0.0, 0.0, lowest), rgba=colour, group=SEEN)

    def add_tiles(self, size: Sequence[float], colours: Iterable[Colour]) -> list[int]:
        """See `PhysicsEngine.add_tiles`."""
        pose = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
        return [self._add(pose, **self._box(size, colour)) for colour in colours]

    def pose(self, body: int) -> Pose:
        """See `PhysicsEngine.pose`."""
        data = self._world.probe()
        place = data.body(self._bodies[body])
        w, x, y, z = place.xquat.tolist()
        return tuple(place.xpos.tolist()), (x, y, z, w)

    def place(self, body: int, pose: Pose) -> None:
        """See `PhysicsEngine.place`."""
        position, (x, y, z, w) = pose
        model = self._world.model
        part = model.body(self._bodies[body])
        if part.dofnum[0]:
            address = int(model.jnt_qposadr[part.jntadr[0]])
            self._world.data.qpos[address : address + 7] = (*position, w, x, y, z)
        else:
            part.pos[:] = position
            part.quat[:] = w, x, y, z

    def stop(self, body: int) -> None:
        """See `PhysicsEngine.stop`."""
        part = self._world.model.body(self._bodies[body])
        dof = int(part.dofadr[0])
        self._world.data.qvel[dof : dof + int(part.dofnum[0])] = 0.0

    def set_friction(self, body: int, coefficient: float) -> None:
        """See `PhysicsEngine.set_friction`."""
        self._world.set_friction(self._bodies[body], coefficient)

    def box_around(self, body: int) -> tuple[Vector, Vector]:
        """See `PhysicsEngine.box_around`."""
        low, high = box_around(self._world, [self._bodies[body]])
        return tuple(low.tolist()), tuple(high.tolist())

    def step(self) -> None:
        """See `PhysicsEngine.step`."""
        self._world.step()

    def clear_contacts(self) -> None:
        """See `PhysicsEngine.clear_contacts`."""
        self._world.forget_contacts()

    def save_state(self) -> int:
        """See `PhysicsEngine.save_state`."""
        self._saved += 1
        self._states[self._saved] = self._world.save()
        return self._saved

    def restore_state(self, state: int) -> None:
        """See `PhysicsEngine.restore_state`."""
        self._world.restore(self._states[state])

    def remove_state(self, state: int) -> None:
        """See `PhysicsEngine.remove_state`."""
        del self._states[state]

    def show(self, target: Iterable[float]) -> None:
        """See `PhysicsEngine.show`."""

    def render(self, view: CameraView) -> Picture:
        """See `PhysicsEngine.render`."""
        return self._camera.draw(view)

    def close(self) -> None:
        """See `PhysicsEngine.close`."""
        self._states.clear()
        self._camera.close()

    def _add(self, pose: Pose, friction: float | None = None, **shape: Any) -> int:
        """Add a body of one shape; without friction it can only be seen, without mass it does not move."""
        world = self._world
        world.change()
        position, (x, y, z, w) = pose
        name = f"body {len(self._bodies)}"
        body = world.spec.worldbody.add_body(name=name, pos=position, quat=(w, x, y, z))
        if shape.get("mass"):
            body.add_freejoint()
        made = body.add_geom(**shape)
        if friction is None:
            made.contype = made.conaffinity = 0
        else:
            Touching.WORLD.prepare(made)
            world.set_friction(name, friction)
        self._bodies.append(name)
        return len(self._bodies) - 1

    def _box(self, size: Sequence[float], colour: Colour) -> dict[str, Any]:
        """Describe a box that is seen."""
        half = [edge / 2.0 for edge in size]
        return {"type": self._mujoco.mjtGeom.mjGEOM_BOX, "size": half, "rgba": colour, "group": SEEN}

    @property
    def _mujoco(self) -> Any:
        return self._world.mujoco
