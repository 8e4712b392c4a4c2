"""The component `wheeled_motion`."""

import logging
from typing import Any, ClassVar

import numpy as np

from solfer.components.base import Component
from solfer.components.declaration import LiveParameter, Service, TopicIn, TopicOut
from solfer.components.following.requests import GetReference, ReferenceReply
from solfer.components.gravity_compensation import LiftContacts, LiftReply
from solfer.components.live_tunings import live_tunings
from solfer.components.wheeled_motion.drive import Drive, Twist, WheelsState
from solfer.components.wheeled_motion.kernel import WHEELS, find_errors, find_rates, move, steer, write_command
from solfer.components.wheeled_motion.original.kernel import PERIOD, ROUNDED, ROUNDED_TURN
from solfer.components.wheeled_motion.original.resteering import Resteering
from solfer.components.wheeled_motion.pace.path import PathPace
from solfer.components.wheeled_motion.pace.publisher import MotionPace, PacePublisher
from solfer.components.wheeled_motion.points import RollingOffsets
from solfer.components.wheeled_motion.references import References, about_z
from solfer.components.wheeled_motion.steering import Steering
from solfer.components.wheeled_motion.support import TIMEOUT, Lifting, MotionGuard, SupportPolygon, TaskRates
from solfer.components.wheeled_motion.support.straight import StraightAhead
from solfer.components.wheeled_motion.tags import (
    BASE,
    CAMBER,
    CASTER,
    CONSTRAINTS,
    POINTS,
    SOFT,
    SOFT_PACED,
    STEERING,
    VERTICES,
    DrivingTags,
    SteeringRecord,
    WheeledMotionTags,
)
from solfer.components.wheeled_motion.targets import BASE_PORT, VERTICES_PORT, Targets, WheelsSupport
from solfer.components.wheeled_motion.velocities import SentVelocities
from solfer.components.wheeled_motion.wheels import find_wheels, make_points, moved_by, rows_of, steered_by
from solfer.errors import ComponentError, UnknownName
from solfer.numerics.planar_move import PlanarMove
from solfer.numerics.pointers import Memory
from solfer.numerics.solvers.damped_descent import DampedDescent
from solfer.points import SpatialPoint
from solfer.points.contact.contacts import Contact
from solfer.robot import Robot
from solfer.tasks.building.build import build_stack
from solfer.tasks.constraints import joint_bounds
from solfer.tasks.stack import Stack
from solfer.tasks.task import DAMPING_COLUMN
from solfer.throttle import Throttle

log = logging.getLogger(__name__)

MAKE_UP = 0.2
"""Others slow down in this time for what a motion is behind the clock [s]: cycles that were too late, a slow robot."""

ROLLED = 0.3
"""Longest time for which wheels roll on as they were commanded last [s]: then the lower level stops them."""

LIMITS = (
    *("base_speed", "turn_speed", "vertex_speed"),
    *("acceleration", "turn_acceleration", "vertex_acceleration"),
    *("correction", "turn_correction", "furthest"),
    *("support_margin", "lift_margin"),
)
"""Tags of limits that change together: speeds, accelerations, corrections, margins."""

HELD = 0.02
"""Pace below which joints and bounds hold the robot where it is."""


class WheeledMotion(Component):
    """Drives on steered wheels at the ends of legs: base and support polygon follow references.

    Joint velocities of a stack of tasks by null spaces, integrated, are commanded: no wheel slips, the base goes to
    its reference, wheels steer to where their vertices have to go, and roll there, camber and caster stay.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        references: What is desired.
        drive: Velocities of the base that others send.
        targets: Desired places of base and vertices.
        stack: The tasks.
        moved: DoFs that it moves, shape (m,).

    Raises:
        SolferError: A tag does not fit the robot.
        SolferErrors: Several of these.
    """

    Tags: ClassVar[type[DrivingTags]] = WheeledMotionTags

    def __init__(self, robot: Robot, tags: DrivingTags, name: str = "wheeled_motion"):
        super().__init__(robot, tags, name)
        robot.update()
        self._wheels = find_wheels(robot, tags)
        links = [wheel.end_frame for wheel in self._wheels]
        self._pose = SpatialPoint(robot.kinematics.base_link, robot)
        self._points = make_points(robot, tags, self._wheels, pose=self._pose)
        self._offsets: RollingOffsets = self._points[POINTS[VERTICES]]  # type: ignore[assignment]
        record = tags.stack_record()
        self.moved = moved_by(robot, tags)
        configured = build_stack(record, robot, self._points)
        configured.confine(self.moved)
        self._configured = configured
        self.stack = Stack(configured.levels)
        self._rows = rows_of(record.levels, self.stack.ends.tolist())
        self.references = References(len(links))
        self.references.lifted = self._offsets.lifted
        holding = [task.point for task in configured.tasks.values() if isinstance(task.point, Contact)]
        is_steered = STEERING in self._rows
        steered = [steered_by(robot, tags, wheel) for wheel in self._wheels] if is_steered else []
        self._turning = np.array(steered, dtype=int)
        self._straight = None if is_steered or tags.is_original else StraightAhead(links)
        kinematics = robot.kinematics
        self._resteering = Resteering(
            kinematics.lower_position[self._turning], kinematics.upper_position[self._turning]
        )
        self._gain = np.zeros(len(self.stack.velocity))
        self._gain[:] = np.concatenate([task.gain for task in self.stack.tasks])
        self._rates = TaskRates(*np.zeros((3, len(self._gain))))
        self._error = self._rates.error
        self._desired = np.zeros(len(links))
        self._position, self._velocity = np.zeros((2, robot.size))
        self._is_paced = tags.is_paced
        self._is_original = tags.is_original
        self._is_first = True
        self.drive = Drive(
            tags.base_speed, tags.turn_speed, tags.acceleration, turn_acceleration=tags.turn_acceleration
        )
        self.targets = Targets(
            len(links),
            (tags.base_speed, tags.turn_speed, tags.vertex_speed),
            (tags.acceleration, tags.turn_acceleration, tags.vertex_acceleration),
        )
        self.inputs |= self.targets.ports
        given = self.drive, self.targets, self.references, self._offsets
        self._velocities = SentVelocities(self.name, *given)
        center = self._points[POINTS[BASE]].center  # type: ignore[attr-defined]
        self._polygon = SupportPolygon(self._offsets.vertices, center, tags.support_margin)
        driven = {*self._turning.tolist(), *(robot.dof(robot.description.links[link].parent) for link in links)}
        self._legs = {robot.dofs[dof]: dof for dof in self.moved.tolist() if dof >= 6 and dof not in driven}
        self._lifting = Lifting(
            [wheel.name for wheel in self._wheels],
            holding,
            self._offsets,
            references=self.references,
            polygon=self._polygon,
            base_velocity=self._base_velocity,
            forces=self._measured_forces,
            margin=tags.lift_margin,
            is_whole=robot.is_whole,
        )
        self._throttle = Throttle(log)
        self._behind = 0.0
        self._tempo = 1.0
        self._base_error, self._measured_velocity = np.zeros((2, 3))
        self._vertex_error = np.zeros_like(self.references.vertices)

    def set_rate(self, rate: float) -> None:
        """Set the rate of the control cycle [Hz], and make what depends on it; see `Component.set_rate`."""
        super().set_rate(rate)
        if not self.kinematics:
            raise ComponentError(f"'{self.name}' without kinematics", expected="kinematics: true")
        tags = self.tags
        stack = self.stack
        self._steering = Steering(
            tags.steering_record(),
            self.period,
            len(self._wheels),
            rests=tags.rests,
            across=tags.gain_across if self._straight is None else 0.0,
        )
        self.steering_angles = self._steering.measured
        speeds = tags.base_speed, tags.turn_speed, tags.vertex_speed
        self._pace = PathPace(
            speeds, tags.acceleration, self.references, steering=self._steering, offsets=self._offsets
        )
        self._publisher = PacePublisher(self._published_pace, self.period)
        rigid = 1 if self._rows.get(CONSTRAINTS, slice(1)).start == 0 else 0
        self._descent = DampedDescent(stack.ends, stack.size, self.moved, rigid=rigid)
        self._bounds = joint_bounds(self.model, self.period)
        self._guard = MotionGuard(
            self._polygon,
            self.references.lifted,
            [wheel.end_frame for wheel in self._wheels],
            rows=self._rows,
            rates=self._rates,
            legs=self._legs,
            turning=self._turning,
            velocity=self._descent.velocity,
        )
        self._name_parts()

    def _set_step(self, step: float) -> float:
        """Set the time over which this cycle integrates [s].

        Returns:
            For how much longer than that wheels have rolled on since the cycle before [s]. The pace makes up for the
            rest of a gap.
        """
        self._steering.set_step(step)
        self._bounds.set_period(step)
        rolled = max(step, min(self.passed, ROLLED))
        self._behind += self.passed + self.time_lost - rolled
        self._tempo = max(0.0, 1.0 - self._behind / MAKE_UP)
        self._behind -= (1.0 - self._tempo) * (self.passed + self.time_lost)
        return rolled - step

    def _name_parts(self) -> None:
        """Keep what the cycle needs, so that it looks up nothing by name."""
        points = self._points
        references = self.references
        stack = self.stack
        tags = self.tags
        offsets = self._offsets
        steering = self._steering
        tracked = points[POINTS[BASE]].value[3:]
        first = {name: rows.start for name, rows in self._rows.items()}
        limits = np.stack((self._bounds.lower_position, self._bounds.upper_position))
        self._damping = stack.numbers[:, DAMPING_COLUMN]
        self._memory = Memory(
            WHEELS,
            count=len(self._wheels),
            dofs=self.model.size,
            rows=len(self._gain),
            law=steering.law,
            wheels=steering.wheels,
            before=steering.before,
            steered=steering.steered,
            places=offsets.states,
            errors=offsets.errors,
            offsets=offsets.value,
            directions=offsets.directions,
            lifted=references.lifted,
            base=offsets.base,
            numbers=references.numbers,
            motion=references.velocity,
            turning=references.turn,
            velocities=references.vertex_velocity,
            desired_place=references.position,
            orientation=references.orientation,
            desired_camber=references.camber,
            desired_caster=references.caster,
            pose=self._pose.value,
            center=tracked if tags.base == "center_of_mass" else self._pose.value,
            place=tracked,
            camber=points[POINTS[CAMBER]].value,
            caster=points[POINTS[CASTER]].value,
            turning_dofs=self._turning,
            measured=self.model.state.position,
            position=self._position,
            velocity=self._velocity,
            limits=0 if self._is_original else limits,
            **{f"of_{rows}": first.get(task, -1) for task, rows in (*POINTS.items(), (STEERING, "steering"))},
            steering_rows=stack.jacobian[self._rows[STEERING]] if STEERING in first else 0,
            aims=self._desired,
            most=np.array([SOFT_PACED if tags.is_paced else SOFT[STEERING], SOFT[CAMBER], SOFT[CASTER]]),
            error=self._rates.error,
            gain=self._gain,
            rates=stack.velocity,
            away=self._rates.away,
            forward=self._rates.forward,
            half=ROUNDED if self._is_original else PERIOD,
            furthest=tags.furthest,
            base_correction=tags.correction,
            turn_correction=tags.turn_correction,
            vertex_correction=tags.vertex_speed,
            base_acceleration=tags.acceleration,
            turn_acceleration=tags.turn_acceleration,
            vertex_acceleration=tags.vertex_acceleration,
            base_speed=tags.base_speed,
            turn_speed=tags.turn_speed,
        )

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
            *live_tunings(tags, tags.stack_record(), self._configured, write=self._take_tuning),
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
        self.drive.limit(speeds[0], speeds[1], accelerations[0], accelerations[1])
        self.targets.limit(speeds, accelerations)
        self._pace.limit(speeds, accelerations[0])
        record = self._memory.record
        record["base_speed"], record["turn_speed"], record["vertex_correction"] = speeds
        record["base_acceleration"], record["turn_acceleration"], record["vertex_acceleration"] = accelerations
        record["base_correction"], record["turn_correction"], record["furthest"] = values[6:9]
        self._polygon.least, self._lifting.margin = values[9:]
        self._guard.leave(self._polygon.least)

    def _take_across(self, gain: np.ndarray) -> None:
        if self._straight is None:
            self._steering.law["across"] = gain

    def _take_tuning(self, numbers: np.ndarray) -> None:
        """Write gains and dampings of all rows, shape (2, rows)."""
        self._gain[:], self.stack.numbers[:, DAMPING_COLUMN] = numbers
        first = 0
        for task in self.stack.tasks:
            rows = slice(first, first + task.rows)
            task.gain[:], task.damping[:] = numbers[:, rows]
            first = rows.stop

    def init(self) -> None:
        """Start from where the robot is, at rest."""
        self._position[:] = self.start_position
        self._velocity[:] = 0.0
        self.stack.update()
        pose = self._pose.value
        offsets = self._offsets
        references = self.references
        offsets.start()
        place = np.array(self._points[POINTS[BASE]].value[3:])
        if self.tags.base == "link" and self._is_original:
            place[:2] = self.model.center_of_mass.value[:2]
        references.start(place, offsets.heading, pose[3:])
        references.vertices[:] = offsets.reference
        references.camber[:] = self._points[POINTS[CAMBER]].value
        references.caster[:] = self._points[POINTS[CASTER]].value
        if self._is_original:
            references.caster[references.caster <= -ROUNDED] += ROUNDED_TURN - 2.0 * ROUNDED
        self._measure_steering()
        in_place = None if self._is_original else self.steering_angles
        self._steering.start(pose[:2], offsets.heading, in_place)
        self._resteering.start()
        self.drive.start()
        self.targets.start()
        self._lifting.start()
        self._pace.start()
        self._publisher.start()
        self._guard.start()
        self._rates.away[:] = 0.0
        self._is_first = True
        self._is_held = False
        self._behind = 0.0
        self._tempo = 1.0

    def update(self) -> None:
        """Compute one cycle."""
        stack = self.stack
        is_paced = self._is_paced
        step = self.time_step
        gap = self._set_step(step)
        self._take_over(gap)
        self._lifting.update(step)
        self._leave_out()
        self._pace.advance(is_paced, self._is_first, self._is_held, self.pace, step)
        stack.update_jacobian()
        self._steer()
        self._find_errors()
        far = find_rates(self._memory.address, is_paced, not self._is_original)
        if far >= 0:
            self._raise_far(far)
        self._bounds.update(self._position)
        bounds = None if self._is_original else self._bounds
        self._descent.update(stack.jacobian, stack.velocity, self._damping, bounds)
        if is_paced:
            self._hold_back()
        self._integrate()
        if self._straight is not None and not self.references.waits:
            self._straight.restore(self.references)
        self._offsets.remember()
        self._is_first = False

    def move_world(self, move: PlanarMove) -> None:
        """See `Component.move_world`: references of base and vertices stay where they are as seen from the robot."""
        for part in (self.references, self.targets, self.drive, self._steering, self._offsets):
            part.displace(move)
        move.move(self._lifting.goal)
        move.move(self._pose.value[:3])
        move.turn_orientation(self._pose.value[3:])

    def send(self) -> None:
        """Write positions and velocities of the DoFs that it moves."""
        command = self.model.command
        write_command(self.moved, self._position, self._velocity, command.position, command.velocity)

    def stop(self) -> None:
        """Hold the joints where they are commanded, and the wheels still."""
        self._velocity[:] = 0.0
        self._lifting.stop()
        self.model.command.velocity[self.moved] = 0.0

    def reset(self) -> None:
        """Forget what was desired."""
        self.drive.start()
        self.targets.start()

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """Receive velocities of the base on `cmd_vel` and `wheels_state`, places and velocities on `wheels_support`.

        On `pace` it publishes with which share of these velocities the motion goes on: none while it does not work.
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
            TopicOut(
                "pace", "std_msgs/Float64", MotionPace, collect=lambda: self._publisher.collect(), rest=MotionPace(0.0)
            ),
        )

    def services(self) -> tuple[Service, ...]:
        """Offer the services `<name>/lift` and `<name>/get_reference`."""
        return (
            Service(
                "lift",
                "solfer/LiftContacts",
                LiftContacts,
                reply=LiftReply,
                handler=self._lifting.lift,
                timeout=TIMEOUT,
            ),
            Service(
                "get_reference", "solfer/GetReference", GetReference, reply=ReferenceReply, handler=self.get_reference
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
        names = [wheel.end_frame for wheel in self._wheels]
        places = [f"{name}.{axis}" for name in names for axis in "xyz"]
        logger.add("base_reference", self.references.position, list("xyz"), "m", "world")
        logger.add("vertex_reference", self.references.vertices, places, "m")
        logger.add("vertices", self._offsets.states, places, "m")
        logger.add("steering_reference", self._steering.angles, names, "rad")
        logger.add("steering", self.steering_angles, names, "rad")
        logger.add("velocity", self._velocity, self.model.dofs)
        logger.add("base_error", self._base_error, list("xyz"), "m", "world")
        logger.add("vertex_error", self._vertex_error, places, "m")
        logger.add("base_velocity", self._measured_velocity, list("xyz"), "m/s", "world")
        logger.add("base_velocity_reference", self.references.velocity, list("xyz"), "m/s", "world")

    def log(self, logger: Any, time: float) -> None:
        """See `Component.log`: how far base and vertices are from their references, and the measured velocity."""
        place = self._points[POINTS[BASE]].value[3:]
        np.subtract(self.references.position, place, out=self._base_error)
        np.subtract(self.references.vertices, self._offsets.states, out=self._vertex_error)
        np.dot(self._pose.jacobian[:3], self.model.state.velocity, out=self._measured_velocity)

    def _published_pace(self) -> float:
        """Return the share of the received velocities with which the motion goes on."""
        if self.references.waits:
            return 0.0
        return self.references.pace * self._velocities.share * self._tempo * self.drive.progress

    def _base_velocity(self) -> np.ndarray:
        """Return how fast the base's link was commanded to move in the last cycle, x and y in the world [m/s]."""
        return self._pose.jacobian[:2] @ self._velocity

    def _measured_forces(self) -> np.ndarray:
        """Return the vertical forces on the wheels that a pipe receives, shape (m,) [N]; without one zeros."""
        contacts = self.model.contacts
        return np.array([contacts[wheel.name].wrench[2] for wheel in self._wheels])

    def _steer(self) -> None:
        """Compute where wheels are to point."""
        if self._is_first and self._is_original:
            self._offsets.errors[:] = 0.0
        steer(self._memory.address)

    def _take_over(self, gap: float) -> None:
        """Write the received velocities and targets to the references; of the base the newest ones.

        Through a gap [s] references go on at the mean of the velocities before and after it.
        """
        if gap:
            self.references.step(0.5 * gap)
        if wrong := self.targets.read():
            self._throttle.warning("targets", "%s: %s, it is ignored", self.name, wrong)
        if self.targets.ports[BASE_PORT].fresh and self.targets.has_base:
            self.drive.start()
        elif self.drive.is_active:
            self.targets.leave_base()
        if self._velocities.update(self.time_step + gap):
            self._stay()
        elif gap:
            self.references.step(0.5 * gap)

    def _stay(self) -> None:
        """Put the references where base and wheels have come to rest: wheels would steer and roll on for the rest."""
        offsets = self._offsets
        self.references.stay(self._points[POINTS[BASE]].value[3:], offsets.heading, offsets.states)
        self._steering.start(self._pose.value[:2], offsets.heading, self.steering_angles)

    def _leave_out(self) -> None:
        """Leave out what wheels that nothing steers cannot do."""
        if self._straight is None or self.references.waits:
            return
        offsets = self._offsets
        if left := self._straight.update(self.references, offsets.directions[0], offsets.heading):
            self._throttle.warning("straight", "%s: %s", self.name, left)

    def _hold_back(self) -> None:
        """Shorten a motion that may not go on, and log why where it comes to rest."""
        descent = self._descent
        guard = self._guard
        self._is_held = guard.update(self.references.pace, descent.last >= 0, self.time_step)
        if self._is_held and self._pace.held < HELD:
            why = guard.why or f"joint '{self.model.dofs[descent.last]}' is at its bound"
            self._throttle.warning("held", "%s holds where it is: %s", self.name, why)

    def _raise_far(self, row: int) -> None:
        """Name what is farther from its reference than it may be."""
        base = self._rows.get(BASE)
        vertices = self._rows.get(VERTICES)
        is_base = base is not None and base.start <= row < base.stop
        what = (
            "the base"
            if is_base
            else f"the vertex of '{self._wheels[(row - vertices.start) % len(self._wheels)].name}'"
        )
        raise ComponentError(
            f"{what} is {abs(self._rates.error[row]):.2f} m from its reference",
            expected=f"{self.tags.furthest:g} m at most, the tag `furthest`",
        )

    def _measure_steering(self) -> None:
        directions = self._offsets.directions
        np.arctan2(directions[:, 1], directions[:, 0], out=self.steering_angles)

    def _find_errors(self) -> None:
        """Write the errors of all tasks."""
        find_errors(self._memory.address)

    def _integrate(self) -> None:
        """Write what is commanded."""
        moved = self.moved
        turning = self._turning
        move(moved, self._descent.velocity, self.time_step, self._velocity, self._position)
        if not self._is_original:
            return
        commanded = self._position[turning]
        self._resteering.update(self.model.state.position[turning], commanded)
        self._position[turning] = commanded
