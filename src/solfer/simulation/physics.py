"""What the simulation requires of a physics engine, in its own words; `bullet/` has the one that there is."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from solfer.model.urdf.description import Description
from solfer.simulation.loading.wheels import NO_WHEELS, TorusWheel
from solfer.simulation.world.records import Friction

STEP = 0.001
"""Simulated time of one step of an engine [s]."""

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Colour = tuple[float, float, float, float]
Pose = tuple[Sequence[float] | np.ndarray, Sequence[float] | np.ndarray]
"""Position [m] and quaternion (x, y, z, w)."""


class ContactPoint(NamedTuple):
    """Where the world pushes a link.

    Attributes:
        link: The link.
        position: The point on the link in the world [m].
        force: Force on the link, normal and friction together, in world axes [N].
    """

    link: str
    position: Vector
    force: Vector


class ClosestPoint(NamedTuple):
    """A point of a robot that is near another body.

    Attributes:
        position: The point in the world [m].
        distance: Its distance from the other body [m]; negative in an overlap.
    """

    position: Vector
    distance: float


class CameraView(NamedTuple):
    """How a camera looks at the world.

    Attributes:
        target: The point in the middle of the picture, shape (3,) [m].
        distance: Its distance from the camera [m].
        yaw: Direction in which the camera looks, about the vertical [deg].
        pitch: Its inclination [deg], negative downwards.
        field_of_view: Vertical angle of what it sees [deg].
        size: Width and height of the picture [pixel].
    """

    target: Sequence[float]
    distance: float
    yaw: float
    pitch: float
    field_of_view: float
    size: tuple[int, int]


class Picture(NamedTuple):
    """What a camera sees.

    Attributes:
        colours: RGB, shape (height, width, 3), uint8.
        depth: Distance along the camera's axis, shape (height, width) [m].
        is_empty: Where it sees nothing, shape (height, width).
    """

    colours: np.ndarray
    depth: np.ndarray
    is_empty: np.ndarray


class JointGroup(Protocol):
    """Some joints of a robot that are driven together, in a fixed order."""

    def apply_torques(self, torques: np.ndarray) -> None:
        """Let these torques act in the next step, shape (n,) [Nm, N]."""

    def hold_speeds(self, speeds: np.ndarray, efforts: tuple[float, ...]) -> None:
        """Let motors hold speeds from the next step on, with no more than the efforts.

        Args:
            speeds: Shape (n,) [rad/s, m/s].
            efforts: Largest efforts, n of them [Nm, N]; the same tuple costs nothing again.
        """


class RobotInEngine(Protocol):
    """A robot that an engine has loaded. Links that are fixed to each other may have become one.

    Attributes:
        number: Number of its body.
        links: Links that the engine has; the base is the last.
        owner: For each link of the description, the one of `links` that it became part of.
    """

    number: int
    links: tuple[str, ...]
    owner: Mapping[str, str]

    def read_joints(self, position: np.ndarray, velocity: np.ndarray, effort: np.ndarray | None = None) -> None:
        """Write what joints do, in the order in which the robot was loaded, shape (n,) each.

        Args:
            position: Positions [rad, m].
            velocity: Velocities [rad/s, m/s].
            effort: What motors that hold a speed did in the newest step [Nm, N]; None: they are not needed.
        """

    def read_base(self, motion: np.ndarray) -> None:
        """Write what the base link does.

        Args:
            motion: Orientation (x, y, z, w), position of the link's origin in the world [m], its velocity [m/s] and the
                angular velocity [rad/s] in world axes, shape (13,).
        """

    def place_joints(self, positions: Sequence[float] | np.ndarray) -> None:
        """Put all joints somewhere, at rest [rad, m]."""

    def place_joint(self, joint: int, position: float, velocity: float) -> None:
        """Put one joint somewhere in motion [rad, m], [rad/s, m/s]."""

    def place_base(self, position: Sequence[float] | np.ndarray, orientation: Sequence[float] | np.ndarray) -> None:
        """Put the origin of a base link that moves somewhere, at rest."""

    def group(self, joints: Sequence[int]) -> JointGroup:
        """Return joints that are driven together, by their places in the order in which the robot was loaded."""

    def set_losses(self, damping: Sequence[float], friction: Sequence[float], inertia: np.ndarray) -> None:
        """Set what brakes the joints, once, before any of them is driven.

        Args:
            damping: Torque per speed of each joint [Nms/rad]; an engine may bound it, to stay stable.
            friction: Friction of each joint [Nm].
            inertia: Inertia of each joint that is free to move, as a bound may need it, shape (n,) [kg m^2].
        """

    def add_gear(self, joint: int, leader: int, ratio: float) -> None:
        """Let a joint move at `ratio` times the speed of another one."""

    def set_friction(self, link: str, coefficient: float) -> None:
        """Change the friction coefficient of a link of the description, and of all that is fixed to it."""

    def push(self, link: str, force: Sequence[float], torque: Sequence[float], position: Sequence[float]) -> None:
        """Let a wrench act on a link of the description in the next step.

        Args:
            link: The link.
            force: In world axes, shape (3,) [N].
            torque: In world axes, shape (3,) [Nm].
            position: The point in the world at which the force acts, shape (3,) [m].
        """

    def contacts(self) -> list[ContactPoint]:
        """List the points at which the world pushed the robot in the newest step."""

    def closest_points(self, body: int, reach: float, link: str | None = None) -> list[ClosestPoint]:
        """Find points that are not farther than `reach` [m] from another body: of one of `links`, or of all."""

    def box_around(self) -> tuple[np.ndarray, np.ndarray]:
        """Compute the corners of a box in world axes around all shapes, shape (3,) each [m]."""

    def center_of_mass(self) -> np.ndarray:
        """Compute the centre of mass of the whole robot in the world, shape (3,) [m]."""

    def mass(self) -> float:
        """Sum up the mass of the whole robot as the engine has it [kg]."""


class PhysicsEngine(Protocol):
    """A world with gravity along -z, in which bodies have numbers; equal calls give bitwise equal motions."""

    def load_robot(
        self,
        description: Description,
        joints: Sequence[str],
        friction: Friction,
        *,
        floats: bool,
        wheels: Mapping[str, TorusWheel] = NO_WHEELS,
    ) -> RobotInEngine:
        """Load a robot, at rest at the world's origin, without losses in its joints.

        Args:
            description: The robot.
            joints: Its moving joints, in the order in which they are read and driven.
            friction: Friction of its links.
            floats: Whether its base moves.
            wheels: Wheels by link, whose shapes stand in for those of the description in an engine that has them.

        Raises:
            SimulationError: The engine cannot take the robot.
        """

    def add_plane(self, normal: Sequence[float], friction: float) -> int:
        """Add a plane through the world's origin; return its number."""

    def add_box(self, size: Sequence[float], pose: Pose, mass: float, friction: float, colour: Colour) -> int:
        """Add a box with these edges [m]; return its number. Without mass it does not move."""

    def add_grid(self, heights: np.ndarray, spacing: float, pose: Pose, friction: float, colour: Colour) -> int:
        """Add a surface that does not move; return its number. What is below it is not solid.

        Args:
            heights: Its z at the corners of squares, rows along its x of numbers along its y, shape (n, m) [m].
            spacing: Edges of the squares [m]; each is two triangles.
            pose: Its middle, and its axes, of which z is that of the world.
            friction: Friction coefficient.
            colour: Its colour.
        """

    def add_tiles(self, size: Sequence[float], colours: Iterable[Colour]) -> list[int]:
        """Add boxes with these edges [m] that can only be seen, one for each colour; return their numbers."""

    def pose(self, body: int) -> Pose:
        """Read where a body of the world is."""

    def place(self, body: int, pose: Pose) -> None:
        """Put a body of the world somewhere; its velocity stays."""

    def stop(self, body: int) -> None:
        """Bring a body of the world to rest."""

    def set_friction(self, body: int, coefficient: float) -> None:
        """Change the friction coefficient of a body of the world."""

    def box_around(self, body: int) -> tuple[Vector, Vector]:
        """Compute the corners of a box in world axes around a body of the world [m]."""

    def step(self) -> None:
        """Advance by STEP."""

    def clear_contacts(self) -> None:
        """End the contacts of bodies that are not near each other any more."""

    def save_state(self) -> int:
        """Save where all bodies are, how they move and what touches; for `restore_state` and `remove_state`."""

    def restore_state(self, state: int) -> None:
        """Restore what was saved, even if values have become infinite since; no body may have come or gone."""

    def remove_state(self, state: int) -> None:
        """Drop what was saved."""

    def show(self, target: Iterable[float]) -> None:
        """Begin to draw in the window, with the camera on the point `target` [m]; no effect without a window."""

    def render(self, view: CameraView) -> Picture:
        """Draw what a camera sees, without a window."""

    def close(self) -> None:
        """Release the world; the engine is unusable afterwards. May be called twice."""
