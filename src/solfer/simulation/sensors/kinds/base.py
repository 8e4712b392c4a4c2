"""The true pose and twist of a floating base."""

from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.sensor import SingleSensor
from solfer.simulation.state import BaseMotion, SimulationState
from solfer.transport.messages import BodyMessage


class BaseSensor(SingleSensor):
    """Pose and twist of the base link's origin in the world.

    Args:
        state: What the robot does.
        base: The base.
    """

    name = "base"
    topic = "floating_base"
    message = "nav_msgs/Odometry"
    what = "pose and twist of a floating base"
    truth = True

    def __init__(self, state: SimulationState, base: BaseMotion):
        super().__init__(state)
        self._base, self._message = base, BodyMessage("world", base.link)

    @classmethod
    def of(cls, state: SimulationState, equipment: Equipment) -> "BaseSensor | None":
        """See `Sensor.of`."""
        return None if state.base is None else cls(state, state.base)

    def measure(self) -> BodyMessage:
        """Take one sample; the message is the same object each time."""
        base = self._base
        message = self._message
        message.stamp = self.state.time
        message.position[:], message.orientation[:] = base.position, base.orientation
        message.linear[:], message.angular[:] = base.linear, base.angular
        return message
