"""Wheels that are lifted and put down again, and the weight that others carry meanwhile."""

import enum
import math
from collections.abc import Sequence
from concurrent.futures import Future

import numpy as np

from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.support.polygon import SupportPolygon
from solfer.components.wheeled_motion.support.step import Step, Stepping, step_of
from solfer.components.wheeled_motion.support.weight import WeightShift
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.support import LiftContacts, LiftReply, StepContact
from solfer.numerics.planar_move import PlanarMove
from solfer.points.contact.contacts import Contact

SWAY = 0.03
"""What a robot on three wheels sways while a wheel swings [m]."""


class Phase(enum.Enum):
    """What is done for wheels that are to be lifted or to carry again."""

    NONE = ""
    SHIFT = "the weight is shifted"
    SETTLE = "the robot settles with its weight shifted"
    SWING = "a wheel steps"
    LOWER = "wheels are put down"
    BACK = "the weight goes back"


class Lifting:
    """Lifts wheels, whose vertices are free then, and puts them down again.

    First the base moves over its wheels until the centre of mass is inside the polygon of the others. A wheel that is
    put down goes down until the ground pushes it, where contacts of the Robot receive forces, else to where the ground
    was; then the base moves back. Meanwhile no other motion goes on. A wheel that steps is lifted, swings and is put
    down elsewhere; where something is in its way, or no ground below, it goes back.

    Args:
        wheels: The wheels.
        references: What is desired of them.
        shift: Moves the base over them.
        polygon: The support polygon.
        holding: What keeps the material of each wheel from moving; empty: nothing does.
        stepping: What steps need besides.
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
        stepping: Stepping,
        margin: float,
    ):
        self._wheels = wheels
        self._references = references
        self.shift = shift
        self.polygon = polygon
        self._holding = tuple(holding)
        self._stepping = stepping
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
        self._stepping.balance.rest()

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
        lifted = self._references.lifted
        requested = self._find(request.contacts)
        answer: Future[LiftReply] = Future()
        if not request.lifted:
            self._give_back(requested, answer)
            return answer
        self._check_lift(requested)
        self._requested = [index for index in requested if not lifted[index]]
        if not self._requested:
            answer.set_result(LiftReply())
            return answer
        self._answers.append(answer)
        self._rounds = 0
        self._begin_shift()
        return answer

    def step(self, request: StepContact) -> "Future[LiftReply]":
        """Let a wheel stand elsewhere; nothing changes if it cannot be done. The answer comes at the end.

        Raises:
            UnknownName: The contact is not tracked.
            NotFinite: A number is not finite.
            ComponentError: It cannot be lifted, see `lift`, is lifted, or its leg does not reach there.
        """
        (index,) = self._find((request.contact,))
        step = step_of(request, index)
        self._check_lift([index])
        if self._references.lifted[index]:
            raise ComponentError(f"'{request.contact}' is lifted", where="step", expected="a wheel that stands")
        self._requested = [index]
        shift = self._lacking(self.margin + SWAY)
        self._stepping.reach.check(step, self._wheels.position, shift)
        self._stepping.step = step
        self._rounds = 0
        self._begin_shift()
        return step.answer

    def _find(self, contacts: Sequence[str]) -> list[int]:
        """Return the indices of wheels; without names of all."""
        names = [wheel.name for wheel in self._wheels.contacts]
        for name in contacts:
            if name not in names:
                raise UnknownName("tracked contact", name, names, expected="a contact of the group `track`")
        return [names.index(name) for name in contacts or names]

    def _check_lift(self, requested: Sequence[int]) -> None:
        """Raise an error where wheels, indices, cannot be lifted now."""
        lifted = self._references.lifted
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

    def displace(self, move: PlanarMove) -> None:
        """Move with the base, whose estimate has jumped."""
        self.shift.displace(move)
        if self._stepping.step is not None:
            self._stepping.step.move(0.0, 0.0, move.rise)

    def update(self, passed: float) -> bool:
        """Write the velocities of what is in progress to the references, in place of others, for a time [s].

        Returns:
            Whether a wheel that has stepped came to stand: what was desired of the vertices before is of the past.
        """
        self._period = passed
        references = self._references
        is_moving = self.phase is not Phase.NONE
        references.waits = is_moving
        if self._stepping.is_uneven:
            self._stepping.balance.update()
        if not is_moving:
            return False
        references.velocity[:] = 0.0
        references.angular[:] = 0.0
        references.vertex_velocity[:] = 0.0
        self.shift.keep_places(passed)
        if self.phase is Phase.SWING:
            self._swing()
        elif self.phase is Phase.LOWER:
            return self._lower()
        elif self.phase is Phase.SETTLE:
            self._settle()
        elif self.shift.go(passed):
            if self.phase is Phase.SHIFT:
                self.phase = Phase.SETTLE
                self._waited = 0.0
            else:
                # a step has moved the base below the centre of mass: other wheels stay where they are
                self.shift.end(None if self._stepping.step is None else self._wheels.offsets.states)
                self._end("")
        return False

    def _give_back(self, requested: list[int], answer: "Future[LiftReply]") -> None:
        """Put wheels down; a lift that is in progress is given up."""
        lifted = self._references.lifted
        if self.phase in (Phase.SHIFT, Phase.SETTLE):
            self._fail("a request to put wheels down")
        elif self._stepping.step is not None and self.phase in (Phase.SWING, Phase.LOWER):
            self._turn_back(self._stepping.step, "a request to put wheels down")
        elif self.phase is Phase.NONE:
            self._requested = [index for index in requested if lifted[index]]
            if not self._requested:
                answer.set_result(LiftReply())
                return
            self.phase = Phase.LOWER
        self._answers.append(answer)

    def _begin_shift(self) -> None:
        """Let the base move to where the others carry the robot."""
        self.shift.begin(*self._lacking(self._required_margin))
        self.phase = Phase.SHIFT

    @property
    def _required_margin(self) -> float:
        """Margin of the centre of mass with which a wheel leaves the ground [m]."""
        return self.margin if self._stepping.step is None else self.margin + SWAY

    def _lacking(self, margin: float) -> tuple[float, float]:
        """Return the displacement of the centre of mass to where the others carry it with a margin, x and y [m]."""
        lifted = np.flatnonzero(self._references.lifted).tolist()
        return self.polygon.towards([*self._requested, *lifted], margin)

    def _settle(self) -> None:
        """Lift the wheels as soon as the others carry the robot."""
        x, y = self._lacking(self._required_margin - 0.01)  # [m] that may be lost meanwhile
        if math.hypot(x, y) < 1e-3:
            for index in self._requested:
                self._ground[index] = self._wheels.offsets.states[index, 2] - self._plane(index)
                self._release(index, True)
            if self._stepping.step is None:
                self._end("")
                return
            self._stepping.step.begin(self._references.vertices[self._stepping.step.index])
            self.phase = Phase.SWING
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

    def _swing(self) -> None:
        """Let a wheel go to above its new place; an obstacle turns it back."""
        step = self._stepping.step
        assert step is not None
        index = step.index
        references = self._references
        vertex = references.vertices[index]
        forces = self._wheels.measure_forces()
        is_high = vertex[2] > step.start[2] + 0.02  # [m]: there the ground that it left does not push it
        stays = float(np.linalg.norm(self._wheels.offsets.errors[index]))
        pushed = is_high and forces[index] > 0.15 * float(forces.mean())
        # a wheel that leaves the ground springs back, as the load of its leg goes
        if not step.failure and (pushed or stays > (0.02 if is_high else 0.04)):  # [m]
            self._turn_back(step, "something is in its way")
        velocity = references.vertex_velocity[index]
        # the base moves below the centre of mass, and is where vertices are seen from
        step.move(*(self._period * references.pace * velocity[:2]).tolist())
        left = step.swing(vertex, self._period)
        velocity += step.velocity
        step.held = step.held + self._period if references.pace < 0.02 else 0.0
        if step.held > 3.0 and not step.failure:  # [s]
            self._turn_back(step, "its motion is held")
        if left < 1e-3:  # [m]
            self._ground[index] = step.goal[2] - self._plane(index)
            self._requested = [index]
            step.rest()
            self.phase = Phase.LOWER

    def _turn_back(self, step: Step, failure: str) -> None:
        """Let a wheel that steps go back to where it stood."""
        step.turn_back(failure)
        self.phase = Phase.SWING

    def _lower(self) -> bool:
        """Let wheels go down until they stand; return whether one has stepped."""
        references = self._references
        forces = self._wheels.measure_forces()
        feels = bool(np.delete(forces, self._requested).any())
        lost = ""
        speed_limit = 0.06  # [m/s]
        near_speed = 0.02  # [m/s] within 2 cm of the ground
        step = self._stepping.step
        lowest = 0.0 if step is None else -0.04  # [m] of the ground, where nothing feels it
        for index in list(self._requested):
            height = float(references.vertices[index, 2]) - self._plane(index) - self._ground[index]
            # the ground is felt by 15 % of the mean force of the wheels
            stands = forces[index] > 0.15 * float(forces.mean()) if feels else height < 1e-4
            if step is not None and feels:
                stands = step.holds(stands, self._period)
            elif step is not None:
                stands = step.feels(-float(self._wheels.offsets.errors[index, 2]), height, self._period)
            if stands:
                self._release(index, False)
                if step is not None:
                    step.higher = height
            elif height > -0.03:  # [m] below where the ground was
                speed = speed_limit if height > 0.02 else near_speed
                if step is not None:
                    speed = step.descend(speed, self._period)
                references.vertex_velocity[index, 2] = (
                    -speed if feels else -min(speed, (height - lowest) / self._period)
                )
                continue
            else:
                lost = f"no ground below '{self._wheels.contacts[index].name}'"
            self._requested.remove(index)
        if lost and step is not None and not step.failure:
            self._turn_back(step, lost)
            return False
        if self._requested and not lost:
            return False
        if references.lifted.any():
            self._end(lost)
        else:
            self._go_back()
        return step is not None

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
        if self._stepping.step is not None and not lifted:
            self._stepping.is_uneven = True

    def _fail(self, why: str) -> None:
        """Give a lift up, and go back."""
        self._answer(f"not lifted: {why}")
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
        self._answer(failure)

    def _answer(self, failure: str) -> None:
        """Answer all requests."""
        step = self._stepping.step
        answers = self._answers
        self._stepping.step = None
        self._answers = []
        if step is not None:
            step.answer.set_result(step.reply(self._wheels.contacts[step.index].name, failure))
        for answer in answers:
            answer.set_result(LiftReply(not failure, failure))
