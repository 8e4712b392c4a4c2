#!/usr/bin/env python3
"""Measures Fig. 5 of the paper as a real-time layer beside CENTAURO in PyBullet: standing, then driving.

Run with `./run exec python benchmark/figure_5.py [--rate HZ ...] [--seconds S] [--beside CLONE]`. `--beside` runs the
layer of another clone of solfer, which has its environment, by turns in the same minutes. The safe stop is off; the
base drives ahead and back. Times in microseconds, and those of the layer's loop in u too: one `pin.computeAllTerms` of
CENTAURO in the same minute. `--calls` counts the calls of Python functions in a cycle in memory, which do not depend
on the machine, and fails if they exceed those in `figure_5_calls.txt` by more than 2 %; `--profile` lists them by room
and by function, and the memory that a cycle allocates: what it still has at its end by line, and the most at one time.
"""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType
from unittest import mock

import yaml
from form import Figures, parser_of
from plugin import unit

from solfer.realtime.executor import Executor
from solfer.supervision import supervise

REPOSITORY = Path(__file__).resolve().parents[1]
KEPT = Path(__file__).with_name("figure_5_calls.txt")
GROWTH = 1.02
"""Ratio of the calls to those in KEPT above which they have grown."""

LAYER = {
    "XBotRTPlugins": {"plugins": ["inverse_kinematics::hands", "full_control"]},
    "executor": {"start": ["hands", "full_control"], "overruns": 1_000_000},
}
"""config/figures/figure_5.yaml without a safe stop."""

DRIVE = """
import sys, time
from solfer.middleware.shared_memory.middleware import XbotMiddleware
from solfer.transport.messages import FieldsMessage
try:
    from solfer.segments.namespace import Namespace
except ImportError:  # until version 0.2
    from solfer.middleware.shared_memory.memory.namespace import Namespace
node = XbotMiddleware(Namespace(sys.argv[1]), "driver")
writer = node.writer("locomotion/cmd_vel", "geometry_msgs/Twist")
begin = time.monotonic()
while time.monotonic() - begin < float(sys.argv[2]):
    ahead = 0.05 if (time.monotonic() - begin) % 8.0 < 4.0 else -0.05
    writer.write(FieldsMessage({"linear": (ahead, 0.0, 0.0), "angular": (0.0, 0.0, 0.0)}))
    time.sleep(0.02)
"""
"""Drives ahead and back; a program of its own, since another clone has another format of shared memory."""

BEGIN = 120.0
"""Longest wait until the plugins run [s]."""


class Layer:
    """A layer of a clone beside its simulator, watched by the commands that every version has.

    Args:
        clone: The clone's folder.
        rate: Cycles per second [Hz].
        folder: For its files.
    """

    def __init__(self, clone: Path, rate: float, folder: Path):
        self._clone = clone
        self._namespace = f"figure-5-{os.getpid()}"
        self._processes: list[subprocess.Popen] = []
        file = folder / "layer.yaml"
        main = {"config_file": {"file": str(clone / "config/centauro.yaml")}}
        file.write_text(yaml.safe_dump(LAYER | {"mwoibn": main}))
        robot = clone / "config/robots/centauro/robot.yaml"
        world = clone / "config/worlds/flat.yaml"
        self._start("nodes/xbot_simulator", "--robot", robot, "--world", world)
        self._start("nodes/xbot", file, "--rate", f"{rate:g}")
        self._wait()

    def _start(self, node: str, *arguments: object) -> None:
        command = [self._clone / "run", "exec", self._clone / node, *arguments, "--namespace", self._namespace]
        self._processes.append(
            subprocess.Popen(
                command,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
                stdout=subprocess.DEVNULL,
                start_new_session=True,
            )
        )

    def _ask(self, *words: str) -> subprocess.CompletedProcess[str]:
        command = [self._clone / "run", "exec", self._clone / "nodes/solfer", "rt", *words]
        return subprocess.run([*command, "--namespace", self._namespace], capture_output=True, text=True, check=False)

    def _wait(self) -> None:
        end = time.monotonic() + BEGIN
        while time.monotonic() < end:
            if any(process.poll() is not None for process in self._processes):
                raise SystemExit("a process has ended")
            _, *states = self._ask("state").stdout.splitlines() or [""]
            if states and all("RUNNING" in line for line in states):
                time.sleep(3.0)  # commands have blended in
                return
            time.sleep(0.5)
        raise SystemExit(f"not all plugins run: {states}")

    def times(self, seconds: float) -> tuple[dict[str, tuple[float, float]], int, int]:
        """Measure for a while; return p50 and p99 by row [us], overruns and periods left out."""
        command = [self._clone / "run", "exec", self._clone / "nodes/solfer", "rt", "top", "--every", f"{seconds:g}"]
        watch = subprocess.Popen(
            [*command, "--namespace", self._namespace],
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        tables: list[list[str]] = [[]]
        assert watch.stdout is not None
        for line in watch.stdout:
            tables[-1].append(line)
            if line.startswith("p50 and p99 are of"):
                if len(tables) == 2:
                    break
                tables.append([])
        os.killpg(watch.pid, signal.SIGINT)
        watch.wait(30.0)
        (skipped, overruns), (skipped_before, overruns_before) = map(counts, reversed(tables))
        return dict(rows(tables[-1])), overruns - overruns_before, skipped - skipped_before

    def drive(self, seconds: float) -> subprocess.Popen:
        """Let the base drive ahead and back for a time."""
        command = [self._clone / "run", "exec", "python", "-c", DRIVE, self._namespace, f"{seconds:g}"]
        return subprocess.Popen(command)

    def close(self) -> None:
        """End its processes."""
        for process in reversed(self._processes):
            os.killpg(process.pid, signal.SIGTERM)
            process.wait(30.0)


def counts(table: list[str]) -> tuple[int, int]:
    """Return the periods left out and the cycles too long since the start."""
    found = re.search(r"periods left out (\d+), cycles too long (\d+)", "".join(table))
    assert found, table
    return int(found[1]), int(found[2])


def rows(table: list[str]) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield each row of times: its name, p50 and p99 [us]."""
    begin = next(index for index, line in enumerate(table) if line.startswith("times [us]"))
    owner = ""
    for line in table[begin + 1 :]:
        words = line.split()
        if not words:
            return
        owner = owner if line.startswith(" ") else words[0]
        *name, p50, p99, _, _ = words
        if p50 != "-":
            yield f"{owner} {name[-1]}", (float(p50), float(p99))


@contextmanager
def running(clone: Path, rate: float) -> Iterator[Layer]:
    """Run a layer, which ends with the block."""
    with tempfile.TemporaryDirectory() as folder:
        layer = Layer(clone, rate, Path(folder))
        try:
            yield layer
        finally:
            layer.close()


def measure(clone: Path, rate: float, seconds: float, figures: Figures) -> None:
    """Print the figures of one clone at one rate."""
    size = unit(2000)
    with running(clone, rate) as layer:
        for motion in ("standing", "driving"):
            driver = layer.drive(seconds + 15.0) if motion == "driving" else None
            times, overruns, skipped = layer.times(seconds)
            title = f"{clone.name} {rate:g} Hz {motion}"
            figures.row(title, overruns=overruns, skipped=skipped, u_us=size)
            for name, (p50, p99) in times.items():
                is_loop = name.startswith("loop ")
                units = {"p50_u": p50 / size, "p99_u": p99 / size} if is_loop else {"p50_u": None, "p99_u": None}
                figures.row(f"  {name}", p50_us=p50, p99_us=p99, **units)
            if driver is not None:
                driver.terminate()
                driver.wait()


def called(cycles: int) -> Counter[tuple[str, str]]:
    """Count the calls of Python functions of solfer in cycles of the layer in memory, by file and function."""
    sys.path.insert(0, str(REPOSITORY / "test"))
    from support.paper.full_control import Figure5Layer

    source = f"{REPOSITORY / 'src'}/"
    found: Counter[CodeType] = Counter()
    is_inside = False

    def count(frame: FrameType, event: str, _argument: object) -> None:
        nonlocal is_inside
        if frame.f_code is Executor.cycle.__code__:
            is_inside = event in ("call", "c_call")
        if is_inside and event == "call":
            found[frame.f_code] += 1

    with tempfile.TemporaryDirectory() as folder:
        world = Figure5Layer(Path(folder))
        world.run(2.0)
        sys.setprofile(count)
        world.run(cycles / world.rate)
        sys.setprofile(None)
    own: Counter[tuple[str, str]] = Counter()
    for code, number in found.items():
        path = os.path.realpath(code.co_filename)
        if path.startswith(source):
            own[path.removeprefix(source), code.co_qualname] += number
    return own


def allocated(cycles: int, figures: Figures) -> None:
    """Print the memory that cycles of the layer in memory allocate, the median of each figure."""
    from support.paper.full_control import Figure5Layer

    kept: Counter[str] = Counter()
    peaks = []
    cycle = Executor.cycle

    def traced(executor: Executor, *given: int) -> None:
        if not is_settled:
            cycle(executor, *given)
            return
        tracemalloc.start()
        cycle(executor, *given)
        peaks.append(tracemalloc.get_traced_memory()[1])
        for each in tracemalloc.take_snapshot().statistics("lineno"):
            frame = each.traceback[0]
            if frame.filename != tracemalloc.__file__:
                kept[f"{'/'.join(Path(frame.filename).parts[-3:])}:{frame.lineno}"] += each.size
        tracemalloc.stop()

    is_settled = False
    with tempfile.TemporaryDirectory() as folder, mock.patch.object(Executor, "cycle", traced):
        world = Figure5Layer(Path(folder))
        world.run(2.0)
        is_settled = True
        world.run(cycles / world.rate)
    for line, size in kept.most_common(30):
        figures.row(line[-50:], bytes=size / cycles)
    figures.row("allocated at the end of a cycle", bytes=sum(kept.values()) / cycles)
    figures.row("allocated at one time", bytes=sorted(peaks)[len(peaks) // 2])


def main() -> int:
    """Measure, or count."""
    parser = parser_of(__doc__)
    parser.add_argument("--rate", nargs="+", type=float, default=[500.0, 1000.0], help="of the layer [Hz]")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each figure (default: %(default)g)")
    parser.add_argument("--beside", metavar="CLONE", type=Path, help="another clone, which runs by turns")
    parser.add_argument("--calls", action="store_true", help="count calls of Python functions in a cycle, in memory")
    parser.add_argument("--profile", action="store_true", help="list these calls by room and by function")
    given = parser.parse_args()
    if given.beside is not None and not (given.beside / "nodes/xbot_simulator").is_file():
        parser.error(f"{given.beside} is no clone of solfer, expected: its folder")
    if min(*given.rate, given.seconds) <= 0.0:
        parser.error(f"rates {given.rate} Hz for {given.seconds:g} s, expected: positive numbers")
    figures = Figures(given.json)
    if given.calls or given.profile:
        return count_calls(given.profile, figures)
    for rate in given.rate:
        for clone in filter(None, (given.beside and given.beside.resolve(), REPOSITORY)):
            measure(clone, rate, given.seconds, figures)
    return 0


def count_calls(lists: bool, figures: Figures) -> int:
    """Print the calls of a cycle; return 1 if there are more than kept."""
    cycles = 400
    found = called(cycles)
    if lists:
        rooms: Counter[str] = Counter()
        for (path, _), number in found.items():
            rooms["/".join(path.split("/")[1:3])] += number
        for room, number in rooms.most_common():
            figures.row(room, calls=number / cycles)
        for (path, function), number in found.most_common():
            figures.row(f"{path} {function}"[-50:], calls=number / cycles)
        allocated(50, figures)
    calls = sum(found.values()) / cycles
    kept = float(KEPT.read_text())
    figures.row("calls of Python functions in a cycle", calls=calls, kept=kept)
    if sys.version_info[:2] != (3, 11):
        print("other versions of Python count otherwise than 3.11, whose number is kept", file=sys.stderr)
    elif calls > GROWTH * kept:
        print(f"{calls:.0f} calls in a cycle, expected: {kept:.0f} (at most 2 % more) in {KEPT}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    supervise()
    sys.exit(main())
