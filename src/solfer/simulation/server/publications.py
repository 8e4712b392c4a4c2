"""The topics that a simulated robot publishes, their rates, and its parameters, where these are not set already."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from solfer.model.urdf.cut import cut
from solfer.model.urdf.description import Description
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.sensors import Rates
from solfer.simulation.server.rates import every
from solfer.simulation.simulation import Simulation
from solfer.transport.endpoints import Writer
from solfer.transport.messages import Message
from solfer.transport.middleware import Middleware


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
    """List all that a simulated robot publishes.

    Raises:
        SimulationError: A rate is not the rate of the steps divided by a whole number.
    """
    sensors = simulation.sensors

    def single(rate: str, topic: str, message: str, measure: Callable[[], Message]) -> Publication:
        steps = every(getattr(rates, rate), rates.where(rate))
        return Publication(steps, [middleware.writer(topic, message)], lambda: (measure(),))

    published = [single("joints", "joint_states", "sensor_msgs/JointState", sensors.joints.measure)]
    if simulation.floating:
        published.append(single("base", "floating_base", "nav_msgs/Odometry", simulation.base_message))
    if sensors.motors is not None:
        published.append(single("motors", "motor_states", "sensor_msgs/JointState", sensors.motors.measure))
    if sensors.imu is not None:
        published.append(single("imu", "imu", "sensor_msgs/Imu", sensors.imu.measure))
    if sensors.contacts.names:
        topics = [f"contacts/{name}{axes}" for name in sensors.contacts.names for axes in ("", "/link")]
        writers = [middleware.writer(topic, "geometry_msgs/WrenchStamped") for topic in topics]
        published.append(Publication(every(rates.contacts, rates.where("contacts")), writers, sensors.contacts.measure))
    return published


def robot_parameters(bundle: BundleRecord) -> dict[str, str]:
    """Read the model, groups and partial models of a robot, by the names of their parameters.

    Raises:
        ModelError, ConfigError: A file of the bundle is wrong.
    """
    description = Description.from_file(bundle.urdf.location)
    found = {"/robot_description": description.text}
    if bundle.srdf is not None:
        found["/robot_semantic_description"] = bundle.srdf.location.read_text()
    return found | {f"/robot_{name}": cut(description, part.at, part.keep) for name, part in bundle.parts.items()}
