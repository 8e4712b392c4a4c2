"""Wheels that are lifted and put down again, and the weight that others carry meanwhile."""

import enum
import math
from collections.abc import Sequence
from concurrent.futures import Future

import numpy as np

from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.support.polygon import SupportPolygon
from solfer.components.wheeled_motion.support.weight import WeightShift
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.support import LiftContacts, LiftReply
from solfer.points.contact.contacts import Contact


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
        wheels: The wheels.
        references: What is desired of them.
        shift: Moves the base over them.
        polygon: The support polygon.
        holding: What keeps the material of each wheel from moving; empty: nothing does.
        margin: Margin of the centre of mass in the polygon of the others with which a wheel is lifted [m].

    Attributes:
        phase: What is done at present.
        shift: As above.
        polygon: As above.
        margin: As above; may be set.
    """

    TIMEOUT = 120.0
    """Longest time until a wheel is lifted, or carries again [s]."""

    def __init__(
        self,
        wheels: DrivenWheels,
        references: References,
        shift: WeightShift,
        polygon: SupportPolygon,
        holding: Sequence[Contact],
        *,
        margin: float,
    ):
        self._wheels = wheels
        self._references = references
        self.shift = shift
        self.polygon = polygon
        self._holding = tuple(holding)
        self.margin = margin
        self._ground = np.zeros(len(wheels.links))
        self._requested: list[int] = []
        self._answers: list[Future[LiftReply]] = []
        self.phase = Phase.NONE
        self._waited = self._period = 0.0
        self._rounds = 0

    def start(self) -> None:
        """Begin with what is lifted."""
        self.shift.start()
        self.stop()

    def stop(self) -> None:
        """Leave all as it is: what is in progress is not carried out."""
        self._end("the plugin stopped meanwhile")

    def lift(self, request: LiftContacts) -> "Future[LiftReply]":
        """Lift wheels, or put them down again; nothing changes if it cannot be done. The answer comes at the end.

        Raises:
            UnknownName: A contact is not tracked.
            ComponentError: Too few wheels would carry the robot, the Robot is a part of it, or another request
                is in progress.
        """
        names = [wheel.name for wheel in self._wheels.contacts]
        for name in request.contacts:
            if name not in names:
                raise UnknownName("tracked contact", name, names, expected="a contact of the group `track`")
        lifted = self._references.lifted
        requested = [names.index(name) for name in request.contacts or names]
        answer: Future[LiftReply] = Future()
        if not request.lifted:
            self._give_back(requested, answer)
            return answer
        left = len(lifted) - len({*requested, *np.flatnonzero(lifted).tolist()})
        if left < 3:
            raise ComponentError(f"{left} wheels would carry the robot", expected="3 or more")
        if not self._wheels.is_whole:
            raise ComponentError(
                "masses of a part of the robot do not show where its weight is",
                expected="a Robot of the whole robot, as `driving` has it",
            )
        if self.phase is not Phase.NONE:
            raise ComponentError(f"{self.phase.value}", expected="a request when that is done")
        self._requested = [index for index in requested if not lifted[index]]
        if not self._requested:
            answer.set_result(LiftReply())
            return answer
        self._answers.append(answer)
        self._rounds = 0
        self._begin_shift()
        return answer

    def update(self, passed: float) -> None:
        """Write the velocities of what is in progress to the references, in place of others, for a time [s]."""
        self._period = passed
        references = self._references
        is_moving = self.phase is not Phase.NONE
        references.waits = is_moving
        if not is_moving:
            return
        references.velocity[:] = 0.0
        references.angular[:] = 0.0
        references.vertex_velocity[:] = 0.0
        if self.phase is Phase.LOWER:
            self._lower()
            return
        self.shift.keep_places(passed)
        if self.phase is Phase.SETTLE:
            self._settle()
        elif self.shift.go(passed):
            if self.phase is Phase.SHIFT:
                self.phase = Phase.SETTLE
                self._waited = 0.0
            else:
                self.shift.end()
                self._end("")

    def _give_back(self, requested: list[int], answer: "Future[LiftReply]") -> None:
        """Put wheels down; a lift that is in progress is given up."""
        lifted = self._references.lifted
        if self.phase in (Phase.SHIFT, Phase.SETTLE):
            self._fail("a request to put wheels down")
        elif self.phase is Phase.NONE:
            self._requested = [index for index in requested if lifted[index]]
            if not self._requested:
                answer.set_result(LiftReply())
                return
            self.phase = Phase.LOWER
        self._answers.append(answer)

    def _begin_shift(self) -> None:
        """Let the base move to where the others carry the robot."""
        self.shift.begin(*self._lacking(self.margin))
        self.phase = Phase.SHIFT

    def _lacking(self, margin: float) -> tuple[float, float]:
        """Return the displacement of the centre of mass to where the others carry it with a margin, x and y [m]."""
        lifted = np.flatnonzero(self._references.lifted).tolist()
        return self.polygon.towards([*self._requested, *lifted], margin)

    def _settle(self) -> None:
        """Lift the wheels as soon as the others carry the robot."""
        x, y = self._lacking(self.margin - 0.01)  # [m] that may be lost meanwhile
        if math.hypot(x, y) < 1e-3:
            for index in self._requested:
                self._ground[index] = self._wheels.offsets.states[index, 2] - self._plane(index)
                self._release(index, True)
            self._end("")
            return
        self._waited += self._period
        if self._waited < 1.0:  # [s]
            return
        self._rounds += 1
        if self._rounds < 4:
            self._begin_shift()
        else:
            names = ", ".join(self._wheels.contacts[index].name for index in self._requested)
            self._fail(f"without {names} the centre of mass stays {math.hypot(x, y):.3f} m too near to an edge")

    def _lower(self) -> None:
        """Let wheels go down until they stand."""
        references = self._references
        forces = self._wheels.measure_forces()
        feels = bool(np.delete(forces, self._requested).any())
        lost = ""
        speed_limit = 0.06  # [m/s]
        near_speed = 0.02  # [m/s] within 2 cm of the ground
        for index in list(self._requested):
            height = float(references.vertices[index, 2]) - self._plane(index) - self._ground[index]
            force = float(forces[index]) * len(forces)
            # the ground is felt by 15 % of the mean force of the wheels
            if (force > 0.15 * float(forces.sum())) if feels else height < 1e-4:
                self._release(index, False)
            elif height > -0.03:  # [m] below where the ground was
                speed = speed_limit if height > 0.02 else near_speed
                references.vertex_velocity[index, 2] = -speed if feels else -min(speed, height / self._period)
                continue
            else:
                lost = f"no ground below '{self._wheels.contacts[index].name}'"
            self._requested.remove(index)
        if lost or not self._requested:
            if references.lifted.any():
                self._end(lost)
            else:
                self._go_back()

    def _plane(self, index: int) -> float:
        """Return the height of the plane of the carrying wheels at another one [m]: the robot yields, and tilts."""
        states = self._wheels.offsets.states
        carrying = ~self._references.lifted
        carrying[self._requested] = False
        corners = np.column_stack((states[carrying, :2], np.ones(int(carrying.sum()))))
        plane, *_ = np.linalg.lstsq(corners, states[carrying, 2], rcond=None)
        return float(plane @ (states[index, 0], states[index, 1], 1.0))

    def _release(self, index: int, lifted: bool) -> None:
        """Let a wheel leave the ground, or stand on it from now on."""
        references = self._references
        # on the ground neither its height nor what is across it was quite what was desired
        references.vertices[index] = self._wheels.offsets.states[index]
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
        if self.phase is Phase.SHIFT:
            self.shift.give_up()
        self.shift.begin_back()
        self.phase = Phase.BACK

    def _end(self, failure: str) -> None:
        """Answer all requests, and let other motions go on."""
        self.phase = Phase.NONE
        answers = self._answers
        self._answers = []
        for answer in answers:
            answer.set_result(LiftReply(not failure, failure))
