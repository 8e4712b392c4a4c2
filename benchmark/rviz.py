"""A picture of RViz with Fig. 5 of the paper, which drives and moves a hand, on a display in memory.

    python benchmark/rviz.py [FILE]

The picture is that of docs/how-to/rviz.md. The simulation waits for the plugins, so a slow drawing changes nothing.
It needs RViz and Xvfb (Debian: `rviz`, `xvfb`). What the nodes say is in `out/rviz.log`.
"""

import argparse
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image, ImageGrab

from solfer.errors import MissingDependency, SolferError
from solfer.middleware.ros.node.launch import Launch, free_port

LOG = Path("out/rviz.log")
SIZE, COLORS = "1280x800x24", 128
"""Of the display, and colours of the picture."""

PATIENCE = 240.0
"""Longest time for the robot to stand, and for its way [s]."""

WAY = ("rosrun", "solfer", "navigation", "go", "--target", "locomotion", "0.5,0.0")
RAISED = ("rosservice", "call", "/hands/reference", "{task: left, values: [0.05, 0.1, 0.25], relative: true}")

DRAWN = 5.0
"""Time in which RViz draws what has come last [s]."""


@contextmanager
def display() -> Iterator[str]:
    """Start an X server that draws into memory; yields its name.

    Raises:
        MissingDependency: There is no such program.
    """
    if shutil.which("Xvfb") is None:
        raise MissingDependency("there is no program 'Xvfb'", expected="in Debian the package `xvfb`")
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", SIZE, "-nolisten", "tcp"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
        assert server.stdout is not None
        yield f":{server.stdout.readline().strip()}"
        server.terminate()


def raise_hand() -> None:
    """Ask for another reference of a hand, as soon as the plugins run.

    Raises:
        SolferError: They do not.
    """
    end = time.monotonic() + PATIENCE
    while "success: True" not in subprocess.run(RAISED, capture_output=True, text=True, check=False).stdout:
        if time.monotonic() > end:
            raise SolferError("the plugin 'hands' does not run", expected=f"its node; see {LOG}")
        time.sleep(1.0)


def main() -> int:
    """Write the picture; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path, nargs="?", default=Path("out/rviz.png"), help="default: %(default)s")
    options = parser.parse_args()
    options.file.parent.mkdir(parents=True, exist_ok=True)
    try:
        with display() as name:
            os.environ |= {"DISPLAY": name, "LIBGL_ALWAYS_SOFTWARE": "1"}
            with Launch(["solfer", "figure_5.launch", "rviz:=true", "lockstep:=true"], LOG, free_port()):
                raise_hand()
                subprocess.run(WAY, check=True, stdout=subprocess.DEVNULL, timeout=PATIENCE)
                time.sleep(DRAWN)
                picture = ImageGrab.grab(xdisplay=name)
    except (SolferError, subprocess.SubprocessError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    picture.convert("P", palette=Image.Palette.ADAPTIVE, colors=COLORS).save(options.file, optimize=True)
    print(f"{options.file}: {picture.width} x {picture.height}, {options.file.stat().st_size / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
