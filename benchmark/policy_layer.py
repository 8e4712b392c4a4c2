#!/usr/bin/env python3
"""A policy in the real-time layer at 500 Hz beside the simulator: how long it takes, and periods that are left out.

    pip install ".[policy]"
    ./run exec python benchmark/policy_layer.py [SECONDS] --runs 3 --json
    ./run exec python benchmark/policy_layer.py 30 --robot go2 --json     # with the packages of `policy.py`

The policy is that of `examples/policy`, on CENTAURO in PyBullet, 50 times a second, or one of `policy.py` in MuJoCo,
which a program beside the layer lets walk ahead at 0.5 m/s, by where the base truly is: `ahead_m` is its way
[m], and `held` says why the plugin does not run at the end. Beside it is the layer with `joint_states`
in its place. Each run has processes of its own. Times are in microseconds, of the stage `component` in the layer's
statistics. The network runs in each tenth cycle: the p95 is the middle of those that have it, the p99.9 their p99.
`network` is one run of the network alone in this process, `network in the layer` that in the layer.
"""

import math
import os
import tempfile
import time
from array import array
from contextlib import closing
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml
from executor import CONFIG, REPOSITORY, simulated_layer, wait_for_all
from form import Figures, parser_of
from policy import SPEED, make_robot
from policy_cases.robots import PERIOD, ROBOTS, WalkingRobot

from solfer.components.policy import Policy
from solfer.components.policy.network import PolicyNetwork
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.segments.namespace import Namespace
from solfer.simulation.engines import ENGINE_VARIABLE
from solfer.supervision import supervise
from solfer.telemetry.histograms import quantile, since
from solfer.telemetry.statistics import LoopCount
from solfer.transport.messages import FieldsMessage

RATE = 500.0  # [Hz]
EXAMPLE = REPOSITORY / "examples/policy"


TIMES = "BENCHMARK_TIMES"
"""Environment variable with the file to which a layer writes how long its network took."""


class TimedPolicy(Policy):
    """A policy that writes at its end how long each run of its network took [us]."""

    def make_network(self) -> PolicyNetwork:
        """See `Policy.make_network`."""
        network = super().make_network()
        self._took = array("d", bytes(8 * 100_000))
        self._runs = 0
        original = network.run

        def run() -> None:
            begin = time.perf_counter()
            original()
            self._took[self._runs % len(self._took)] = 1e6 * (time.perf_counter() - begin)
            self._runs += 1

        network.run = run  # type: ignore[method-assign]
        return network

    def close(self) -> None:
        """See `Component.close`."""
        np.save(os.environ[TIMES], np.array(self._took[: self._runs]))


class Case(NamedTuple):
    """A policy and its robot.

    Attributes:
        plugin: Name of the plugin.
        main: Its main configuration.
        bundle: The robot.
        network: The ONNX file.
        engine: The engine.
        robot: The robot that walks; None: it stands.
    """

    plugin: str
    main: Path
    bundle: Path
    network: Path
    engine: str
    robot: WalkingRobot | None = None


LEVEL = Case("level", EXAMPLE / "level.yaml", CONFIG / "robots/centauro/robot.yaml", EXAMPLE / "level.onnx", "bullet")


def walking(folder: Path, name: str) -> Case:
    """Make a robot that walks."""
    robot = ROBOTS[name]()
    main = make_robot(folder, name, robot, "plugin")
    bundle = main.parent / f"robots/{name}/robot.yaml"
    return Case("policy", main, bundle, robot.network, "mujoco", robot=robot)


def layer_of(folder: Path, case: Case, plugin: str) -> Path:
    """Write the files of a layer with one plugin: that of the policy, or `joint_states`."""
    tree = yaml.safe_load(case.main.read_text())
    part = tree["mwoibn"]
    part["xbot"] = part["ros"]
    modules = part["modules"]
    modules[case.plugin] |= {"class": "policy_layer:TimedPolicy", "layer": "RT", "file": str(case.network)}
    kept = ("layer", "robot", "controller", "mode", "kinematics", "dynamics", "model_change")
    joints = {"class": "solfer.components.joint_states:JointStates"}
    modules["joint_states"] = {key: modules[case.plugin][key] for key in kept} | joints
    (folder / "main.yaml").write_text(yaml.safe_dump(tree))
    layer = folder / "layer.yaml"
    executor = {"rate": RATE, "start": [plugin], "blend": 0.5}
    main = {"config_file": str(folder / "main.yaml")}
    layer.write_text(yaml.safe_dump({"XBotRTPlugins": {"plugins": [plugin]}, "mwoibn": main, "executor": executor}))
    return layer


def walk(namespace: Namespace, case: Case, seconds: float) -> float:
    """Let time pass, in which the robot walks ahead; returns its way [m]."""
    if case.robot is None:
        time.sleep(seconds)
        return 0.0
    steer = case.robot.steer()
    with closing(XbotMiddleware(namespace, "driver")) as node:
        base = node.reader("floating_base", "nav_msgs/Odometry")
        commands = node.writer(f"{case.plugin}/cmd_vel", "geometry_msgs/Twist")
        start = None
        now = begin = node.now()
        while now < begin + seconds:
            base.read()
            message = base.message
            rotation = rotation_from_quaternion(message.orientation)
            heading = math.atan2(rotation[1, 0], rotation[0, 0])
            measured = np.array((*message.linear[:2], message.angular[2]))
            x, y, yaw = steer(np.array((SPEED, 0.0, -heading)), measured, PERIOD).tolist()
            commands.write(FieldsMessage({"linear": {"x": x, "y": y}, "angular": {"z": yaw}}))
            start = message.position.copy() if start is None else start
            now += PERIOD
            node.sleep_until(now)
        return float(np.hypot(*(message.position - start)[:2]))


def measure(figures: Figures, case: Case, plugin: str, seconds: float) -> None:
    """Run the layer with a plugin, and print a row."""
    with tempfile.TemporaryDirectory() as folder:
        layer = layer_of(Path(folder), case, plugin)
        times = Path(folder) / "times.npy"
        path = f"{Path(__file__).parent}:{os.environ.get('PYTHONPATH', '')}"
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": path, TIMES: str(times)}
        environment[ENGINE_VARIABLE] = case.engine
        with simulated_layer(layer, environment, case.bundle) as (namespace, processes):
            statistics = wait_for_all(namespace, processes)
            time.sleep(1.0)
            before, skipped = statistics.histograms.copy(), statistics.counts[LoopCount.SKIPPED]
            walked = {}
            if plugin == case.plugin:
                walked = {"ahead_m": walk(namespace, case, seconds), "held": statistics.text(0) or "no"}
            else:
                time.sleep(seconds)
            found = since(statistics.histograms, before)
            row = found[statistics.row(0, list(statistics.stages).index("component"))]
            shares = {"p50": 0.5, "p95": 0.95, "p99": 0.99, "p99.9": 0.999}
            took = {f"{name}_us": 1e-3 * quantile(row, share) for name, share in shares.items()}
            left_out = int(statistics.counts[LoopCount.SKIPPED] - skipped)
            figures.row(plugin, cycles=int(found[0, 0]), **took, left_out=left_out, **walked)
        if times.exists():
            runs = np.load(times)[50:]  # without those of the start
            p50, p99 = np.percentile(runs, (50.0, 99.0)).tolist()
            figures.row("network in the layer", runs=len(runs), p50_us=p50, p99_us=p99)


def main() -> None:
    """Measure by turns."""
    parser = parser_of(__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=20.0, help="of each run (default: %(default)g)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each (default: %(default)g)")
    parser.add_argument("--robot", choices=("centauro", *ROBOTS), default="centauro", help="which one")
    given = parser.parse_args()
    figures = Figures(given.json)
    with tempfile.TemporaryDirectory() as folder:
        case = LEVEL if given.robot == "centauro" else walking(Path(folder), given.robot)
        network = PolicyNetwork(case.network)
        took = np.zeros(5000)
        for index in range(len(took)):
            begin = time.perf_counter()
            network.run()
            took[index] = time.perf_counter() - begin
        p50, p99 = (1e6 * np.percentile(took, (50.0, 99.0))).tolist()
        figures.row("network", p50_us=p50, p99_us=p99)
        for _ in range(given.runs):
            for plugin in ("joint_states", case.plugin):
                measure(figures, case, plugin, given.seconds)


if __name__ == "__main__":
    supervise()
    main()
