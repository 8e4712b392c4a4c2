"""What a simulated robot tells about itself, and how often."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from solfer.pipes.endpoints import Writer
from solfer.pipes.messages import Message
from solfer.pipes.middleware import Middleware
from solfer.simulation.rates import every
from solfer.simulation.sensors import Rates
from solfer.simulation.simulation import Simulation


@dataclass(frozen=True)
class Publication:
    """Messages that are written once every `steps` steps, one to each writer."""

    steps: int
    writers: Sequence[Writer]
    measure: Callable[[], Iterable[Message]]

    def publish(self) -> None:
        """Measure and write."""
        for writer, message in zip(self.writers, self.measure(), strict=True):
            writer.write(message)


def publications(simulation: Simulation, middleware: Middleware, rates: Rates) -> list[Publication]:
    """All that a simulated robot publishes.

    Raises:
        SimulationError: A rate is not the rate of the steps divided by a whole number.
    """
    sensors = simulation.sensors

    def single(rate: str, topic: str, message: str, measure: Callable[[], Message]) -> Publication:
        steps = every(getattr(rates, rate), rates.where(rate))
        return Publication(steps, [middleware.writer(topic, message)], lambda: (measure(),))

    told = [single("joints", "joint_states", "sensor_msgs/JointState", sensors.joints.measure)]
    if simulation.floating:
        told.append(single("base", "floating_base", "nav_msgs/Odometry", simulation.base_message))
    if sensors.motors is not None:
        told.append(single("motors", "motor_states", "sensor_msgs/JointState", sensors.motors.measure))
    if sensors.imu is not None:
        told.append(single("imu", "imu", "sensor_msgs/Imu", sensors.imu.measure))
    if sensors.contacts.names:
        topics = [f"contacts/{name}{axes}" for name in sensors.contacts.names for axes in ("", "/link")]
        writers = [middleware.writer(topic, "geometry_msgs/WrenchStamped") for topic in topics]
        told.append(Publication(every(rates.contacts, rates.where("contacts")), writers, sensors.contacts.measure))
    return told
