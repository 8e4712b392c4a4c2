"""All sensors of a simulated robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

from solfer.simulation.robot_body.contacts import ContactDetector
from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.imu import Imu
from solfer.simulation.sensors.joints import JointSensors, MotorSensors
from solfer.simulation.sensors.wrenches import ContactSensors

if TYPE_CHECKING:
    from solfer.simulation.simulation import Simulation


class Sensors:
    """The sensors of a simulated robot.

    Args:
        simulation: The robot.
        contacts: Forces on the robot.
        equipment: What it measures with.

    Attributes:
        rates: Rates of publication.
        joints: Link side of the joints.
        motors: Motor side of the joints, or None.
        imu: Inertial measurement unit, or None.
        contacts: Wrenches on the contacts' links.

    Raises:
        UnknownName: The inertial measurement unit sits on a link that the robot does not have.
    """

    def __init__(self, simulation: Simulation, contacts: ContactDetector, equipment: Equipment):
        record = equipment.record
        self.rates = record.rates
        self.joints = JointSensors(simulation, record.joint_noise, record.seed)
        self.motors = None if equipment.actuators is None else MotorSensors(simulation, equipment.actuators)
        self.imu = None if record.imu is None else Imu(simulation, record.imu, record.seed)
        self.contacts = ContactSensors(simulation, contacts, equipment.contacts)

    def restart(self, seed: int | None = None) -> None:
        """Begin all noise anew; `seed` replaces the robot's own until the next restart."""
        self.joints.restart(seed)
        if self.imu is not None:
            self.imu.restart(seed)
