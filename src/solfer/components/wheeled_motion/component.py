"""The component `wheeled_motion`."""

from typing import Any, ClassVar

import numpy as np

from solfer.components.base import Component
from solfer.components.live_tunings import live_tunings
from solfer.components.wheeled_motion.drive import Drive, WheelsState
from solfer.components.wheeled_motion.inputs import ReferenceInputs
from solfer.components.wheeled_motion.joints import CommandedJoints
from solfer.components.wheeled_motion.kernel import FLOOR
from solfer.components.wheeled_motion.log import WheelsLog
from solfer.components.wheeled_motion.original.kernel import ROUNDED_PI, ROUNDED_TWO_PI
from solfer.components.wheeled_motion.original.resteering import Resteering
from solfer.components.wheeled_motion.pace.delay import ClockDelay
from solfer.components.wheeled_motion.pace.path import PathPace
from solfer.components.wheeled_motion.pace.publisher import MotionPace, PacePublisher
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.steering import Steering
from solfer.components.wheeled_motion.support import (
    LegReach,
    Lifting,
    LoadBalance,
    MotionGuard,
    Stepping,
    SupportPolygon,
    WeightShift,
)
from solfer.components.wheeled_motion.tags import (
    BASE,
    CAMBER,
    CASTER,
    CONSTRAINTS,
    TASK_POINTS,
    DrivingTags,
    SteeringRecord,
    WheeledMotionTags,
)
from solfer.components.wheeled_motion.targets import Targets, WheelsSupport
from solfer.components.wheeled_motion.tasks import DrivingTasks
from solfer.components.wheeled_motion.wheels import DrivenWheels, moved_by
from solfer.errors import ComponentError, UnknownName
from solfer.interfaces.declaration import LiveParameter, Service, TopicIn, TopicOut
from solfer.interfaces.geometry import Twist
from solfer.interfaces.support import BASE_PORT, VERTICES_PORT, LiftContacts, LiftReply, StepContact
from solfer.interfaces.task_references import GetReference, ReferenceReply
from solfer.numerics.planar_move import PlanarMove, about_z
from solfer.robot import Robot
from solfer.tasks.stack import Stack

LIMITS = (
    *("base_speed", "turn_speed", "vertex_speed"),
    *("acceleration", "turn_acceleration", "vertex_acceleration"),
    *("correction", "turn_correction", "furthest"),
    *("support_margin", "lift_margin"),
)
"""Tags of limits that change together: speeds, accelerations, corrections, margins."""


class WheeledMotion(Component):
    """Drives on steered wheels at the ends of legs: base and support polygon follow references.

    Joint velocities of a stack of tasks by null spaces, integrated, are commanded: no wheel slips, the base goes to
    its reference, wheels steer to where their vertices have to go, and roll there, camber and caster stay.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        wheels: The wheels that it drives on.
        tasks: The tasks, and the joint velocities that follow from them.
        references: What is desired.
        received: What moves the references.
        joints: What is commanded.

    Raises:
        SolferError: A tag does not fit the robot.
        SolferErrors: Several of these.
    """

    Tags: ClassVar[type[DrivingTags]] = WheeledMotionTags

    def __init__(self, robot: Robot, tags: DrivingTags, name: str = "wheeled_motion"):
        super().__init__(robot, tags, name)
        robot.update()
        moved = moved_by(robot, tags)
        self.wheels = DrivenWheels(robot, tags)
        self.tasks = DrivingTasks(robot, tags, self.wheels, moved=moved)
        self.references = References(len(self.wheels.links))
        self.references.lifted = self.wheels.offsets.lifted
        self.received = ReferenceInputs(self.name, tags, self.references, wheels=self.wheels)
        self.inputs |= self.targets.ports
        steering = self.wheels.steering
        kinematics = robot.kinematics
        ends = kinematics.lower_position[steering], kinematics.upper_position[steering]
        self.joints = CommandedJoints(moved, robot.size, steering, Resteering(*ends) if tags.is_original else None)
        polygon = SupportPolygon(self.wheels.offsets.vertices, self.wheels.center, tags.support_margin)
        shift = WeightShift(self.references, self.wheels, self.joints)
        self._lifting = Lifting(
            self.wheels,
            self.references,
            shift,
            polygon=polygon,
            holding=self.tasks.holding,
            stepping=Stepping(LegReach(self.wheels, moved), self._balance()),
            margin=tags.lift_margin,
        )
        self._delay = ClockDelay()
        self._publisher = PacePublisher(self._published_pace)

    def _balance(self) -> LoadBalance:
        """Make what lets wheels on steps share the weight."""
        rows = self.tasks.rows.get(CONSTRAINTS, slice(0))
        return LoadBalance(self.wheels, self.references.lifted, self.tasks.rates.forward[rows])

    @property
    def drive(self) -> Drive:
        """Velocities of the base that others send."""
        return self.received.drive

    @property
    def targets(self) -> Targets:
        """Desired places of base and vertices."""
        return self.received.targets

    @property
    def stack(self) -> Stack:
        """The levels of the tasks."""
        return self.tasks.stack

    @property
    def moved(self) -> np.ndarray:
        """DoFs that it moves, shape (m,)."""
        return self.joints.moved

    def set_rate(self, rate: float) -> None:
        """Set the rate of the control cycle [Hz], and make what depends on it; see `Component.set_rate`."""
        super().set_rate(rate)
        if not self.kinematics:
            raise ComponentError(f"'{self.name}' without kinematics", expected="kinematics: true")
        tags = self.tags
        wheels = self.wheels
        references = self.references
        self._steering = Steering(
            tags.steering_record(),
            self.period,
            len(wheels.links),
            rests=tags.rests,
            across=tags.gain_across if self.received.straight is None else 0.0,
        )
        base_error = self.tasks.rates.error[self.tasks.rows[BASE]] if BASE in self.tasks.rows else np.zeros(6)
        self._pace = PathPace(references, self._steering, wheels.offsets, error=base_error)
        self._pace.limit(tags.speeds, tags.acceleration, tags.furthest)
        self._pace.is_found = tags.is_paced
        self._publisher.set_period(self.period)
        self.tasks.prepare(tags, self.period, references, steering=self._steering, joints=self.joints)
        self._guard = MotionGuard(
            self._lifting.polygon,
            references.lifted,
            wheels.links,
            rates=self.tasks.rates,
            legs=wheels.find_legs(self.moved),
            turning=wheels.steering,
            velocity=self.tasks.descent.velocity,
        )
        self._log = WheelsLog(self.model, wheels, references, steering=self._steering, joints=self.joints)

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer gains of tasks, speeds and accelerations, margins, and how wheels steer."""
        tags = self.tags
        return (
            *(LiveParameter((key,), self._take_limits, self._limits_of) for key in LIMITS),
            LiveParameter(("across",), self._take_across, lambda tags: tags.gain_across),
            *(
                LiveParameter(("steerings", name, key), self._steering.tune, self._steering_of)
                for name in tags.steerings
                for key in SteeringRecord.model_fields
            ),
            *live_tunings(tags, tags.stack_record(), self.tasks.configured, write=self.tasks.tune),
        )

    def _limits_of(self, tags: DrivingTags) -> list[float]:
        return [getattr(tags, key) for key in LIMITS]

    def _steering_of(self, tags: DrivingTags) -> tuple[float, ...]:
        return self._steering.numbers(tags.steering_record())

    def _take_limits(self, numbers: np.ndarray) -> None:
        """Go on with other numbers of `LIMITS`."""
        values = numbers.tolist()
        speeds = values[:3]
        accelerations = values[3:6]
        self.drive.limit(*speeds[:2], *accelerations[:2])
        self.targets.limit(speeds, accelerations)
        self._pace.limit(speeds, accelerations[0], furthest=values[8])
        self.tasks.limit(speeds, accelerations, values[6:9])
        margin, self._lifting.margin = values[9:]
        self._guard.set_required_margin(margin)

    def _take_across(self, gain: np.ndarray) -> None:
        if self.received.straight is None:
            self._steering.law["across"] = gain

    def init(self) -> None:
        """Start from where the robot is, at rest."""
        self.joints.start(self.start_position)
        self.stack.update()
        offsets = self.wheels.offsets
        offsets.start()
        self._start_references()
        self._steering.measure(offsets.directions)
        in_place = None if self.tags.is_original else self._steering.measured
        self._steering.start(self.wheels.pose.value[:2], offsets.heading, in_place)
        for part in (self.received, self.tasks, self._lifting, self._pace, self._publisher, self._guard, self._delay):
            part.start()

    def _start_references(self) -> None:
        """Let what is desired be what is."""
        wheels = self.wheels
        references = self.references
        place = np.array(wheels.place)
        if self.tags.base == "link" and self.tags.is_original:
            place[:2] = self.model.center_of_mass.value[:2]
        references.start(place, wheels.offsets.heading, wheels.pose.value[3:])
        references.vertices[:] = wheels.offsets.reference
        references.numbers[FLOOR:] = wheels.offsets.reference[:, 2].mean()
        references.camber[:] = wheels.points[TASK_POINTS[CAMBER]].value
        references.caster[:] = wheels.points[TASK_POINTS[CASTER]].value
        if self.tags.is_original:
            references.caster[references.caster <= -ROUNDED_PI] += ROUNDED_TWO_PI - 2.0 * ROUNDED_PI

    def update(self) -> None:
        """Compute one cycle."""
        step = self.time_step
        is_paced = self._pace.is_found
        self._take_over(self._set_step(step))
        if self._lifting.update(step):
            self.targets.leave_vertices()
        if self.received.straight is not None:
            self.received.leave_out()
        self._pace.advance(is_paced, self.joints.is_first, self._guard.is_held, self.pace, step)
        self._find_errors()
        velocity = self.tasks.solve(is_paced, self.joints.position)
        if is_paced:
            self._hold_back(step)
        self.joints.integrate(velocity, step, self.model.state.position)
        if self.received.straight is not None:
            self.received.restore()
        if self.wheels.offsets.is_late:
            self.wheels.offsets.remember()

    def _set_step(self, step: float) -> float:
        """Set the time over which this cycle integrates, and return the gap before it; both [s]."""
        if step != self._steering.step:
            self._steering.set_step(step)
            self.tasks.bounds.set_period(step)
        return self._delay.advance(step, self.passed, self.time_lost)

    def _take_over(self, gap: float) -> None:
        """Write what is received to the references, which go on through a gap [s]."""
        if self.received.update(self.time_step, gap):
            # wheels would steer and roll on for what is left of the way
            offsets = self.wheels.offsets
            self.references.stay(self.wheels.place, offsets.heading, offsets.states)
            self._steering.start(self.wheels.pose.value[:2], offsets.heading, self._steering.measured)

    def _find_errors(self) -> None:
        """Find rows and errors of all tasks, and where wheels are to point."""
        self.tasks.stack.update_jacobian()
        if self.joints.is_first and self.tags.is_original:
            self.wheels.offsets.errors[:] = 0.0
        self.tasks.find_errors(True)

    def _hold_back(self, step: float) -> None:
        """Shorten a motion that may not go on, and log why where it comes to rest."""
        last = self.tasks.descent.last
        guard = self._guard
        pace = self.references.pace
        rest = 0.02  # pace below which the log says what holds a motion
        if guard.update(pace, last >= 0, step) and self._pace.held < rest:
            guard.warn(self.name, f"joint '{self.model.dofs[last]}' is at its bound")
        elif pace < rest and self._pace.waits_for_base():
            guard.warn(self.name, "the base does not follow its reference")

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`: references of base and vertices stay where they are as seen from the robot."""
        for part in (self.references, self.targets, self.drive, self._steering, self._lifting, self.wheels):
            part.displace(move)

    def send(self) -> None:
        """Write positions and velocities of the DoFs that it moves."""
        command = self.model.command
        self.joints.send(command.position, command.velocity)

    def stop(self) -> None:
        """Hold the joints where they are commanded, and the wheels still."""
        self._lifting.stop()
        self.joints.stop(self.model.command)

    def reset(self) -> None:
        """Forget what was desired."""
        self.received.start()

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """Receive velocities of the base on `cmd_vel` and `wheels_state`, places and velocities on `wheels_support`.

        On `pace` it publishes with which ratio of these velocities the motion goes on: none while it does not work.
        """
        return (
            TopicIn("cmd_vel", "geometry_msgs/Twist", Twist, handler=self.drive.receive, stream="velocities"),
            TopicIn(
                "wheels_state",
                "solfer/WheelsState",
                WheelsState,
                handler=lambda message: self.drive.receive_state(message, self.references),
                stream="velocities",
            ),
            TopicIn(
                "wheels_support",
                "solfer/WheelsSupport",
                WheelsSupport,
                handler=self.targets.receive,
                stream="places",
            ),
            TopicOut("pace", "std_msgs/Float64", MotionPace, collect=self._publisher.collect, rest=MotionPace(0.0)),
        )

    def services(self) -> tuple[Service, ...]:
        """Offer the services `<name>/lift`, `<name>/step` and `<name>/get_reference`."""
        return (
            Service(
                "lift",
                "solfer/LiftContacts",
                LiftContacts,
                reply=LiftReply,
                handler=self._lifting.lift,
                timeout=Lifting.TIMEOUT,
            ),
            Service(
                "step",
                "solfer/StepContact",
                StepContact,
                reply=LiftReply,
                handler=self._lifting.step,
                timeout=Lifting.TIMEOUT,
            ),
            Service(
                "get_reference",
                "solfer/GetReference",
                GetReference,
                reply=ReferenceReply,
                handler=self.get_reference,
                commands=False,
            ),
        )

    def get_reference(self, request: GetReference) -> ReferenceReply:
        """Return where references are: the pose of the `base` with its heading, or the `vertices`.

        Raises:
            UnknownName: It is neither of both.
        """
        references = self.references
        if request.task == BASE_PORT:
            return ReferenceReply(values=(*references.position.tolist(), *about_z(references.heading)))
        if request.task == VERTICES_PORT:
            return ReferenceReply(values=tuple(references.vertices.ravel().tolist()))
        raise UnknownName("reference", request.task, (BASE_PORT, VERTICES_PORT))

    def start_log(self, logger: Any) -> None:
        """Declare references, vertices, steering and errors."""
        self._log.start(logger)

    def log(self, logger: Any, time: float) -> None:
        """See `Component.log`: how far base and vertices are from their references, and the measured velocity."""
        self._log.measure()

    def _published_pace(self) -> float:
        """Return the ratio of the received velocities with which the motion goes on."""
        received = self.received
        return self.references.going * received.ratio * self._delay.ratio * received.drive.progress
