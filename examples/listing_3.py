"""Listing 3 of the paper: centre of mass, and hands relative to the torso, reach their references all at once.

python examples/listing_3.py [centauro | talos]
"""

import numpy as np
from robots import choose

from solfer.points import Constant, Handler, LinearPoint


class TaskTracking:
    """Inverse kinematics of several tasks as one."""

    def __init__(self, robot, names):
        self.robot, self.tasks, self.references, self.ik = robot, Handler(), Handler(), Handler()
        self.track(robot.center_of_mass)
        self.tasks.add(LinearPoint(names.torso, robot))
        for link in robot.links(names.hands):
            self.track(self.tasks.add(LinearPoint(link, robot)) - self.tasks[1])
        self.tasks.update()

    def track(self, point):
        self.ik.add(self.tasks.add(point) - self.references.add(Constant(point.size)))

    def update(self):
        for each in (self.robot, self.tasks, self.ik):
            each.update()
        self.robot.state.position -= np.linalg.pinv(self.ik.jacobian) @ self.ik.value


if __name__ == "__main__":
    tracking = TaskTracking(*choose(__doc__))
    for minus, way in zip(tracking.ik, ((0.02, 0.0, -0.05), (0.1, 0.0, 0.0), (0.0, 0.0, 0.1)), strict=True):
        minus.second.set(minus.first.value + way)
    for step in range(6):
        tracking.update()
        com, *hands = (f"{np.linalg.norm(minus.value):.6f} m" for minus in tracking.ik)
        print(f"step {step}: centre of mass {com}, hands {' and '.join(hands)} from their references")
