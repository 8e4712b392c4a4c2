"""The component `support_shaping`."""

import logging
import math
from typing import Any

import numpy as np

from solfer.components.declaration import LiveParameter, TopicIn, TopicOut
from solfer.components.support_shaping.governor import Reaction, SupportGovernor
from solfer.components.support_shaping.joint_program import JointProgram
from solfer.components.support_shaping.messages import SupportMargins
from solfer.components.support_shaping.original import WorldVertices
from solfer.components.support_shaping.polygon import FootprintGeometry
from solfer.components.support_shaping.tags import SupportShapingTags
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.component import LIMITS
from solfer.components.wheeled_motion.kernel import find_soft
from solfer.components.wheeled_motion.original.kernel import ROUNDED
from solfer.components.wheeled_motion.tags import BASE, CAMBER, CASTER, CONSTRAINTS, POINTS, SOFT, STEERING, VERTICES
from solfer.dynamics import BIAS
from solfer.errors import ComponentError, UnknownName
from solfer.numerics.solvers.damped_descent import DampedDescent
from solfer.robot import Robot

log = logging.getLogger(__name__)

STACK = (CONSTRAINTS, BASE, STEERING, VERTICES, CAMBER, CASTER)
"""Tasks of the original."""

SIZES = ("margins", "workspaces")
"""Tags of distances of each wheel."""

SHAPING = ("margin_gain", "workspace_gain", "horizon", "recovery", "reactive_margin")
"""Tags of how these are kept."""

CORNERS = 3
"""Fewest wheels of a support polygon."""

PRESSED = 0.2
"""Share of the robot's weight that contacts have to carry for their centre of pressure to count."""

QUICKER = 5.0
"""Gain of the steering in a reaction, by its other one."""

FASTEST = 1.5
"""Largest speed of the polygon under a robot that is pushed [m/s]."""

RATE = 20.0
"""Messages in a second [Hz]."""


class SupportShaping(WheeledMotion):
    """Drives as `wheeled_motion` does, and keeps the balance inside the support polygon and wheels near their hips.

    The balance is the centre of pressure of the contacts' forces, which `ground_forces` writes on the same Robot, or
    the centre of mass. Velocities of the vertices are those that are desired as long as margins and workspaces allow.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        polygon: The support polygon, as of the last cycle; seen from the heading of the base unless original.
        governor: Keeps its limits.
        reaction: Moves it under a robot that is pushed.
        program: The quadratic program of the original; None unless original.

    Raises:
        SolferError: A tag does not fit the robot.
        SolferErrors: Several of these.
    """

    Tags = SupportShapingTags

    def __init__(self, robot: Robot, tags: SupportShapingTags, name: str = "support_shaping"):
        super().__init__(robot, tags, name)
        wheels = [wheel.end_frame for wheel in self._wheels]
        count = len(wheels)
        if count < CORNERS:
            raise ComponentError(
                f"a support polygon of {count} wheels", where=tags.where("track"), expected=f"{CORNERS} or more"
            )
        needed = STACK if tags.is_original else (BASE, VERTICES)
        if missing := [task for task in needed if task not in self._rows]:
            raise ComponentError(
                f"no {', '.join(missing)} among the tasks", where=tags.where("IK"), expected=", ".join(needed)
            )
        try:
            self._hips = robot.links(tags.hips)
        except UnknownName as error:
            raise error.at(tags.where("hips")) from None
        if len(self._hips) != count:
            raise ComponentError(
                f"{len(self._hips)} links in '{tags.hips}' for {count} wheels",
                where=tags.where("hips"),
                expected="one for each wheel",
            )
        margins, workspaces = (np.array(tags.each(tag, count)) for tag in ("margins", "workspaces"))
        self._links = wheels
        self._base_link = str(robot.kinematics.base_link)
        self.polygon = FootprintGeometry(count)
        self._limits = (*margins.tolist(), *workspaces.tolist())
        gains = (tags.margin_gain, tags.workspace_gain)
        holds = tags.infeasible == "hold"
        self.governor = SupportGovernor(
            margins,
            workspaces,
            gains,
            horizon=tags.horizon,
            recovery=tags.recovery,
            speed=tags.vertex_speed,
            holds=holds,
        )
        self.reaction = Reaction(count, tags.reactive_margin, FASTEST)
        self.program = self._make_program() if tags.is_original else None
        self._ends = tuple(zip(self._hips, wheels, strict=True))
        self._asked = np.zeros((count, 3))
        self._asked_turn = 0.0
        self._asked_base, self._rate_of_center, self._center = np.zeros((3, 3))
        self._left = 0
        self._share = np.ones(1)
        self._reaction = np.zeros(2)
        self._weight = robot.kinematics.mass * float(np.linalg.norm(robot.gravity))
        self._names: tuple[str, ...] = ()
        self._keys: dict[str, str] = {}
        self._has_paced = self._is_paced

    def _make_program(self) -> JointProgram:
        robot = self.model
        tags = self.tags
        self.dynamics = True
        robot.dynamics.subscribe(BIAS)
        axles = self._offsets.axes
        radii = [
            (float(tags.major_axis or wheel.major_axis or 0.0), float(tags.minor_axis or wheel.minor_axis or 0.0))
            for wheel in self._wheels
        ]
        wheels = tuple(wheel.end_frame for wheel in self._wheels)
        program = JointProgram(robot, tags, wheels, axles=axles, radii=radii, moved=self.moved)
        self._world = WorldVertices(len(wheels), robot.size)
        self._before_camber = np.zeros((len(wheels), robot.size))
        self._before_steering = np.zeros((len(wheels), robot.size))
        self._aims = np.zeros(len(wheels))
        self._loads = np.zeros(robot.size)
        return program

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer margins, workspaces and how they are kept, beside what `WheeledMotion` offers."""
        return (
            *super().live_parameters(),
            *(LiveParameter((key,), self._take_sizes, self._sizes_of) for key in SIZES),
            *(LiveParameter((key,), self._take_shaping, self._shaping_of) for key in SHAPING),
            LiveParameter(("warn_below",)),
        )

    def _take_limits(self, numbers: np.ndarray) -> None:
        """See `WheeledMotion._take_limits`."""
        super()._take_limits(numbers)
        self.governor.speed = float(numbers[LIMITS.index("vertex_speed")])

    def _sizes_of(self, tags: SupportShapingTags) -> list[tuple[float, ...]]:
        return [tags.each(key, len(self._links)) for key in SIZES]

    def _shaping_of(self, tags: SupportShapingTags) -> list[float]:
        return [getattr(tags, key) for key in SHAPING]

    def _take_sizes(self, numbers: np.ndarray) -> None:
        """Go on with other numbers of `SIZES`, shape (2, count) [m]."""
        self.governor.limits[:] = numbers
        if self.program is not None:
            self.program.limits[:] = numbers

    def _take_shaping(self, numbers: np.ndarray) -> None:
        """Go on with other numbers of `SHAPING`."""
        values = numbers.tolist()
        gains, (horizon, recovery, self.reaction.margin) = values[:2], values[2:]
        self.governor.tune(gains, horizon, recovery)
        if self.program is not None:
            self.program.weigh(gains)

    def set_rate(self, rate: float) -> None:
        """See `WheeledMotion.set_rate`."""
        super().set_rate(rate)
        self._left = self._between = max(round(rate / RATE), 1)
        if self.program is not None:
            first = self._rows[BASE].stop
            ends = np.array([end for end in self.stack.ends.tolist() if end <= first])
            self._first = DampedDescent(ends, self.stack.size, self.moved)

    def _set_step(self, step: float) -> float:
        """See `WheeledMotion._set_step`."""
        self.governor.set_period(step)
        if self.program is not None:
            self.program.set_period(step)
        return super()._set_step(step)

    def init(self) -> None:
        """Start from where the robot is, at rest."""
        super().init()
        self.governor.start()
        self.polygon.start(self._offsets.states)
        self._measure()
        self.reaction.start(self.polygon.edges)
        self._names = self._limit_names()
        self._keys = {name: f"lost {name}" for name in self._names}
        if self.program is not None:
            self._start_program()

    def _limit_names(self) -> tuple[str, ...]:
        edges = (f"margin {self._links[first]}-{self._links[second]}" for first, second in self.polygon.edges)
        return (*edges, *(f"workspace {link}" for link in self._links))

    def _take_over(self, gap: float) -> None:
        """Write what others want to the references, as far as the limits allow."""
        super()._take_over(gap)
        references = self.references
        governor = self.governor
        self._asked[:], self._asked_base[:] = references.vertex_velocity, references.velocity
        self._asked_turn = float(references.turn[2])
        self._measure()
        governor.update(self.polygon, references.vertex_velocity)
        references.vertex_velocity[:, :2] = governor.velocities
        references.velocity *= governor.share
        references.turn[2] *= governor.share
        if self.tags.reactive:
            self._react()
        self._warn()

    def update(self) -> None:
        """Compute one cycle."""
        if self.program is not None:
            self._update_program(self.program)
            return
        super().update()
        # what is desired stays what it is
        references = self.references
        references.vertex_velocity[:], references.velocity[:] = self._asked, self._asked_base
        references.turn[2] = self._asked_turn

    def _measure(self) -> None:
        """Compute the polygon of this cycle, seen from the heading of the base, at its place."""
        kinematics = self.model.kinematics
        offsets = self._offsets
        vertices = offsets.states
        heading = offsets.heading
        px, py, _ = kinematics.position(self._base_link).tolist()
        cos = math.cos(heading)
        sin = math.sin(heading)
        x, y, _ = self._balance().tolist()
        self.polygon.update(vertices.tolist(), (cos * (x - px) + sin * (y - py), cos * (y - py) - sin * (x - px)))
        legs = []
        for hip, wheel in self._ends:
            (hx, hy, hz), (wx, wy, wz) = kinematics.position(hip).tolist(), kinematics.position(wheel).tolist()
            x = hx - wx
            y = hy - wy
            legs.append((cos * x + sin * y, cos * y - sin * x, hz - wz))
        self.polygon.measure_legs(legs)

    def _balance(self) -> np.ndarray:
        robot = self.model
        if self.tags.balance == "center_of_mass":
            return robot.center_of_mass.value
        pressed = sum(max(float(robot.contacts[wheel.name].force[2]), 0.0) for wheel in self._wheels)
        if pressed < PRESSED * self._weight:
            return robot.center_of_mass.value
        return robot.center_of_pressure.value

    def _react(self) -> None:
        """Move the references with the velocity that brings the polygon under the robot."""
        robot = self.model
        offsets = self._offsets
        references = self.references
        center = robot.center_of_mass
        np.dot(center.jacobian, robot.state.velocity, out=self._rate_of_center)
        (x, y, z), (px, py, _) = center.value.tolist(), robot.kinematics.position(self._base_link).tolist()
        vx, vy, _ = self._rate_of_center.tolist()
        ground = float(offsets.states[:, 2].min())
        cos = math.cos(offsets.heading)
        sin = math.sin(offsets.heading)
        dx = x - px
        dy = y - py
        seen = cos * dx + sin * dy, cos * dy - sin * dx, z - ground
        rate = cos * vx + sin * vy, cos * vy - sin * vx
        ux, uy = self.reaction.update(offsets.states.tolist(), seen, rate, self.time_step)
        self._is_paced = self._has_paced and not self.reaction.is_active
        if self.reaction.is_active:
            references.pace = 1.0
            # wheels point to where the robot falls, and nothing pulls it back; footprint and place are what it gets
            references.vertices[:, :2] = offsets.states[:, :2]
            references.position[:2] = self._points[POINTS[BASE]].value[3:5]
            references.velocity[0] += cos * ux - sin * uy
            references.velocity[1] += sin * ux + cos * uy
        self._reaction[:] = cos * ux - sin * uy, sin * ux + cos * uy

    def _find_errors(self) -> None:
        """See `WheeledMotion._find_errors`: wheels steer faster under a robot that is pushed."""
        super()._find_errors()
        if self.reaction.is_active and STEERING in self._rows:
            self._error[self._rows[STEERING]] *= QUICKER

    def _warn(self) -> None:
        governor = self.governor
        tags = self.tags
        for name, reserve, is_lost in zip(
            self._names, governor.reserves.tolist(), governor.infeasible.tolist(), strict=False
        ):
            if is_lost:
                text = "%s: '%s' cannot be kept, %.3f m are missing: the motion %s"
                does = "holds" if tags.infeasible == "hold" else "slows down"
                self._throttle.warning(self._keys[name], text, self.name, name, -reserve, does)
            elif reserve < tags.warn_below:
                self._throttle.warning(name, "%s: %.3f m are left of '%s'", self.name, reserve, name)
        self._share[0] = governor.share

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """Receive what `wheeled_motion` does, and publish `<name>/support_margins`."""
        return (
            *super().topics(),
            TopicOut("support_margins", "solfer/SupportMargins", SupportMargins, collect=self._margins_now_and_then),
        )

    def _published_pace(self) -> float:
        return super()._published_pace() * self.governor.share

    def _margins_now_and_then(self) -> SupportMargins | None:
        self._left -= 1
        if self._left > 0:
            return None
        self._left = self._between
        return self.margins()

    def margins(self) -> SupportMargins:
        """Return what is published of the newest cycle."""
        governor = self.governor
        names = np.array(self._names)
        return SupportMargins(
            self._names,
            self._limits,
            tuple(governor.reserves.tolist()),
            active=tuple(names[governor.active].tolist()),
            infeasible=tuple(names[governor.infeasible].tolist()),
            share=governor.share,
            reaction=tuple(self._reaction.tolist()),
        )

    def start_log(self, logger: Any) -> None:
        """Declare margins and distances, too, and what is left of their limits."""
        super().start_log(logger)
        edges = ["-".join((self._links[first], self._links[second])) for first, second in self.polygon.edges]
        polygon = self.polygon if self.program is None else self.program.polygon
        logger.add("margins", polygon.margins, edges, "m")
        logger.add("workspaces", polygon.distances, self._links, "m")
        logger.add("reserves", self.governor.reserves, list(self._names or self._limit_names()), "m")
        logger.add("share", self._share, ["share"])
        logger.add("reaction", self._reaction, list("xy"), "m/s", "world")

    def _start_program(self) -> None:
        """Begin as the original does."""
        assert self.program is not None
        self.references.position[:] = self._pose.value[:3]
        self.references.camber[:] = 0.0
        self._measure_steering()
        self._aims[:] = self.steering_angles
        self.program.measure()
        self.program.polygon.start(self.program.places)
        self._world.start(self.program.places)
        self._before_camber[:] = self.stack.jacobian[self._rows[CAMBER]]
        self._before_steering[:] = self.stack.jacobian[self._rows[STEERING]]

    def _update_program(self, program: JointProgram) -> None:
        """Compute one cycle as the original does."""
        references = self.references
        stack = self.stack
        rows = self._rows
        robot = self.model
        super()._take_over(self._set_step(self.time_step))
        references.step(self.time_step)
        stack.update()
        rates = self._before_camber @ robot.state.velocity
        self._before_camber[:] = stack.jacobian[rows[CAMBER]]
        self._measure_steering()
        self._find_errors()
        np.multiply(self._gain, self._error, out=stack.velocity)
        count = rows[BASE].stop
        before = self._first.update(stack.jacobian[:count], stack.velocity[:count], stack.numbers[:count, 3])
        program.measure()
        self._sum_loads()
        program.solve(
            stack.jacobian[rows[CONSTRAINTS]],
            before,
            stack.jacobian[rows[BASE]],
            self._before_camber,
            rates,
            self._loads,
        )
        self._aims += self.time_step * (self._before_steering @ program.velocity)
        self._before_steering[:] = stack.jacobian[rows[STEERING]]
        directions = self._offsets.directions
        self._world.move(program.vertices, directions, self.time_step)
        jacobians = np.array([vertex.jacobian[:2] for vertex in self._offsets.vertices])
        self._world.see(program.places, directions, jacobians)
        find_soft(self.steering_angles, self._aims, ROUNDED, SOFT[STEERING], self._error[rows[STEERING]])
        count = len(self._links)
        vertices = slice(rows[VERTICES].start, rows[VERTICES].start + count)
        self._error[rows[VERTICES]] = 0.0
        self._error[vertices] = self._world.errors
        stack.jacobian[rows[VERTICES]] = 0.0
        stack.jacobian[vertices] = self._world.jacobian
        np.multiply(self._gain, self._error, out=stack.velocity)
        self._descent.update(stack.jacobian, stack.velocity, stack.numbers[:, 3])
        moved = self.moved
        self._velocity[moved] = self._descent.velocity[moved]
        self._position[moved] += self.time_step * self._velocity[moved]

    def _sum_loads(self) -> None:
        """Write the generalised force of the contacts minus the bias force."""
        robot = self.model
        np.negative(robot.dynamics.bias, out=self._loads)
        for wheel in self._wheels:
            contact = robot.contacts[wheel.name]
            self._loads += contact.force @ contact.jacobian[:3]
