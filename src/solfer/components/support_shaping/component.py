"""The component `support_shaping`."""

from typing import Any

import numpy as np

from solfer.components.support_shaping.original import OriginalShaping
from solfer.components.support_shaping.shaping import FootprintShaping
from solfer.components.support_shaping.tags import SupportShapingTags
from solfer.components.wheeled_motion import WheeledMotion
from solfer.components.wheeled_motion.component import LIMITS
from solfer.components.wheeled_motion.tags import BASE, CAMBER, CASTER, CONSTRAINTS, STEERING, VERTICES
from solfer.errors import ComponentError
from solfer.interfaces.declaration import LiveParameter, TopicIn, TopicOut
from solfer.interfaces.support import SupportMargins
from solfer.robot import Robot


class SupportShaping(WheeledMotion):
    """Drives as `wheeled_motion` does, and keeps the balance inside the support polygon and wheels near their hips.

    The balance is the centre of pressure of the contacts' forces, which `ground_forces` writes on the same Robot, or
    the centre of mass. Velocities of the vertices are those that are desired as long as margins and workspaces allow.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        shaping: Changes what is desired.
        original: Moves as the original does; None unless the law is original.

    Raises:
        SolferError: A tag does not fit the robot.
        SolferErrors: Several of these.
    """

    Tags = SupportShapingTags

    _WHEEL_SIZES = ("margins", "workspaces")
    """Tags of distances of each wheel."""

    _SHAPING = ("margin_gain", "workspace_gain", "horizon", "recovery", "reactive_margin")
    """Tags of how these are kept."""

    def __init__(self, robot: Robot, tags: SupportShapingTags, name: str = "support_shaping"):
        super().__init__(robot, tags, name)
        count = len(self.wheels.links)
        if count < 3:
            raise ComponentError(
                f"a support polygon of {count} wheels", where=tags.where("track"), expected="3 or more"
            )
        needed = (CONSTRAINTS, BASE, STEERING, VERTICES, CAMBER, CASTER) if tags.is_original else (BASE, VERTICES)
        if missing := [task for task in needed if task not in self.tasks.rows]:
            raise ComponentError(
                f"no {', '.join(missing)} among the tasks", where=tags.where("IK"), expected=", ".join(needed)
            )
        self.shaping = FootprintShaping(robot, tags, self.name, wheels=self.wheels, references=self.references)
        self.original: OriginalShaping | None = None
        if tags.is_original:
            self.dynamics = True
            self.original = OriginalShaping(
                robot, tags, self.wheels, tasks=self.tasks, references=self.references, joints=self.joints
            )

    def live_parameters(self) -> tuple[LiveParameter, ...]:
        """Offer margins, workspaces and how they are kept, beside what `WheeledMotion` offers."""
        return (
            *super().live_parameters(),
            *(LiveParameter((key,), self._take_sizes, self._sizes_of) for key in self._WHEEL_SIZES),
            *(LiveParameter((key,), self._take_shaping, self._shaping_of) for key in self._SHAPING),
            LiveParameter(("warn_below",)),
        )

    def _take_limits(self, numbers: np.ndarray) -> None:
        """See `WheeledMotion._take_limits`."""
        super()._take_limits(numbers)
        self.shaping.governor.speed = float(numbers[LIMITS.index("vertex_speed")])

    def _sizes_of(self, tags: SupportShapingTags) -> list[tuple[float, ...]]:
        return [tags.each(key, len(self.wheels.links)) for key in self._WHEEL_SIZES]

    def _shaping_of(self, tags: SupportShapingTags) -> list[float]:
        return [getattr(tags, key) for key in self._SHAPING]

    def _take_sizes(self, numbers: np.ndarray) -> None:
        """Go on with other numbers of `_WHEEL_SIZES`, shape (2, count) [m]."""
        self.shaping.governor.limits[:] = numbers
        if self.original is not None:
            self.original.program.limits[:] = numbers

    def _take_shaping(self, numbers: np.ndarray) -> None:
        """Go on with other numbers of `_SHAPING`."""
        values = numbers.tolist()
        gains = values[:2]
        horizon, recovery, self.shaping.reaction.margin = values[2:]
        self.shaping.governor.tune(gains, horizon, recovery)
        if self.original is not None:
            self.original.program.weigh(gains)

    def _set_step(self, step: float) -> float:
        """See `WheeledMotion._set_step`."""
        self.shaping.governor.set_period(step)
        if self.original is not None:
            self.original.program.wheels.period = step
        return super()._set_step(step)

    def init(self) -> None:
        """Start from where the robot is, at rest."""
        super().init()
        self.shaping.start()
        if self.original is not None:
            self.original.start(self._steering)

    def update(self) -> None:
        """Compute one cycle."""
        if self.original is None:
            super().update()
            self.shaping.restore()
            return
        step = self.time_step
        super()._take_over(self._set_step(step))
        self.original.update(self._steering, step)

    def _take_over(self, gap: float) -> None:
        """Write what is received to the references, as far as the limits allow."""
        super()._take_over(gap)
        self.shaping.update(self.tags, self.time_step)
        self._pace.is_found = self.tags.is_paced and not self.shaping.reaction.is_active

    def _find_errors(self) -> None:
        """See `WheeledMotion._find_errors`: wheels steer faster under a robot that is pushed."""
        super()._find_errors()
        if self.shaping.reaction.is_active and STEERING in self.tasks.rows:
            self.tasks.rates.error[self.tasks.rows[STEERING]] *= 5.0

    def topics(self) -> tuple[TopicIn | TopicOut, ...]:
        """Receive what `wheeled_motion` does, and publish `<name>/support_margins`."""
        margins = self.shaping.report.margins
        return (
            *super().topics(),
            TopicOut("support_margins", "solfer/SupportMargins", SupportMargins, collect=margins, rate=20.0),
        )

    def _published_pace(self) -> float:
        return super()._published_pace() * self.shaping.governor.ratio

    def start_log(self, logger: Any) -> None:
        """Declare margins and distances, too, and what is left of their limits."""
        super().start_log(logger)
        links = self.wheels.links
        report = self.shaping.report
        polygon = self.shaping.measure.polygon
        edges = ["-".join((links[first], links[second])) for first, second in polygon.edges]
        if self.original is not None:
            polygon = self.original.program.wheels.polygon
        logger.add("margins", polygon.margins, edges, "m")
        logger.add("workspaces", polygon.distances, links, "m")
        logger.add("reserves", self.shaping.governor.reserves, list(report.names), "m")
        logger.add("share", report.ratio, ["share"])
        logger.add("reaction", report.reaction, list("xy"), "m/s", "world")
