#!/usr/bin/env python3
"""Switches components on and off at random, and prints what that leaves behind and what a cycle costs before and after.

Run with `./run exec python benchmark/switching.py [--switches N] [--seed S] [--layer rt|ros|both]`. With `rt` three
plugins of a real-time layer in shared memory, of which two can run side by side, are switched by the layer's services
on a virtual clock; with `ros` two plugins of one node beside a simulator and a master of their own. Counted are
threads, open files and, in the layer, segments and entries of the claims, when all plugins are off. Exit code 1 if more
is left at the end than after the first use of each, or if topics and services are left when the node has ended.
"""

import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path

from form import Figures, parser_of

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY / "test"))

from support.plugins.components import parts  # noqa: E402

from solfer.middleware.ros.node.launch import Launch, free_port  # noqa: E402
from solfer.supervision import supervise  # noqa: E402

END = 20.0
"""Longest time until a node has ended [s]."""

TIMES = 5
"""How often a cost is measured: it differs by a half from one start of the plugins to the next."""


def show(figures: Figures, layer: str, held: tuple[Mapping[str, int], ...], costs: tuple[float, ...]) -> None:
    """Print the rows of a layer."""
    for name in held[0]:
        figures.row(f"{layer}, {name}", before=held[0][name], after=held[1][name])
    figures.row(f"{layer}, cycle [us]", before=costs[0], after=costs[1])


def typical(cost: Callable[[], float]) -> float:
    """Measure a cost several times; return the median."""
    return statistics.median(cost() for _ in range(TIMES))


def switch_layer(figures: Figures, switches: int, seed: int) -> list[str]:
    """Switch the plugins of a real-time layer; return what is left."""
    from support.realtime.switching import STAY, SwitchedLayer

    with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
        layer = SwitchedLayer(Path(folder), seed)
        layer.cost()  # resets the robot: each plugin connects to what the lower level publishes then
        layer.switch_each()
        before = typical(layer.cost), layer.held()
        layer.switch_at_random(switches)
        after = typical(layer.cost), layer.held()
        title = f"RT: {layer.switches} switches, {layer.refused} refused"
        show(figures, title, (before[1], after[1]), costs=(before[0], after[0]))
        layer.close()
        left = [segment for segment in layer.segments() if segment not in STAY]
    return left + [f"RT: more {name}" for name in before[1] if after[1][name] > before[1][name]]


def switch_node(figures: Figures, switches: int, seed: int) -> list[str]:
    """Switch the plugins of a ROS node; return what is left."""
    import rospy
    from support.ros.switched_node import WAIT, SwitchedNode, left_at_master

    names = ("springs", "drives")
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        launch = Launch(["solfer", "simulation.launch"], folder / "log" / "launch", free_port())
        stack.enter_context(launch).wait_for_master(WAIT)
        rospy.init_node("switching", disable_signals=True)
        rospy.wait_for_service("/lower_level/list_controllers", WAIT)
        program = [sys.executable, str(REPOSITORY / "test" / "ros" / "several.py"), str(parts(folder)), *names]
        with (folder / "node").open("w") as log, subprocess.Popen(program, stdout=log, stderr=log) as process:
            try:
                node = SwitchedNode(names, names, seed)
                node.switch_at_random(len(names))
                before = typical(node.cost), node.held()
                node.switch_at_random(switches)
                after = typical(node.cost), node.held()
            finally:
                process.terminate()
                process.wait(END)
        show(figures, f"ROS: {node.switches} switches", (before[1], after[1]), costs=(before[0], after[0]))
        left = left_at_master()
        rospy.signal_shutdown("done")
    return left + [f"ROS: more {name}" for name in before[1] if after[1][name] > before[1][name]]


def main() -> int:
    """Switch, and print what is left."""
    parser = parser_of(__doc__)
    parser.add_argument("--switches", type=int, default=1000, help="switches in each layer (default: 1000)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the switches (default: 0)")
    parser.add_argument(
        "--layer", choices=("rt", "ros", "both"), default="both", help="what is switched (default: both)"
    )
    options = parser.parse_args()
    figures = Figures(options.json)
    left = switch_layer(figures, options.switches, options.seed) if options.layer != "ros" else []
    left += switch_node(figures, options.switches, options.seed) if options.layer != "rt" else []
    figures.row("left at the end", count=len(left), names=", ".join(left))
    return 1 if left else 0


if __name__ == "__main__":
    supervise()
    sys.exit(main())
