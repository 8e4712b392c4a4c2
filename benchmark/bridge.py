#!/usr/bin/env python3
"""Measures the time NRT -> RT -> NRT of a joint reference and a Point.

They go from a ROS node over the bridge into the RT layer, where a plugin receives them and publishes them in the same
cycle, and over the bridge back to the node.

Run with `./run exec python benchmark/bridge.py [MESSAGES]` (default 3000, at 100 Hz). Starts a ROS master of its own,
`xbot` and `xbot_bridge`. Messages leave at times that are independent of the bridge's cycle. Times in milliseconds.
"""

import contextlib
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterator
from pathlib import Path

import numpy as np
import yaml
from form import Figures, parser_of

from solfer.components import Component, Port
from solfer.middleware.bridge import Bridge
from solfer.middleware.ros import RosMiddleware, RosNode
from solfer.middleware.ros.node.launch import Launch, free_port
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.model.kinematics import Kinematics
from solfer.model.urdf.description import Description
from solfer.segments.namespace import Namespace
from solfer.simulation import find_robot, read_bundle
from solfer.simulation.server.publications import robot_parameters
from solfer.supervision import supervise
from solfer.transport.messages import JointMessage, VectorMessage

NODES = Path(__file__).resolve().parents[1] / "nodes"
JOINTS, POINT = "solfer/JointCommand", "geometry_msgs/PointStamped"
RATES = (500.0, 1000.0)
"""Rates of the layer [Hz]."""

INTERVAL = 0.01
"""Mean time between two messages [s]."""

BEGIN = 60.0
"""Longest wait until everything runs [s]."""

LOST = 1.0
"""A message that is not back after this time never comes [s]."""

LOOK = 5e-4
"""Time between two checks for what is back [s]; its arrival is recorded as it comes."""


class Echo(Component):
    """Publishes the Point that it receives; the pipes do so for the joints' references."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.inputs["goal"] = self.outputs["goal_back"] = Port("position")


def layer(folder: Path, rate: float) -> Path:
    """Write the file of a layer with the plugin alone."""
    joints = {
        "space": "JOINT",
        "dofs": {"chain": "all", "type": "actuated", "mapping": "RBDL"},
        "interface": {"position": True, "velocity": True},
    }
    point = {"space": "POINT", "quantity": "position"}
    tree = {
        "middleware": "XBOT",
        "system": "SM",
        "robot": {
            "name": "centauro",
            "rate": rate,
            "echo": {
                "feedback": {"list": ["commands", "goal"]},
                "actuators": {"read": False},
                "contacts": {"read": False},
            },
        },
        "feedback": {"commands": joints | {"function": "reference"}, "goal": point},
        "controller": {"wanted_back": joints | {"type": "reference"}, "goal_back": point | {"type": "reference"}},
        "xbot": {
            "source": {"urdf": "/robot_description", "srdf": "/robot_semantic_description"},
            "feedback": {
                "commands": {"source": "commands", "message": JOINTS, "layer": "NRT"},
                "goal": {"source": "goal", "message": POINT, "layer": "NRT"},
            },
            "controller": {
                "wanted_back": {"sink": "wanted_back", "message": JOINTS, "layer": "NRT"},
                "goal_back": {"sink": "goal_back", "message": POINT, "layer": "NRT"},
            },
        },
        "modules": {
            "echo": {
                "class": "bridge:Echo",
                "layer": "RT",
                "robot": "echo",
                "mode": "full",
                "controller": ["wanted_back", "goal_back"],
                "kinematics": False,
                "dynamics": False,
                "model_change": False,
            }
        },
    }
    (folder / "main.yaml").write_text(yaml.safe_dump({"mwoibn": tree}))
    file = folder / "layer.yaml"
    file.write_text(
        yaml.safe_dump(
            {
                "XBotRTPlugins": {"plugins": ["echo"]},
                "mwoibn": {"config_file": {"file": "main.yaml"}},
                "executor": {"start": ["echo"], "rate": rate},
            }
        )
    )
    return file


@contextlib.contextmanager
def processes(rate: float) -> Iterator[None]:
    """Run the layer and its bridge."""
    with contextlib.ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        name = f"benchmark-{os.getpid()}-{rate:g}"
        namespace = Namespace(name)
        stack.callback(shutil.rmtree, namespace.folder, ignore_errors=True)
        robot = stack.enter_context(contextlib.closing(XbotMiddleware(namespace, "robot")))
        for parameter, text in robot_parameters(read_bundle(find_robot("centauro"))).items():
            robot.provide(parameter, text)
        for node in ("xbot", "xbot_bridge"):
            command = [sys.executable, NODES / node, layer(folder, rate), "--namespace", name]
            environment = os.environ | {"PYTHONPATH": f"{Path(__file__).parent}:{os.environ.get('PYTHONPATH', '')}"}
            process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)
            stack.callback(end, process)
        yield


def end(process: subprocess.Popen) -> None:
    """End a process."""
    process.terminate()
    process.wait(30.0)


class Way:
    """One kind of message there and back.

    Args:
        ros: The node.
        topic: Topic there; that of the way back has `_back` behind it.
        message: Its message.
        make: Makes a message that holds a number.
        number: Finds it again.

    Attributes:
        sent: When the messages left that are not back yet, by their number [s].
        times: How long the others took [s].
    """

    def __init__(self, ros: RosMiddleware, topic: str, message: str, make: Callable, number: Callable):
        self._writer, self._reader = ros.writer(topic, message), ros.reader(f"{topic}_back", message)
        self._make, self._number, self._now = make, number, ros.now
        self._count, self.sent, self.times = 0, {}, []

    def send(self) -> None:
        """Send the next message."""
        self._count += 1
        message = self._make(float(self._count))
        self.sent[self._count] = self._now()
        self._writer.write(message)

    def receive(self) -> None:
        """Record the times of what is back; a message comes back with the next one if that overtook it."""
        if self._reader.read():
            newest = self._number(self._reader.message)
            for number in [number for number in self.sent if number <= newest]:
                self.times.append(self._reader.arrival - self.sent.pop(number))


def measure(ros: RosMiddleware, rate: float, messages: int, joints: tuple[str, ...], figures: Figures) -> None:
    """Send and receive, and print the distribution."""
    numbers = np.zeros(len(joints))

    def command(number: float) -> JointMessage:
        numbers[:] = number
        return JointMessage(joints, numbers, numbers)

    ways = {
        "joint reference": Way(ros, "commands", JOINTS, command, lambda message: message.position[0]),
        "Point": Way(
            ros,
            "goal",
            POINT,
            lambda number: VectorMessage("world", np.full(3, number)),
            lambda message: message.values[0],
        ),
    }
    with processes(rate):
        begin = ros.now()
        while not all(way.times for way in ways.values()):  # until all are connected
            if ros.now() > begin + BEGIN:
                raise SystemExit(f"nothing comes back within {BEGIN:g} s")
            exchange(ros, ways.values(), 10)
        exchange(ros, ways.values(), 100)
        for way in ways.values():
            way.times.clear()
        exchange(ros, ways.values(), messages)
    for name, way in ways.items():
        times = 1e3 * np.array(way.times)
        p50, p90, p99 = np.quantile(times, (0.5, 0.9, 0.99))
        late = 100.0 * float((times > 10.0).mean())
        largest = {"max_ms": float(times.max()), "above_10_ms_percent": late, "messages": len(times)}
        figures.row(f"{rate:.0f} Hz, {name}", p50_ms=float(p50), p90_ms=float(p90), p99_ms=float(p99), **largest)


def exchange(ros: RosMiddleware, ways: Collection[Way], messages: int) -> None:
    """Send messages, and receive until all are back, or lost."""
    due = ros.now()
    for _ in range(messages):
        due += random.uniform(0.5 * INTERVAL, 1.5 * INTERVAL)
        listen(ros, ways, due)
        for way in ways:
            way.send()
    listen(ros, ways, due + LOST)
    for way in ways:
        way.sent.clear()


def listen(ros: RosMiddleware, ways: Collection[Way], end: float) -> None:
    """Receive until a time [s]."""
    while (left := end - ros.now()) > 0.0:
        time.sleep(min(LOOK, left))
        for way in ways:
            way.receive()


def main() -> None:
    """Measure at each rate."""
    parser = parser_of(__doc__)
    parser.add_argument("messages", nargs="?", type=int, default=3000, help="of each way (default: %(default)s)")
    given = parser.parse_args()
    figures = Figures(given.json)
    bundle = read_bundle(find_robot("centauro"))
    model = Kinematics(Description.from_file(bundle.urdf.location))
    with tempfile.TemporaryDirectory() as folder, Launch(["--core"], Path(folder, "log"), free_port()) as system:
        system.wait_for_master(BEGIN)
        with contextlib.closing(RosMiddleware(RosNode("outside", ["outside"]))) as ros:
            figures.row("bridge", rate=1.0 / Bridge.PERIOD, load=os.getloadavg()[0])
            for rate in RATES:
                measure(ros, rate, given.messages, model.dofs[6:], figures)


if __name__ == "__main__":
    supervise()
    main()
