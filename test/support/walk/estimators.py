"""Estimators on the files of the walk: legs move, a wheel spins, one is lifted, torques swing."""

from pathlib import Path

import numpy as np
from support.robots import lower_body
from support.unit.golden import rolling_legs
from support.walk.digest import Digest

from solfer.components.ground_forces import GroundForces
from solfer.components.odometry import Odometry
from solfer.config import read
from solfer.interfaces.declaration import TopicOut
from solfer.model import History

RATE = 100.0
POSTURE = np.tile((-0.3, -1.57, -1.37, 0.2, 0.3, 0.0), 4) * np.repeat((1.0, -1.0, -1.0, 1.0), 6)


def estimating(component: type, key: str, stamped: bool = False):
    """Return the bench of a component on a motion that is given, with its tags in a file of the walk.

    Args:
        component: The component.
        key: Where its tags are in the file.
        stamped: Whether joints and base are measured message by message.
    """

    def run(folder: Path) -> str:
        robot, digest = lower_body(), Digest()
        made = component(robot, read(folder / "estimators.yaml", component.Tags, (key,)))
        made.set_rate(RATE)
        if stamped:
            dofs = np.arange(robot.size)
            robot.state.histories += [History(("position", "velocity"), part, 4) for part in (dofs[3:6], dofs[6:])]
        for k in range(110):
            move(robot, k)
            for history in robot.state.histories:
                history.clear()
                numbers = robot.state.position[history.dofs], robot.state.velocity[history.dofs]
                history.add(1.0 + k / RATE, k / RATE, np.array(numbers))
            robot.update()
            robot.dynamics.update()
            robot.state.torque[6:] = stand(robot, k)
            if k == 0:
                made.init()
            made.update()
            numbers = robot.state.position, robot.state.velocity, robot.contacts.wrenches
            published = [topic.collect() for topic in made.topics() if isinstance(topic, TopicOut)]
            digest.add([[array.tobytes().hex() for array in numbers], sorted(made.outputs), str(published)])
        return digest.text()

    return run


def stand(robot, k: int) -> np.ndarray:
    """Return the joints' torques of a robot that stands on forces which swing."""
    lifting = [(20.0 * np.sin(0.1 * k), 0.0, 120.0 + 150.0 * np.sin(0.1 * k + leg)) for leg in range(4)]
    jacobian = np.concatenate([contact.jacobian for contact in robot.contacts])[:12]
    return (robot.dynamics.bias - jacobian.T @ np.ravel(lifting))[6:]


def move(robot, k: int) -> None:
    """Write what is measured in a cycle: rest first, then legs and wheels move, and torques change."""
    time = max(k - 30, 0) / RATE
    q, v = rolling_legs(np.concatenate((np.zeros(6), POSTURE)), time)
    q[11] += 3.0 * time  # spins
    q[14] += 0.4 * time  # rises
    q[6] += 1e-5 * k  # creeps
    q[5] += 1e-4 * k
    robot.state.position[3:], robot.state.velocity[3:] = q[3:], v[3:] * (k > 30)
    robot.state.velocity[5] += 0.01
    robot.contacts.wrenches[:4, 2] = (200.0, 25.0, 210.0, 50.0)


ODOMETRY, GROUND = estimating(Odometry, "odometry"), estimating(GroundForces, "ground_forces")
STAMPED = estimating(Odometry, "odometry", stamped=True)
