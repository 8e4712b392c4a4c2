"""Listing 4 of the paper: how far points 15 cm off the hands are from the base, while the arms move.

python examples/listing_4.py [centauro | talos]
"""

from robots import choose

from solfer.points import Handler, LinearPoint, Norm


class Distances:
    """Distances of points off two links from a third link."""

    def __init__(self, robot, left, right, base):
        self.points = Handler(LinearPoint(link, robot) for link in (left, right, base))
        self.points.add(self.points[0] - self.points[2])
        self.points.add(self.points[1] - self.points[2])
        self.points.add(Norm(self.points.end(1)))
        self.points.add(Norm(self.points.end(1)))
        self.points[0].position.set_fixed((0.0, 0.0, -0.15))
        self.points[1].position.set_fixed((0.0, 0.0, -0.15))

    def update(self):
        self.points.update(jacobian=False)
        print(f"left hand {self.points.end(1).value[0]:.6f} m, right hand {self.points.end(0).value[0]:.6f} m", end="")


if __name__ == "__main__":
    robot, names = choose(__doc__)
    distances = Distances(robot, *robot.links(names.hands), names.base)
    for turn in range(4):
        robot.update()
        distances.update()
        print(f" from {names.base}, arm joints turned by {0.2 * turn:.1f} rad")
        robot.state.position[robot.selectors["arms"].indices] += 0.2
