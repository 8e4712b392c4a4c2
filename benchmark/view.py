#!/usr/bin/env python3
"""Measures what a page in the browser costs, what a layer leaves out beside it, and how soon a button moves the base.

Run with `./run exec python benchmark/view.py [--seconds S] [--presses N] [--json]`. The plugins of Fig. 5 run at 500 Hz
beside CENTAURO in PyBullet, first without a page, then with one that a client receives and does not draw: its pictures
a second, and positions and turns in them. Then the base of `solfer view --run` is driven by a button, N times
from rest: the time until the page has received a base that is 1 mm away. Exit code 1: the page takes more than 15 % of
a core, or more than 5 further periods are left out in 30 s.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from executor import CONFIG, REPOSITORY, simulated_layer
from form import Figures, parser_of

from solfer.realtime.emergency_stop import stopped
from solfer.segments.namespace import Namespace
from solfer.supervision import supervise
from solfer.telemetry.summaries import LayerSummary, StatisticsReader

sys.path.insert(0, str(REPOSITORY / "test"))
from support.page import opened_page, started_view  # noqa: E402

SHARE, LEFT_OUT = 0.15, 5
"""Largest share of a core, and largest number of further periods that are left out in 30 s."""

SETTLES = 5.0
"""Time from the first picture until it is measured [s]."""

BASE = "/measured/pelvis"
REST, MOVED = 3.0, 1e-3
"""Time before each press, in which the base comes to rest [s], and distance that counts as motion [m]."""

PATIENCE = 10.0
"""Longest time until the base moves [s]."""

STUDY = f"""
configuration: {{file: {CONFIG / "centauro.yaml"}}}
plugins: ["odometry3::odometry", wheeled_motion]
motion: {{function: "builtins:print"}}
settle: 2.0
duration: 3600.0
"""
"""Nothing but the page moves the base."""

TICK = 1.0 / os.sysconf("SC_CLK_TCK")


def spent(process: int) -> float:
    """Return the time that a process has computed [s]."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return TICK * (int(fields[11]) + int(fields[12]))


def skipped(namespace: Namespace) -> int:
    """Return the periods that the layer has left out.

    Raises:
        SystemExit: It has ended.
    """
    summary: LayerSummary | None = StatisticsReader(namespace.folder, stopped).look()
    if summary is None:
        raise SystemExit("the layer has ended")
    return summary.skipped


def receive(address: str, is_over: threading.Event, pictures: list[int]) -> None:
    """Receive what a page gets, without a look at it; count the messages of pictures."""
    with opened_page(address) as page:
        page.receive(SETTLES)  # it shows life, as every page
        while not is_over.is_set():
            pictures[0] += page.take_raw(0.5)


def poses(address: str, seconds: float) -> float:
    """Return the positions and turns a second that a page receives and reads."""
    count = 0
    with opened_page(address) as page:
        page.receive(SETTLES)
        take = page._take

        def counted(message: dict) -> None:
            nonlocal count
            count += message["type"] in ("SetPositionMessage", "SetOrientationMessage")
            take(message)

        page._take = counted
        page.receive(seconds)
    return count / seconds


def delays(presses: int) -> list[float]:
    """Return the times from the press of a button until a page has received a base that moves, one a press [s]."""
    measured = []
    with tempfile.TemporaryDirectory() as folder:
        study = Path(folder) / "study.yaml"
        study.write_text(STUDY)
        with started_view("--run", str(study), "--control") as (_, address), opened_page(address) as page:
            page.until(lambda: "take control" in page.labels and page.is_known, "a page that may command")
            page.click("take control")
            page.until(lambda: "you have control" in page.content, "control")
            page.until(lambda: "wheeled_motion" in page.content or "wheeled_motion" in page.tabs, "a base to drive")
            for index in range(presses):
                page.receive(REST)
                begin, since = np.array(page.positions[BASE]), time.monotonic()
                direction = ("ahead", "back")[index % 2]
                while np.linalg.norm(np.subtract(page.positions[BASE], begin)) < MOVED:
                    if time.monotonic() - since > PATIENCE:
                        raise SystemExit(f"the base does not drive {direction}\n{page.content}")
                    page.hold(direction)
                    page.receive(0.02)
                measured.append(time.monotonic() - since)
    return measured


def main() -> int:
    """Measure, and return the exit code."""
    parser = parser_of(__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="of each measurement (default: 30)")
    parser.add_argument("--presses", type=int, default=10, help="number of presses of a button (default: 10)")
    options = parser.parse_args()
    figures = Figures(options.json)
    with ExitStack() as stack:
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
        layer = CONFIG / "figures" / "figure_5.yaml"
        namespace, processes = stack.enter_context(simulated_layer(layer, environment))
        time.sleep(SETTLES)
        before = skipped(namespace)
        time.sleep(options.seconds)
        without = skipped(namespace) - before
        figures.row("without a page", share=0.0, left_out=without, pictures_hz=0.0)

        command = [shutil.which("solfer") or "solfer", "view", "--port", "0", "--namespace", namespace.name]
        view = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        processes.append(view)
        assert view.stdout is not None
        address = view.stdout.readline().strip()
        is_over = threading.Event()
        pictures = [0]
        client = threading.Thread(target=receive, args=(address, is_over, pictures))
        client.start()
        time.sleep(2.0 * SETTLES)
        before, begun, shown, since = skipped(namespace), spent(view.pid), pictures[0], time.monotonic()
        time.sleep(options.seconds)
        took = time.monotonic() - since
        share, seen = (spent(view.pid) - begun) / took, (pictures[0] - shown) / took
        beside = skipped(namespace) - before
        figures.row("a page with one client", share=share, left_out=beside, pictures_hz=seen)
        is_over.set()
        client.join()
        figures.row("positions and turns that it receives", poses_hz=poses(address, min(options.seconds, 10.0)))
    times = 1e3 * np.array(delays(options.presses))
    figures.row("button to motion", median_ms=np.median(times), least_ms=times.min(), most_ms=times.max())
    most = LEFT_OUT * max(options.seconds / 30.0, 1.0)
    return 0 if share <= SHARE and beside - without <= most else 1


if __name__ == "__main__":
    supervise()
    sys.exit(main())
