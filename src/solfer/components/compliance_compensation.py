"""Positions of motors that bring the links of series elastic joints where others request them."""

import logging
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from solfer.components.base import Component
from solfer.components.desired_positions import DesiredPositions
from solfer.config import NameOf, Record
from solfer.errors import ComponentError, UnknownName
from solfer.robot import Robot

logger = logging.getLogger(__name__)


class ComplianceTags(Record):
    """Tags of `ComplianceCompensation`."""

    chain: Annotated[str, NameOf("group")] = Field(
        "all", description="SRDF group of the joints whose springs are compensated"
    )


class ComplianceCompensation(Component):
    """Moves the motors of series elastic joints beyond the desired links, by the deflection of the springs.

    A spring of stiffness K that carries the torque tau is turned by tau / K: motors at q + tau / K hold the links at q.
    q and tau are the desired positions and efforts that the pipes of the configuration write into the desired State, as
    of a plugin that compensates gravity. Joints without a spring get q. The result follows from these alone, and does
    not add up over cycles.
    """

    Tags = ComplianceTags

    def __init__(self, robot: Robot, tags: ComplianceTags | None = None, name: str = ""):
        super().__init__(robot, tags or ComplianceTags(), name or "compliance_compensation")
        self.kinematics = False
        self._compliance = _compliance(robot, self.tags)
        self._desired_positions = DesiredPositions(robot)
        self._position = np.zeros(robot.size)
        self._deflection = np.zeros(robot.size)

    def init(self) -> None:
        """Start with the joints that no other plugin moves where they are."""
        self._desired_positions.start()

    def update(self) -> None:
        """Compute where the motors have to be."""
        self._desired_positions.read()
        np.multiply(self.model.command.torque, self._compliance, out=self._position)
        self._position += self._desired_positions.values

    def send(self) -> None:
        """Write positions of the motors; velocities and efforts stay those that others request."""
        self._desired_positions.send(self._position)

    def start_log(self, logger: Any) -> None:
        """Declare how far the motors are commanded beyond the links, and where the links are to be."""
        logger.add("deflection", self._deflection, self.model.dofs)
        logger.add("reference", self._desired_positions.values, self.model.dofs)

    def log(self, logger: Any, time: float) -> None:
        """See `Component.log`: the deflection of the springs."""
        np.subtract(self._position, self._desired_positions.values, out=self._deflection)


def _compliance(robot: Robot, tags: ComplianceTags) -> np.ndarray:
    """Return 1 / K of the springs of a chain, 0 without a spring, shape (n,) [rad/Nm]."""
    try:
        chain = robot.selectors[tags.chain].indices
    except UnknownName as error:
        raise error.at(tags.where("chain")) from None
    stiffness = robot.actuators.stiffness
    compliance = np.zeros(robot.size)
    springs = chain[stiffness[chain] > 0.0]
    if not len(springs):
        if "chain" not in tags.model_fields_set:
            logger.warning("no joint of '%s' has a spring: nothing is compensated", robot.name)
            return compliance
        raise ComponentError(
            f"no joint of '{tags.chain}' has a spring",
            where=tags.where("chain"),
            expected="a robot configuration with `actuators: {read: true}`, and joints of the type SEA in their file",
        )
    compliance[springs] = 1.0 / stiffness[springs]
    return compliance
