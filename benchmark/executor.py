#!/usr/bin/env python3
"""Measures how well the RT layer keeps its periods.

Eight plugins run in `nodes/xbot` beside CENTAURO in PyBullet, which is another process, and beside a bare loop in C in
the same minute, where there is a compiler.

Run with `./run exec python benchmark/executor.py [SECONDS]` (default 20). At each rate the kernel places all processes
at first; then the layer has a processor of its own, by `schedule: cpus`, and the others keep off it. One plugin
commands the robot; each of the others receives the robot and the plugin before it and publishes references for the next
one. Times in microseconds; the overhead is a cycle without the components. As root the loops run under SCHED_FIFO.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from pathlib import Path

import yaml
from form import Figures, parser_of

from solfer.errors import MiddlewareError, UnknownName
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.plugins import PluginState
from solfer.segments.namespace import Namespace
from solfer.supervision import supervise
from solfer.telemetry.histograms import quantile, since
from solfer.telemetry.statistics import LOOP_HISTOGRAMS, LoopCount, RuntimeStatistics

REPOSITORY = Path(__file__).resolve().parents[1]
CONFIG = REPOSITORY / "config"
PLUGINS = 8
BEGIN = 60.0
"""Longest wait until everything runs [s]."""


def configuration(folder: Path, rate: float, cpus: Collection[int]) -> Path:
    """Write the file of a layer with `PLUGINS` plugins in a chain, which keeps to the processors `cpus`, if any."""
    tree = yaml.safe_load((CONFIG / "centauro.yaml").read_text())["mwoibn"]
    for place in (*tree["layers"].values(), *tree["robot"]["systems"].values()):
        place["file"] = str(CONFIG / place["file"])
    for name in ("actuators", "contacts"):
        tree["xbot"]["source"][name]["file"] = str(CONFIG / tree["xbot"]["source"][name]["file"])
    tree["ros"], names = {}, []
    dofs, interface = {"chain": "all", "type": "actuated", "mapping": "RBDL"}, {"position": True, "velocity": True}
    for index in range(PLUGINS):
        before, own = f"wanted_{index - 1}", f"wanted_{index}"
        tree["controller"][own] = {"type": "reference", "dofs": dofs, "interface": interface}
        tree["xbot"]["controller"][own] = {"sink": own}
        received = ["link_side_online", "imu_base"]
        if index > 1:
            tree["feedback"][before] = {"space": "JOINT", "dofs": dofs, "interface": interface, "function": "reference"}
            tree["xbot"]["feedback"][before] = {"source": before, "message": "solfer/JointCommand"}
            received.append(before)
        tree["robot"][f"chain_{index}"] = {
            "feedback": {"list": received},
            "actuators": {"read": False},
            "contacts": {"read": False},
        }
        names.append(f"plugin_{index}" if index else "joint_states")
        tree["modules"][names[-1]] = tree["modules"]["joint_states"] | {
            "robot": f"chain_{index}",
            "kinematics": True,
            "class": "solfer.components.joint_states:JointStates",
        }
        if index:
            tree["modules"][names[-1]]["controller"] = [own]
    (folder / "main.yaml").write_text(yaml.safe_dump({"mwoibn": tree}))
    layer = folder / "layer.yaml"
    layer.write_text(
        yaml.safe_dump(
            {
                "XBotRTPlugins": {"plugins": names},
                "mwoibn": {"config_file": str(folder / "main.yaml")},
                "executor": {"rate": rate, "start": names, "blend": 0.5, "schedule": {"cpus": sorted(cpus)}},
            }
        )
    )
    return layer


def compiled(folder: Path) -> Path | None:
    """Compile the loop in C, if that is possible here."""
    compiler = shutil.which("gcc")
    if compiler is None:
        return None
    program = folder / "periodic"
    subprocess.run([compiler, "-O2", "-o", program, Path(__file__).with_name("periodic.c")], check=True)
    return program


def wait_for_robot(name: str) -> None:
    """Wait until the simulator describes its robot in a namespace."""
    end = time.monotonic() + BEGIN
    with closing(XbotMiddleware(Namespace(name), "benchmark")) as node:
        while time.monotonic() < end:
            with suppress(UnknownName):
                node.parameter("/robot_description")
                return
            time.sleep(0.1)
    raise SystemExit("the simulator does not describe its robot")


@contextmanager
def simulated_layer(
    layer: Path, environment: Mapping[str, str], robot: Path = CONFIG / "robots" / "centauro" / "robot.yaml"
) -> Iterator[tuple[Namespace, list[subprocess.Popen]]]:
    """Run a real-time layer beside a simulated robot; yields its namespace, and its processes, which end with it."""
    namespace = Namespace(f"benchmark-{os.getpid()}")
    processes: list[subprocess.Popen] = []
    world = CONFIG / "worlds" / "flat.yaml"
    try:
        for node, *arguments in (("xbot_simulator", "--robot", robot, "--world", world), ("xbot", layer)):
            command = [sys.executable, REPOSITORY / "nodes" / node, *arguments, "--namespace", namespace.name]
            processes.append(subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL))
            wait_for_robot(namespace.name)
        wait_for_all(namespace, processes)
        yield namespace, processes
    finally:
        end(processes)
        shutil.rmtree(namespace.folder, ignore_errors=True)


def wait_for_all(namespace: Namespace, processes: list[subprocess.Popen]) -> RuntimeStatistics:
    """Wait until all plugins run; returns the statistics."""
    end = time.monotonic() + BEGIN
    while time.monotonic() < end:
        time.sleep(0.1)
        if any(process.poll() is not None for process in processes):
            raise SystemExit("a process has ended")
        try:
            statistics = RuntimeStatistics.attach(namespace.folder)
        except MiddlewareError:
            continue
        if all(statistics.state(index) is PluginState.RUNNING for index in range(len(statistics.plugins))):
            return statistics
    raise SystemExit(
        "\n".join(
            f"{name}: {statistics.state(index).name} {statistics.text(index)}"
            for index, name in enumerate(statistics.plugins)
        )
    )


def measure(rate: float, seconds: float, apart: bool, figures: Figures) -> None:
    """Run all processes, the layer perhaps `apart` from the others, and print their figures."""
    everywhere = os.sched_getaffinity(0)
    own = {max(everywhere)} if apart else set()
    rest = everywhere - own
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        name = f"benchmark-{os.getpid()}-{rate:.0f}"
        namespace = Namespace(name)
        stack.callback(shutil.rmtree, namespace.folder, ignore_errors=True)
        processes: list[subprocess.Popen] = []
        stack.callback(end, processes)
        for node, *arguments in (
            (
                "xbot_simulator",
                "--robot",
                str(CONFIG / "robots" / "centauro" / "robot.yaml"),
                "--world",
                str(CONFIG / "worlds" / "flat.yaml"),
            ),
            ("xbot", str(configuration(folder, rate, own))),
        ):
            processes.append(
                subprocess.Popen(
                    [sys.executable, str(REPOSITORY / "nodes" / node), *arguments, "--namespace", name],
                    env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
                    stdout=subprocess.DEVNULL,
                )
            )
            os.sched_setaffinity(processes[-1].pid, everywhere if node == "xbot" else rest)
            wait_for_robot(name)
        statistics, program = wait_for_all(namespace, processes), compiled(folder)
        time.sleep(1.0)
        before, skipped, bare = statistics.histograms.copy(), statistics.counts[LoopCount.SKIPPED], None
        cycles = round(seconds * rate)
        if program is not None:
            bare = subprocess.Popen(
                [program, str(round(1e9 / rate)), str(cycles), "60" if os.geteuid() == 0 else "0"],
                stdout=subprocess.PIPE,
                text=True,
            )
            os.sched_setaffinity(bare.pid, rest)
        time.sleep(seconds)
        report(figures, statistics, before, statistics.counts[LoopCount.SKIPPED] - skipped)
        for index, plugin in enumerate(statistics.plugins):
            if statistics.state(index) is not PluginState.RUNNING:
                state = f"{statistics.state(index).name} {statistics.text(index)}"
                print(f"not counted in all cycles: {plugin} is {state}", file=sys.stderr)
        if bare is not None:
            p50, p99, longest, missed = bare.communicate()[0].split()
            late = {"p50_us": float(p50), "p99_us": float(p99), "max_us": float(longest)}
            figures.row("C loop: lateness", **late, skipped=int(missed))


def report(figures: Figures, statistics: RuntimeStatistics, before, skipped: int) -> None:
    """Print the figures of the layer since a snapshot."""
    histograms = since(statistics.histograms, before)
    count = int(histograms[0, 0])
    print(statistics.text(), file=sys.stderr)
    figures.row("layer", rate=statistics.rate, plugins=len(statistics.plugins), cycles=count)
    for row, name in enumerate(LOOP_HISTOGRAMS):
        p50, p99 = (1e-3 * quantile(histograms[row], share) for share in (0.5, 0.99))
        left_out = skipped if name == "lateness" else None
        figures.row(name, p50_us=p50, p99_us=p99, max_us=1e-3 * histograms[row, 1], skipped=left_out)
    for stage, name in enumerate(statistics.stages):
        middle = sum(
            quantile(histograms[statistics.row(plugin, stage)], 0.5) for plugin in range(len(statistics.plugins))
        )
        figures.row(f"{name}, all plugins", p50_us=1e-3 * middle, p99_us=None, max_us=None, skipped=None)


def end(processes: list[subprocess.Popen]) -> None:
    """End all processes."""
    for process in reversed(processes):
        process.terminate()
        process.wait(30.0)


def main() -> None:
    """Measure at both shipped rates."""
    parser = parser_of(__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=20.0, help="at each rate (default: %(default)g)")
    given = parser.parse_args()
    ways = (False, True) if len(os.sched_getaffinity(0)) > 1 else (False,)
    for rate in (500.0, 1000.0):
        for apart in ways:
            measure(rate, given.seconds, apart, Figures(given.json))


if __name__ == "__main__":
    supervise()
    main()
