"""Listing 2 of the paper: inverse kinematics bring a hand to a reference.

python examples/listing_2.py [centauro | talos]
"""

import numpy as np
from robots import choose

from solfer.points import Constant, LinearPoint


class PointTracking:
    """Inverse kinematics of one point on a link."""

    def __init__(self, robot, link):
        self.robot = robot
        self.task = LinearPoint(link, robot)
        self.reference = Constant(self.task.size)
        self.ik = self.task - self.reference

    def update(self):
        self.robot.update()
        self.task.update()
        self.ik.update()
        self.robot.state.position -= np.linalg.pinv(self.ik.jacobian) @ self.ik.value


if __name__ == "__main__":
    robot, names = choose(__doc__, floating_base=False)
    hand = robot.links(names.hands)[0]
    tracking = PointTracking(robot, hand)
    tracking.reference.set(robot.kinematics.position(hand) + (0.0, 0.1, 0.1))
    print(f"{hand} of {robot.name} goes 0.1 m to the left and 0.1 m up")
    for step in range(6):
        tracking.update()
        print(f"step {step}: {np.linalg.norm(tracking.ik.value):.6f} m from the reference")
