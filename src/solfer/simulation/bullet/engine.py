"""A physics engine: PyBullet."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from solfer.model.urdf.description import Description
from solfer.simulation.bullet.client import BulletClient
from solfer.simulation.bullet.robot import BulletRobot
from solfer.simulation.loading.wheels import NO_WHEELS, TorusWheel
from solfer.simulation.physics import STEP, CameraView, Colour, PhysicsEngine, Picture, Pose, Vector
from solfer.simulation.world.records import Friction

NO_SHAPE = -1
"""PyBullet's number of a shape that is not there."""


class BulletEngine(PhysicsEngine):
    """A client of PyBullet with gravity and a fixed step.

    Args:
        gui: Open PyBullet's window instead of working without one.

    Raises:
        MissingDependency: PyBullet is not installed.
        SimulationError: The world cannot be opened.
    """

    def __init__(self, gui: bool = False):
        self._world = BulletClient(gui)
        self._bullet = self._world.bullet
        self._window = gui
        if gui:  # its panels show nothing of use, and drawing while a robot is loaded takes a minute without a GPU
            for flag in (self._bullet.COV_ENABLE_GUI, self._bullet.COV_ENABLE_RENDERING):
                self._bullet.configureDebugVisualizer(flag, 0)
        self._bullet.setGravity(0.0, 0.0, -9.81)
        self._bullet.setPhysicsEngineParameter(
            fixedTimeStep=STEP, numSubSteps=0, numSolverIterations=50, deterministicOverlappingPairs=1
        )

    def load_robot(
        self,
        description: Description,
        joints: Sequence[str],
        friction: Friction,
        *,
        floats: bool,
        wheels: Mapping[str, TorusWheel] = NO_WHEELS,
    ) -> BulletRobot:
        """See `PhysicsEngine.load_robot`. Wheels have the shapes of the description: PyBullet has none of a torus."""
        return BulletRobot(self._world, description, joints, friction=friction, floats=floats)

    def add_plane(self, normal: Sequence[float], friction: float) -> int:
        """See `PhysicsEngine.add_plane`."""
        shape = self._bullet.createCollisionShape(self._bullet.GEOM_PLANE, planeNormal=normal)
        return self._add(0.0, shape, NO_SHAPE, pose=([0.0] * 3, [0.0, 0.0, 0.0, 1.0]), friction=friction)

    def add_box(self, size: Sequence[float], pose: Pose, mass: float, friction: float, colour: Colour) -> int:
        """See `PhysicsEngine.add_box`."""
        half = [edge / 2.0 for edge in size]
        bullet = self._bullet
        shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=half)
        return self._add(mass, shape, self._seen(half, colour), pose=pose, friction=friction)

    def add_grid(self, heights: np.ndarray, spacing: float, pose: Pose, friction: float, colour: Colour) -> int:
        """See `PhysicsEngine.add_grid`; PyBullet has the origin halfway between the lowest and the highest point."""
        bullet = self._bullet
        rows, columns = heights.shape
        shape = bullet.createCollisionShape(
            bullet.GEOM_HEIGHTFIELD,
            meshScale=[spacing, spacing, 1.0],
            heightfieldData=heights.T.ravel().tolist(),
            numHeightfieldRows=rows,
            numHeightfieldColumns=columns,
        )
        (x, y, z), orientation = pose
        middle = 0.5 * float(heights.min() + heights.max())
        body = self._add(0.0, shape, NO_SHAPE, pose=((x, y, z + middle), orientation), friction=friction)
        bullet.changeVisualShape(body, -1, rgbaColor=colour, textureUniqueId=-1)  # without its blue squares
        return body

    def add_tiles(self, size: Sequence[float], colours: Iterable[Colour]) -> list[int]:
        """See `PhysicsEngine.add_tiles`."""
        half = [edge / 2.0 for edge in size]
        listed = list(colours)
        shapes = {colour: self._seen(half, colour) for colour in dict.fromkeys(listed)}
        return [self._bullet.createMultiBody(0.0, NO_SHAPE, shapes[colour]) for colour in listed]

    def pose(self, body: int) -> Pose:
        """See `PhysicsEngine.pose`."""
        position, orientation = self._bullet.getBasePositionAndOrientation(body)
        return position, orientation

    def place(self, body: int, pose: Pose) -> None:
        """See `PhysicsEngine.place`."""
        self._bullet.resetBasePositionAndOrientation(body, *pose)

    def stop(self, body: int) -> None:
        """See `PhysicsEngine.stop`."""
        self._bullet.resetBaseVelocity(body, [0.0] * 3, [0.0] * 3)

    def set_friction(self, body: int, coefficient: float) -> None:
        """See `PhysicsEngine.set_friction`."""
        self._bullet.changeDynamics(body, -1, lateralFriction=coefficient)

    def box_around(self, body: int) -> tuple[Vector, Vector]:
        """See `PhysicsEngine.box_around`."""
        low, high = self._bullet.getAABB(body, -1)
        return low, high

    def step(self) -> None:
        """See `PhysicsEngine.step`."""
        self._bullet.stepSimulation()

    def clear_contacts(self) -> None:
        """See `PhysicsEngine.clear_contacts`.

        Bullet keeps the points and impulses of a contact for the next step, also when a body was put elsewhere and
        came back in between.
        """
        self._bullet.performCollisionDetection()

    def save_state(self) -> int:
        """See `PhysicsEngine.save_state`."""
        return self._bullet.saveState()

    def restore_state(self, state: int) -> None:
        """See `PhysicsEngine.restore_state`."""
        self._bullet.restoreState(state)

    def remove_state(self, state: int) -> None:
        """See `PhysicsEngine.remove_state`."""
        self._bullet.removeState(state)

    def show(self, target: Iterable[float]) -> None:
        """See `PhysicsEngine.show`."""
        if self._window:
            # distance [m], yaw and pitch [deg] of the camera at first
            self._bullet.resetDebugVisualizerCamera(2.5, 50.0, -20.0, [float(value) for value in target])
            self._bullet.configureDebugVisualizer(self._bullet.COV_ENABLE_RENDERING, 1)

    def render(self, view: CameraView) -> Picture:
        """See `PhysicsEngine.render`."""
        bullet = self._bullet
        width, height = view.size
        near = 0.05  # what is drawn, from the camera [m]
        far = 50.0
        picture = bullet.getCameraImage(
            width,
            height,
            bullet.computeViewMatrixFromYawPitchRoll(view.target, view.distance, view.yaw, view.pitch, 0.0, 2),
            bullet.computeProjectionMatrixFOV(view.field_of_view, width / height, near, far),
            lightDirection=[1.5, 1.0, 5.0],
            lightColor=[1.0, 1.0, 1.0],
            lightDistance=8.0,
            shadow=1,
            lightAmbientCoeff=0.5,
            lightDiffuseCoeff=0.55,
            lightSpecularCoeff=0.15,
            renderer=bullet.ER_TINY_RENDERER,
        )
        _, _, colours, depth, segments = picture
        normalized = np.reshape(depth, (height, width))  # from 0 in the near plane to 1 in the far one
        return Picture(
            np.array(colours, dtype=np.uint8).reshape(height, width, 4)[:, :, :3],
            near * far / (far - (far - near) * normalized),
            is_empty=np.reshape(segments, (height, width)) < 0,
        )

    def close(self) -> None:
        """See `PhysicsEngine.close`."""
        self._world.close()

    def _seen(self, half: Sequence[float], colour: Colour) -> int:
        """Make the shape of a box by which it is seen."""
        return self._bullet.createVisualShape(self._bullet.GEOM_BOX, halfExtents=half, rgbaColor=colour)

    def _add(self, mass: float, shape: int, visual: int, pose: Pose, friction: float) -> int:
        body = self._bullet.createMultiBody(mass, shape, visual, *pose)
        self._bullet.changeDynamics(
            body,
            -1,
            lateralFriction=friction,
            rollingFriction=0.0,
            spinningFriction=0.0,
            restitution=0.0,
            linearDamping=0.0,
            angularDamping=0.0,
        )
        return body
