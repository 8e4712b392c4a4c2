#!/usr/bin/env python3
"""Measures how soon a change of a live parameter takes effect: from the request to the first cycle that has it.

Run with `./run exec python benchmark/parameters.py [--changes N] [--layer rt|ros|both] [--json]`. `joint_states` runs
beside CENTAURO in PyBullet: with `rt` in a real-time layer, with `ros` in a node with a master of its own. The time
until the reply is there, too. Exit code 1: half of the changes take longer than 10 ms in the layer, or 50 ms under ROS.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np
import yaml
from executor import BEGIN, CONFIG, REPOSITORY, end, simulated_layer
from form import Figures, parser_of

from solfer.interfaces.declaration import Accepted
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.supervision import supervise
from solfer.transport.parameters import SET_INTERFACE, SET_PARAMETERS, SetParameters

sys.path.insert(0, str(REPOSITORY / "test"))
from support.plugins.stamped import FILE  # noqa: E402

GOALS = {"rt": 0.010, "ros": 0.050}
"""Longest median [s]."""

SERVICE = f"joint_states/{SET_PARAMETERS}"
PAUSE = 0.0317  # [s]; no multiple of a period, so that requests come at any time of a cycle


def prepare(folder: Path) -> tuple[Path, Path, dict[str, str]]:
    """Write the files of a plugin and of a layer; return them, and the environment of their processes."""
    for each in CONFIG.iterdir():
        (folder / each.name).symlink_to(each)
    tree = yaml.safe_load((CONFIG / "centauro.yaml").read_text())
    tree["mwoibn"]["modules"]["joint_states"]["class"] = "support.plugins.stamped:Stamped"
    main, layer, stamp = (folder / name for name in ("main.yaml", "layer.yaml", "stamp"))
    main.write_text(yaml.safe_dump(tree))
    plugins = {"XBotRTPlugins": {"plugins": ["joint_states"]}, "executor": {"start": ["joint_states"]}}
    layer.write_text(yaml.safe_dump(plugins | {"mwoibn": {"config_file": str(main)}}))
    stamp.write_bytes(bytes(8))
    path = f"{REPOSITORY / 'test'}:{os.environ.get('PYTHONPATH', '')}"
    return main, layer, os.environ | {FILE: str(stamp), "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}


def measure(name: str, ask: Callable[[SetParameters], bool], stamp: Path, changes: int, figures: Figures) -> bool:
    """Change a parameter again and again, print how long that takes, and return whether the goal is met."""
    effects, replies = [], []
    written = np.memmap(stamp, dtype=np.int64, mode="r", shape=1)
    for number in range(changes):
        request = SetParameters(("speed",), (f"{0.5 + 0.001 * (number % 100):g}",))
        begin = time.monotonic_ns()
        if not ask(request):
            raise SystemExit("a change is refused")
        replies.append(1e-9 * (time.monotonic_ns() - begin))
        while written[0] < begin:
            time.sleep(0.0005)
        effects.append(1e-9 * (int(written[0]) - begin))
        time.sleep(PAUSE)
    for title, times in (("first cycle with it", effects), ("reply", replies)):
        p50, p99, longest = (1e3 * float(np.quantile(times, share)) for share in (0.5, 0.99, 1.0))
        figures.row(f"{name}: {title}", p50_ms=p50, p99_ms=p99, max_ms=longest, changes=changes)
    return float(np.median(effects)) <= GOALS[name]


def measure_layer(changes: int, figures: Figures) -> bool:
    """Measure in a real-time layer."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        _, layer, environment = prepare(folder)
        namespace, _ = stack.enter_context(simulated_layer(layer, environment))
        client = stack.enter_context(closing(XbotMiddleware(namespace, "client")))

        def ask(request: SetParameters) -> bool:
            return client.call(SERVICE, SET_INTERFACE, request, Accepted, BEGIN).success

        return measure("rt", ask, folder / "stamp", changes, figures)


def measure_node(changes: int, figures: Figures) -> bool:
    """Measure in a ROS node."""
    import rospy

    from solfer.middleware.ros.node.launch import Launch, free_port
    from solfer.srv import SetParameters as Interface

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        main, _, environment = prepare(folder)
        launch = Launch(["solfer", "simulation.launch"], folder / "log" / "launch", free_port())
        stack.enter_context(launch).wait_for_master(BEGIN)
        environment["ROS_MASTER_URI"] = os.environ["ROS_MASTER_URI"]
        rospy.init_node("client", disable_signals=True)
        stack.callback(rospy.signal_shutdown, "done")
        rospy.wait_for_service("/lower_level/list_controllers", BEGIN)
        processes: list[subprocess.Popen] = []
        stack.callback(end, processes)
        command = [sys.executable, REPOSITORY / "nodes" / "plugin", "-p", "joint_states", "-c", main]
        processes.append(subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL))
        rospy.wait_for_service(f"/{SERVICE}", BEGIN)
        proxy = rospy.ServiceProxy(f"/{SERVICE}", Interface)
        limit = time.monotonic() + BEGIN
        while not proxy(["speed"], ["0.5"]).success:
            if time.monotonic() > limit:
                raise SystemExit("the plugin does not start")
            time.sleep(0.1)
        return measure(
            "ros", lambda request: proxy(request.names, request.values).success, folder / "stamp", changes, figures
        )


def main() -> int:
    """Measure, and return the exit code."""
    parser = parser_of(__doc__)
    parser.add_argument("--changes", type=int, default=300, help="changes in each layer (default: 300)")
    parser.add_argument("--layer", choices=("rt", "ros", "both"), default="both", help="where (default: both)")
    options = parser.parse_args()
    figures = Figures(options.json)
    results = [measure_layer(options.changes, figures)] if options.layer != "ros" else []
    results += [measure_node(options.changes, figures)] if options.layer != "rt" else []
    return 0 if all(results) else 1


if __name__ == "__main__":
    supervise()
    sys.exit(main())
