"""A wheel that steps: where it goes, and whether its leg reaches that far."""

import math
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass, field

import numpy as np

from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.errors import ComponentError, NotFinite
from solfer.interfaces.support import LiftReply, StepContact

SPEED, ACCELERATION = 0.1, 0.15
"""Largest speed of a wheel that swings [m/s], and its acceleration [m/s2]."""

FURTHEST = 1.0
"""Largest length of a step in any direction [m]."""


@dataclass
class Step:
    """A step of a wheel, which goes up, across, and down.

    Attributes:
        index: The wheel.
        displacement: To its new place, in the heading frame of the base, shape (3,) [m].
        clearance: How far it is above both places on its path [m].
        answer: Gets the answer at the end.
        start: Where the wheel left the ground, in the frame of the vertices, shape (3,) [m].
        goal: Where it is to stand, likewise.
        failure: Why it goes back; empty: it does not.
        velocity: Velocity with which it swings, shape (3,) [m/s].
        held: For how long it has not come nearer, or stays above its reference [s].
        higher: How much higher the ground was than expected [m].
    """

    index: int
    displacement: np.ndarray
    clearance: float
    answer: "Future[LiftReply]" = field(default_factory=Future)
    start: np.ndarray = field(default_factory=lambda: np.zeros(3))
    goal: np.ndarray = field(default_factory=lambda: np.zeros(3))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    failure: str = ""
    held: float = 0.0
    higher: float = 0.0

    @property
    def top(self) -> float:
        """Height of the path [m]."""
        return float(max(self.start[2], self.goal[2])) + self.clearance

    def reply(self, name: str, failure: str) -> LiftReply:
        """Make the answer for a wheel of this name: why it failed or went back, or where it stands."""
        if failure or self.failure:
            return LiftReply(False, failure or f"'{name}' stands where it stood: {self.failure}")
        if abs(self.higher) < 0.02:  # [m]
            return LiftReply()
        return LiftReply(True, f"'{name}' stands {abs(self.higher):.3f} m {'higher' if self.higher > 0 else 'lower'}")

    def begin(self, vertex: np.ndarray) -> None:
        """Leave the ground at a vertex, shape (3,) [m]."""
        self.start[:] = vertex
        self.goal[:] = vertex + self.displacement

    def turn_back(self, failure: str) -> None:
        """Go back to where the wheel came from, for a reason."""
        self.failure = failure
        self.goal[:] = self.start
        self.rest()

    def rest(self) -> None:
        """Begin another part of the path at rest."""
        self.velocity[:] = 0.0
        self.held = 0.0

    def descend(self, limit: float, period: float) -> float:
        """Return the speed with which the wheel goes down, which comes to a limit [m/s]."""
        change = ACCELERATION * period
        speed = -float(self.velocity[2])
        self.velocity[2] = -(speed + min(max(limit - speed, -change), change))
        return -float(self.velocity[2])

    def move(self, x: float, y: float, z: float = 0.0) -> None:
        """Move with the frame of the vertices, in which the world has moved [m]."""
        for place in (self.start, self.goal):
            place += (x, y, z)

    def swing(self, vertex: np.ndarray, period: float) -> float:
        """Find the velocity of the vertex, shape (3,) [m]; return how far it has to go across [m]."""
        velocity = self.velocity
        up = self.top - float(vertex[2])
        across = self.goal[:2] - vertex[:2]
        distance = math.hypot(*across)
        speed = math.sqrt(velocity.dot(velocity)) + ACCELERATION * period
        velocity[:] = 0.0
        if up > 1e-3 and distance > 1e-3:  # [m]
            velocity[2] = _braking(up, speed, period)
        else:
            velocity[:2] = across * (_braking(distance, speed, period) / max(distance, 1e-9))
        return distance

    def feels(self, above: float, height: float, period: float) -> bool:
        """Find out whether the wheel stands, since it stays above its reference, near the ground or not.

        Args:
            above: How far it is above its reference [m].
            height: How high that is above the ground that is expected [m].
            period: Time since it was called before [s].
        """
        return self.holds(above > (0.008 if height < 0.03 else 0.02), period)  # [m]

    def holds(self, is_pushed: bool, period: float) -> bool:
        """Return whether the ground has pushed the wheel for 0.1 s: a robot on three wheels rocks."""
        self.held = self.held + period if is_pushed else 0.0
        return self.held > 0.1


def _braking(distance: float, speed: float, period: float) -> float:
    """Limit a speed to one with which a wheel comes to rest after a distance [m]."""
    return min(speed, SPEED, math.sqrt(2.0 * ACCELERATION * distance), distance / period)


class LegReach:
    """Finds out whether legs reach where their wheels are to step, by joints alone, the base at rest.

    Newton's method moves the joints of a leg within their bounds, so that its wheel comes to each place of the path and
    tilts as little as possible.

    Args:
        wheels: The wheels.
        moved: DoFs that the component moves, shape (m,).
    """

    def __init__(self, wheels: DrivenWheels, moved: np.ndarray):
        self._wheels = wheels
        self._kinematics = wheels.kinematics.twin()
        self._legs = np.array(list(wheels.find_legs(moved).values()))

    def check(self, step: Step, position: np.ndarray, shift: tuple[float, float]) -> None:
        """Check all of its path.

        Args:
            step: The step.
            position: Position of the robot, shape (n,).
            shift: By how much the base moves before, x and y in the world [m].

        Raises:
            ComponentError: The leg does not reach a place of it.
        """
        kinematics = self._kinematics
        wheel = self._wheels.contacts[step.index]
        q = position.copy()
        kinematics.update(q)
        begin = kinematics.position(wheel.end_frame).copy()
        upright = kinematics.rotation(wheel.end_frame).copy()
        q[:2] += shift
        kinematics.update(q)
        dofs = np.intersect1d(self._legs, kinematics.attachment(wheel.end_frame).moved)
        for name, place in self._places(step):
            missing, tilt = self._go(wheel.end_frame, begin + place, upright, q=q, dofs=dofs)
            if missing > 0.005 or tilt > 0.4:  # [m], [rad]
                ends = [kinematics.dofs[dof] for dof in dofs if self._is_at_bound(dof, q)]
                raise ComponentError(
                    f"'{wheel.name}' does not reach {name}: "
                    + (f"{missing:.3f} m are missing" if missing > 0.005 else f"its wheel would tilt by {tilt:.2f} rad")
                    + (f", {' and '.join(ends)} at the bound" if ends else ""),
                    where="step",
                    expected="a place that is nearer, or another posture",
                )

    def _places(self, step: Step) -> Iterator[tuple[str, np.ndarray]]:
        """Yield the places of the path, and how far from the begin it is in the world, shape (3,) [m]."""
        heading = self._wheels.offsets.heading
        x, y, z = step.displacement.tolist()
        across = np.array(
            (
                math.cos(heading) * x - math.sin(heading) * y,
                math.sin(heading) * x + math.cos(heading) * y,
                0.0,
            )
        )
        up = np.array((0.0, 0.0, 1.0))
        top = (max(z, 0.0) + step.clearance) * up
        yield "the height of its path", top
        yield "half of its path", top + 0.5 * across
        yield "the end of its path", top + across
        yield "its new place", z * up + across

    def _go(
        self, link: str, goal: np.ndarray, upright: np.ndarray, *, q: np.ndarray, dofs: np.ndarray
    ) -> tuple[float, float]:
        """Move a leg so that its wheel comes to a place; return what is missing [m], and how far it tilts [rad]."""
        kinematics = self._kinematics
        lower = kinematics.lower_position[dofs]
        upper = kinematics.upper_position[dofs]
        weight = 0.05  # of a tilt [m/rad]
        damping = 1e-3
        for _ in range(100):
            error = goal - kinematics.position(link)
            turn = kinematics.rotation(link) @ upright.T
            tilt = 0.5 * np.array((turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2]))
            rows = kinematics.jacobian(link)[:5, dofs]
            rows[3:] *= weight
            desired = np.append(error, weight * tilt)
            change = rows.T @ np.linalg.solve(rows @ rows.T + damping * np.eye(5), desired)
            before = q[dofs]
            q[dofs] = np.clip(before + np.clip(change, -0.2, 0.2), lower, upper)
            kinematics.update(q)
            if np.abs(q[dofs] - before).max() < 1e-4:
                break
        return float(np.linalg.norm(goal - kinematics.position(link))), float(np.hypot(*tilt))

    def _is_at_bound(self, dof: int, q: np.ndarray) -> bool:
        kinematics = self._kinematics
        return min(q[dof] - kinematics.lower_position[dof], kinematics.upper_position[dof] - q[dof]) < 1e-3


class LoadBalance:
    """Lets wheels on steps share the weight: on stiff legs they stand like a table, which wobbles on two of four.

    A wheel that carries more than the forces of least squares, which the weight determines, goes up, another down, at
    1 cm/s for the mean force. On fewer than four wheels there is nothing to share.

    Args:
        wheels: The wheels.
        lifted: Which of them are lifted; live, shape (k,).
        rates: Desired velocities of the wheels' material at the ground, x, y, z of each; live, shape (3 k,) [m/s].
    """

    def __init__(self, wheels: DrivenWheels, lifted: np.ndarray, rates: np.ndarray):
        self._wheels = wheels
        self._lifted = lifted
        self._rates = rates[2::3]

    def update(self) -> None:
        """Write the vertical velocities of this cycle."""
        self._rates[:] = 0.0
        carrying = ~self._lifted
        forces = self._wheels.measure_forces()[carrying]
        mean = float(forces.mean())
        if len(forces) < 4 or mean < 1.0:  # [N]
            return
        places = self._wheels.offsets.states[carrying, :2]
        arms = np.column_stack((np.ones(len(forces)), places - places.mean(axis=0)))
        needed, *_ = np.linalg.lstsq(arms, forces, rcond=None)
        speed = 0.01  # [m/s]
        self._rates[carrying] = speed * np.clip((forces - arms @ needed) / mean, -1.0, 1.0)

    def rest(self) -> None:
        """Leave heights as they are."""
        self._rates[:] = 0.0


class Stepping:
    """What steps need beside lifts.

    Args:
        reach: How far legs reach.
        balance: How wheels on steps share the weight.

    Attributes:
        reach, balance: As above.
        step: The step in progress; None: there is none.
        is_uneven: Whether a wheel has stepped; also after a new start, which may be on a block.
    """

    def __init__(self, reach: LegReach, balance: LoadBalance):
        self.reach = reach
        self.balance = balance
        self.step: Step | None = None
        self.is_uneven = False


def step_of(request: StepContact, index: int) -> Step:
    """Make the step of a wheel that a request describes.

    Raises:
        NotFinite: A number is not finite.
        ComponentError: It is too long, or too low on its path.
    """
    place = request.ahead, request.left, request.up
    if not all(map(math.isfinite, (*place, request.clearance))):
        raise NotFinite("a number that is not finite", where="step", expected="finite numbers")
    if max(map(abs, place)) > FURTHEST or not 0.0 <= request.clearance <= FURTHEST:
        raise ComponentError(
            f"a step by {place[0]:g} {place[1]:g} {place[2]:g} m with a clearance of {request.clearance:g} m",
            where="step",
            expected=f"up to {FURTHEST:g} m each, and a clearance from 0",
        )
    return Step(index, np.array(place), request.clearance or 0.05)
