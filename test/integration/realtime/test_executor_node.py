"""The node `xbot` in a process of its own, in lock-step with CENTAURO on the other side of shared memory."""

import contextlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.bus_clock import BusClock
from support.integration.world import CONFIG, STEP
from support.integration.xbot_system import WAIT, until
from support.integration.xbot_world import XbotWorld
from support.processes import SOURCES

from solfer.components.move_joints import MoveJoints, Reply
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.plugins import PluginState
from solfer.segments.namespace import SHARED_MEMORY
from solfer.telemetry.statistics import LoopCount, RuntimeStatistics

REPOSITORY = Path(__file__).parents[3]
GOAL = "mammal_wide_high"


class Stepped(XbotWorld):
    """A world in real shared memory, and the node, which goes by its time."""

    def __init__(self, name: str, file: Path):
        self._name, self.logged = name, []
        super().__init__(SHARED_MEMORY)
        self.namespace = Namespace(name)
        for parameter, value in self.bus.parameters.items():
            self._node.provide(parameter, value)
        self.asker = self.node("asker")
        self.bus.every(STEP, self.asker.poll)
        environment = os.environ | {
            "PYTHONPATH": f"{SOURCES}:{os.environ.get('PYTHONPATH', '')}",
            "OPENBLAS_NUM_THREADS": "1",
        }
        self.process = subprocess.Popen(
            [
                sys.executable,
                str(REPOSITORY / "nodes" / "xbot"),
                str(file),
                "--namespace",
                name,
                "--virtual-clock",
                "--trace",
                "1",
            ],
            env=environment,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        self._received()

    def node(self, name: str) -> XbotMiddleware:
        """See `XbotWorld.node`."""
        return XbotMiddleware(Namespace(self._name), name, self.bus.parameters, BusClock(self.bus))

    def _received(self) -> None:
        """Wait until the node has done what is due; what it logs stands between the times."""
        while True:
            line = self.process.stdout.readline()
            assert line, self.process.stderr.read()
            with contextlib.suppress(ValueError):
                float(line)
                return
            self.logged.append(line)

    def run(self, duration: float) -> None:
        """Let time pass in steps of the simulation, in both processes."""
        for _ in range(round(duration / STEP)):
            self.bus.run_until(self.bus.time + STEP)
            self.process.stdin.write(f"{self.bus.time!r}\n")
            self.process.stdin.flush()
            self._received()

    def move(self, state: str) -> Reply:
        """Ask `joint_states` to move the robot."""
        answer = self.asker.request("joint_states/trajectory", "solfer/MoveJoints", MoveJoints(state), Reply, 5.0)
        self.run(0.02)
        return answer.result(0)

    def end(self) -> int:
        """End the node as its terminal would."""
        self.process.stdin.close()
        code = self.process.wait(WAIT)
        self.process.stdout.close()
        self.process.stderr.close()
        return code

    def close(self) -> None:
        """End all."""
        self.process.kill()
        self.process.wait(WAIT)
        super().close()
        shutil.rmtree(self.namespace.folder)


@pytest.fixture
def layer_file(tmp_path):
    file = tmp_path / "layer.yaml"
    file.write_text(f"""
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {CONFIG / "centauro.yaml"}}}
executor: {{start: [joint_states], blend: 0.2}}
""")
    return file


def motion(name: str, file: Path) -> np.ndarray:
    """Positions while the node moves CENTAURO; the node ends in good order."""
    world, rows = Stepped(name, file), []
    try:
        world.run(1.0)
        assert RuntimeStatistics.attach(world.namespace.folder).state(0) is PluginState.RUNNING
        assert world.move(GOAL).success
        for _ in range(16):
            world.run(0.05)
            rows.append(world.simulation.q.copy())
        statistics = RuntimeStatistics.attach(world.namespace.folder)
        assert statistics.computed(0)["kinematics"] == 1  # at its start: `joint_states` asks for no more
        assert statistics.counts[LoopCount.SKIPPED] == 0  # nothing is skipped, however slow the machine is
        assert "cycle 1 joint_states publishes " in "".join(world.logged)
        assert world.end() == 0
        until(lambda: not statistics.alive, "the end of the node")
    finally:
        world.close()
    return np.array(rows)


def test_two_lockstep_runs_are_bitwise_equal(layer_file):
    first, second = (motion(f"test-{os.getpid()}-{run}", layer_file) for run in range(2))
    assert np.ptp(first, axis=0).max() > 0.1
    np.testing.assert_array_equal(first, second)
