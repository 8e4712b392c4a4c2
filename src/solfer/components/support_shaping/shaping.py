"""Desired velocities that margins, workspaces, and pushes change."""

import numpy as np

from solfer.components.support_shaping.balance import BalanceMeasure
from solfer.components.support_shaping.governor import Reaction, SupportGovernor
from solfer.components.support_shaping.report import MarginsReport
from solfer.components.support_shaping.tags import SupportShapingTags
from solfer.components.wheeled_motion.references import KeptVelocities, References
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.numerics.planar_move import turned
from solfer.robot import Robot


class FootprintShaping:
    """Changes what is desired of base and vertices in a cycle, so that limits are kept.

    Args:
        robot: The Robot.
        tags: Tags of the component.
        name: Its name.
        wheels: The wheels.
        references: What is desired.

    Attributes:
        measure: Measures polygon and legs.
        governor: Keeps their limits.
        reaction: Moves the polygon under a robot that is pushed.
        report: What is published and logged.

    Raises:
        SolferError: A tag does not fit the robot.
    """

    def __init__(self, robot: Robot, tags: SupportShapingTags, name: str, wheels: DrivenWheels, references: References):
        count = len(wheels.links)
        self._wheels = wheels
        self._references = references
        self._kept = KeptVelocities(count)
        self.measure = BalanceMeasure(robot, tags, wheels)
        self.governor = SupportGovernor(
            np.array(tags.each("margins", count)),
            np.array(tags.each("workspaces", count)),
            (tags.margin_gain, tags.workspace_gain),
            horizon=tags.horizon,
            recovery=tags.recovery,
            speed=tags.vertex_speed,
            holds=tags.infeasible == "hold",
        )
        self.reaction = Reaction(count, tags.reactive_margin, 1.5)  # [m/s]
        self.report = MarginsReport(name, wheels.links, self.governor, edges=self.measure.polygon.edges)

    def start(self) -> None:
        """Begin with the whole motion, and the polygon as it is."""
        self.governor.start()
        self.measure.start()
        self.reaction.start(self.measure.polygon.edges)
        self.report.start(self.measure.polygon.edges)

    def update(self, tags: SupportShapingTags, step: float) -> None:
        """Change what is desired for a cycle of a time [s], until `restore`."""
        references = self._references
        governor = self.governor
        self._kept.keep(references)
        self.measure.update()
        governor.update(self.measure.polygon, references.vertex_velocity)
        references.vertex_velocity[:, :2] = governor.velocities
        references.velocity *= governor.ratio
        references.angular[2] *= governor.ratio
        if tags.reactive:
            self._react(step)
        self.report.warn(tags)

    def restore(self) -> None:
        """Let what is desired be what it was before `update`."""
        self._kept.restore(self._references)

    def _react(self, step: float) -> None:
        """Move the references with the velocity that brings the polygon under the robot."""
        references = self._references
        offsets = self._wheels.offsets
        seen, rate = self.measure.measure_center()
        velocity = turned(offsets.heading, *self.reaction.update(offsets.states.tolist(), seen, rate, step))
        if self.reaction.is_active:
            references.pace = 1.0
            # wheels point to where the robot falls, and nothing pulls it back; footprint and place are what it gets
            references.vertices[:, :2] = offsets.states[:, :2]
            references.position[:2] = self._wheels.place[:2]
            references.velocity[:2] += velocity
        self.report.reaction[:] = velocity
