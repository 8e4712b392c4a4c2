#!/usr/bin/env python3
"""A policy in the real-time layer at 500 Hz beside the simulator: how long it takes, and periods that are left out.

    pip install ".[policy]"
    ./run exec python benchmark/policy_layer.py [SECONDS] --runs 3 --json

The policy is that of `examples/policy`, on CENTAURO, 50 times a second; beside it is the layer with `joint_states`
in its place. Each run has processes of its own. Times are in microseconds, of the stage `component` in the layer's
statistics. The network runs in each tenth cycle: the p95 is the middle of those that have it, the p99.9 their p99.
`network` is one run of the network alone in this process, `network in the layer` that in the layer.
"""

import os
import tempfile
import time
from array import array
from pathlib import Path

import numpy as np
import yaml
from executor import REPOSITORY, simulated_layer, wait_for_all
from form import Figures, parser_of

from solfer.components.policy import Policy
from solfer.components.policy.network import PolicyNetwork
from solfer.supervision import supervise
from solfer.telemetry.histograms import quantile, since
from solfer.telemetry.statistics import LoopCount

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


def layer_of(folder: Path, plugin: str) -> Path:
    """Write the files of a layer with one plugin: `level` or `joint_states`."""
    tree = yaml.safe_load((EXAMPLE / "level.yaml").read_text())
    modules = tree["mwoibn"]["modules"]
    modules["level"] |= {"class": "policy_layer:TimedPolicy", "layer": "RT", "file": str(EXAMPLE / "level.onnx")}
    kept = ("layer", "robot", "controller", "mode", "kinematics", "dynamics", "model_change")
    joints = {"class": "solfer.components.joint_states:JointStates"}
    modules["joint_states"] = {key: modules["level"][key] for key in kept} | joints
    (folder / "main.yaml").write_text(yaml.safe_dump(tree))
    layer = folder / "layer.yaml"
    executor = {"rate": RATE, "start": [plugin], "blend": 0.5}
    main = {"config_file": str(folder / "main.yaml")}
    layer.write_text(yaml.safe_dump({"XBotRTPlugins": {"plugins": [plugin]}, "mwoibn": main, "executor": executor}))
    return layer


def measure(figures: Figures, plugin: str, seconds: float) -> None:
    """Run the layer with a plugin, and print a row."""
    with tempfile.TemporaryDirectory() as folder:
        layer = layer_of(Path(folder), plugin)
        times = Path(folder) / "times.npy"
        path = f"{Path(__file__).parent}:{os.environ.get('PYTHONPATH', '')}"
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": path, TIMES: str(times)}
        with simulated_layer(layer, environment) as (namespace, processes):
            statistics = wait_for_all(namespace, processes)
            time.sleep(1.0)
            before, skipped = statistics.histograms.copy(), statistics.counts[LoopCount.SKIPPED]
            time.sleep(seconds)
            found = since(statistics.histograms, before)
            row = found[statistics.row(0, list(statistics.stages).index("component"))]
            shares = {"p50": 0.5, "p95": 0.95, "p99": 0.99, "p99.9": 0.999}
            took = {f"{name}_us": 1e-3 * quantile(row, share) for name, share in shares.items()}
            left_out = int(statistics.counts[LoopCount.SKIPPED] - skipped)
            figures.row(plugin, cycles=int(found[0, 0]), **took, left_out=left_out)
        if times.exists():
            runs = np.load(times)[50:]  # without those of the start
            p50, p99 = np.percentile(runs, (50.0, 99.0)).tolist()
            figures.row("network in the layer", runs=len(runs), p50_us=p50, p99_us=p99)


def main() -> None:
    """Measure by turns."""
    parser = parser_of(__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=20.0, help="of each run (default: %(default)g)")
    parser.add_argument("--runs", type=int, default=3, help="runs of each (default: %(default)g)")
    given = parser.parse_args()
    figures = Figures(given.json)
    network = PolicyNetwork(EXAMPLE / "level.onnx")
    took = np.zeros(5000)
    for index in range(len(took)):
        begin = time.perf_counter()
        network.run()
        took[index] = time.perf_counter() - begin
    p50, p99 = (1e6 * np.percentile(took, (50.0, 99.0))).tolist()
    figures.row("network", p50_us=p50, p99_us=p99)
    for _ in range(given.runs):
        for plugin in ("joint_states", "level"):
            measure(figures, plugin, given.seconds)


if __name__ == "__main__":
    supervise()
    main()
