"""Wheels that are lifted and put down again, and the weight that others carry meanwhile."""

import enum
import math
from collections.abc import Callable, Sequence
from concurrent.futures import Future

import numpy as np

from solfer.components.gravity_compensation import LiftContacts, LiftReply
from solfer.components.wheeled_motion.points import RollingOffsets
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.support.polygon import SupportPolygon
from solfer.errors import ComponentError, UnknownName
from solfer.numerics.planar_move import PlanarMove
from solfer.points.contact.contacts import Contact

CARRYING = 3
"""Fewest wheels that stay on the ground."""

SPEED, ACCELERATION = 0.06, 0.12
"""Of the base where it shifts the weight, and of wheels that are put down [m/s, m/s2]."""

TOUCH = 0.02
"""Speed of a wheel near the ground [m/s]."""

NEAR = 0.02
"""How far above the ground a wheel is near it [m]."""

DEEP = 0.03
"""How far below where the ground was a wheel looks for it, where forces are measured [m]."""

PUSH = 0.15
"""Share of the weight of one wheel with which the ground is felt, of the mean of all."""

WORSE = 0.01
"""How much less than it was to be the margin may be when a wheel is lifted [m]."""

PATIENCE, ROUNDS = 1.0, 4
"""Time in which the robot settles with its weight shifted [s], and how often the weight is shifted at most."""

SLOWEST = 0.05
"""Least pace by which velocities of vertices make up for the pace."""

TIMEOUT = 120.0
"""Longest time until a wheel is lifted, or carries again [s]."""


class Phase(enum.Enum):
    """What is done for wheels that are to be lifted or to carry again."""

    NONE = ""
    SHIFT = "the weight is shifted"
    SETTLE = "the robot settles with its weight shifted"
    LOWER = "wheels are put down"
    BACK = "the weight goes back"


class Lifting:
    """Lifts wheels, whose vertices are free then, and puts them down again.

    First the base moves over its wheels until the centre of mass is inside the polygon of the others. A wheel that is
    put down goes down until the ground pushes it, where contacts of the Robot receive forces, else to where the ground
    was; then the base moves back. Meanwhile no other motion goes on.

    Args:
        names: Names of the wheels' contacts.
        holding: What keeps the material of each wheel from moving; empty: nothing does.
        offsets: The vertices.
        references: What is desired of them.
        polygon: The support polygon.
        base_velocity: Returns how fast the base's link is commanded to move in the world, x and y [m/s].
        forces: Returns the vertical forces of the ground on the wheels, shape (m,) [N]; zeros where none are measured.
        margin: Margin of the centre of mass in the polygon of the others with which a wheel is lifted [m].
        is_whole: Whether the centre of mass in the polygon is that of the whole robot.

    Attributes:
        phase: What is done at present.
        polygon: The support polygon.
        margin: As above; may be set.
        goal: Where the base goes, or went, to shift the weight, x and y in the world, shape (2,) [m].
    """

    def __init__(
        self,
        names: Sequence[str],
        holding: Sequence[Contact],
        offsets: RollingOffsets,
        references: References,
        polygon: SupportPolygon,
        base_velocity: Callable[[], np.ndarray],
        forces: Callable[[], np.ndarray],
        margin: float,
        is_whole: bool,
    ):
        self._names = tuple(names)
        self._indices = {name: index for index, name in enumerate(names)}
        self._holding = tuple(holding)
        self._offsets = offsets
        self._references = references
        self.polygon = polygon
        self.margin = margin
        self._is_whole = is_whole
        self._base_velocity = base_velocity
        self._forces = forces
        self._ground, self._shift, self.goal, self._left, self._moved = np.zeros(len(names)), *np.zeros((4, 2))
        self._asked: list[int] = []
        self._answers: list[Future[LiftReply]] = []
        self.phase = Phase.NONE
        self._speed = self._waited = self._period = 0.0
        self._rounds = 0

    def start(self) -> None:
        """Begin with what is lifted."""
        self._shift[:] = self._moved[:] = 0.0
        self.stop()

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped."""
        move.move(self.goal)

    def stop(self) -> None:
        """Leave all as it is: what is under way is not carried out."""
        self._end("the plugin stopped meanwhile")

    def lift(self, request: LiftContacts) -> "Future[LiftReply]":
        """Lift wheels, or put them down again; nothing changes if it cannot be done. The answer comes at the end.

        Raises:
            UnknownName: A contact is not tracked.
            ComponentError: Too few wheels would carry the robot, the Robot is a part of it, or another request
                is under way.
        """
        for name in request.contacts:
            if name not in self._indices:
                raise UnknownName("tracked contact", name, self._indices, expected="a contact of the group `track`")
        lifted = self._references.lifted
        asked = [self._indices[name] for name in request.contacts or self._indices]
        answer: Future[LiftReply] = Future()
        if not request.lifted:
            self._give_back(asked, answer)
            return answer
        left = len(lifted) - len({*asked, *np.flatnonzero(lifted).tolist()})
        if left < CARRYING:
            raise ComponentError(f"{left} wheels would carry the robot", expected=f"{CARRYING} or more")
        if not self._is_whole:
            raise ComponentError(
                "masses of a part of the robot do not show where its weight is",
                expected="a Robot of the whole robot, as `driving` has it",
            )
        if self.phase is not Phase.NONE:
            raise ComponentError(f"{self.phase.value}", expected="a request when that is done")
        self._asked = [index for index in asked if not lifted[index]]
        if not self._asked:
            answer.set_result(LiftReply())
            return answer
        self._answers.append(answer)
        way = self.polygon.towards([*self._asked, *np.flatnonzero(lifted).tolist()], self.margin)
        self._rounds = 0
        self._begin(Phase.SHIFT, *way)
        return answer

    def update(self, passed: float) -> None:
        """Write the velocities of what is under way to the references, in place of others, for a time [s]."""
        self._period = passed
        references = self._references
        references.waits = self.phase is not Phase.NONE
        if not references.waits:
            return
        references.velocity[:] = 0.0
        references.turn[:] = 0.0
        references.vertex_velocity[:] = 0.0
        if self.phase is Phase.LOWER:
            self._lower()
            return
        self._keep_places()
        if self.phase is Phase.SETTLE:
            self._settle()
        elif self._go():
            if self.phase is Phase.SHIFT:
                self.phase = Phase.SETTLE
                self._waited = 0.0
            else:
                references.vertices[:, :2] += self._moved
                self._shift[:] = self._moved[:] = 0.0
                self._end("")

    def _keep_places(self) -> None:
        """Let vertices stay where they are while the base moves over them."""
        references = self._references
        back = self._seen(self._base_velocity()) / max(references.pace, SLOWEST)
        references.vertex_velocity[:, :2] = -back
        self._moved += self._period * references.pace * back

    def _give_back(self, asked: list[int], answer: "Future[LiftReply]") -> None:
        """Put wheels down; a lift that is under way is given up."""
        lifted = self._references.lifted
        if self.phase in (Phase.SHIFT, Phase.SETTLE):
            self._fail("a request to put wheels down")
        elif self.phase is Phase.NONE:
            self._asked = [index for index in asked if lifted[index]]
            if not self._asked:
                answer.set_result(LiftReply())
                return
            self.phase = Phase.LOWER
            self._speed = 0.0
        self._answers.append(answer)

    def _begin(self, phase: Phase, x: float, y: float) -> None:
        """Let the base move over its wheels by a way in the world [m]."""
        position = self._references.position
        self.goal[:] = position[0] + x, position[1] + y
        self._shift += self._seen(np.array((x, y)))
        self.phase = phase
        self._speed = 0.0

    def _go(self) -> bool:
        """Move the base over its wheels towards its goal; True when it is there."""
        references = self._references
        np.subtract(self.goal, references.position[:2], out=self._left)
        left = math.hypot(*self._left)
        if left < 1e-6:
            return True
        step = ACCELERATION * self._period
        self._speed = min(SPEED, self._speed + step, max(step, math.sqrt(2.0 * ACCELERATION * left) - step))
        speed = min(self._speed, left / self._period)
        np.multiply(self._left, speed / left, out=references.velocity[:2])
        return False

    def _settle(self) -> None:
        """Lift the wheels as soon as the others carry the robot."""
        lifted = np.flatnonzero(self._references.lifted).tolist()
        x, y = self.polygon.towards([*self._asked, *lifted], self.margin - WORSE)
        if math.hypot(x, y) < 1e-3:
            for index in self._asked:
                self._ground[index] = self._offsets.states[index, 2] - self._plane(index)
                self._release(index, True)
            self._end("")
            return
        self._waited += self._period
        if self._waited < PATIENCE:
            return
        self._rounds += 1
        if self._rounds < ROUNDS:
            self._begin(Phase.SHIFT, *self.polygon.towards([*self._asked, *lifted], self.margin))
        else:
            names = ", ".join(self._names[index] for index in self._asked)
            self._fail(f"without {names} the centre of mass stays {math.hypot(x, y):.3f} m too near to an edge")

    def _lower(self) -> None:
        """Let wheels go down until they stand."""
        references = self._references
        forces = self._forces()
        feels = bool(np.delete(forces, self._asked).any())
        lost = ""
        for index in list(self._asked):
            height = float(references.vertices[index, 2]) - self._plane(index) - self._ground[index]
            force = float(forces[index]) * len(forces)
            if (force > PUSH * float(forces.sum())) if feels else height < 1e-4:
                self._release(index, False)
            elif height > -DEEP:
                speed = SPEED if height > NEAR else TOUCH
                references.vertex_velocity[index, 2] = -speed if feels else -min(speed, height / self._period)
                continue
            else:
                lost = f"no ground below '{self._names[index]}'"
            self._asked.remove(index)
        if lost or not self._asked:
            if references.lifted.any():
                self._end(lost)
            else:
                self._go_back()

    def _plane(self, index: int) -> float:
        """Return the height of the plane of the carrying wheels at another one [m]: the robot gives way, and tilts."""
        states = self._offsets.states
        carrying = ~self._references.lifted
        carrying[self._asked] = False
        corners = np.column_stack((states[carrying, :2], np.ones(int(carrying.sum()))))
        plane, *_ = np.linalg.lstsq(corners, states[carrying, 2], rcond=None)
        return float(plane @ (states[index, 0], states[index, 1], 1.0))

    def _release(self, index: int, lifted: bool) -> None:
        """Let a wheel leave the ground, or stand on it from now on."""
        references = self._references
        # on the ground neither its height nor what is across it was quite what was desired
        references.vertices[index] = self._offsets.states[index]
        references.lifted[index] = lifted
        if self._holding:
            self._holding[index].active = not lifted

    def _fail(self, why: str) -> None:
        """Give a lift up, and go back."""
        for answer in self._answers:
            answer.set_result(LiftReply(False, f"not lifted: {why}"))
        self._answers = []
        self._go_back()

    def _go_back(self) -> None:
        """Let the weight go back, unless other wheels are lifted."""
        references = self._references
        if references.lifted.any():
            self._end("")
            return
        if self.phase is Phase.SHIFT:  # the rest of the way was not gone
            self._shift += self._seen(references.position[:2] - self.goal)
        cos = math.cos(references.heading)
        sin = math.sin(references.heading)
        x, y = self._shift.tolist()
        self._begin(Phase.BACK, sin * y - cos * x, -sin * x - cos * y)

    def _seen(self, way: np.ndarray) -> np.ndarray:
        """Return a way in the world as seen from the heading [m]."""
        cos = math.cos(self._references.heading)
        sin = math.sin(self._references.heading)
        x, y = way.tolist()
        return np.array((cos * x + sin * y, cos * y - sin * x))

    def _end(self, failure: str) -> None:
        """Answer all who wait, and let other motions go on."""
        self.phase = Phase.NONE
        self._speed = 0.0
        answers = self._answers
        self._answers = []
        for answer in answers:
            answer.set_result(LiftReply(not failure, failure))
