"""Processes that are stopped, killed and started again, and what they leave behind."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from support.processes import until  # noqa: F401, for benchmark/chaos.py

REPOSITORY = Path(__file__).resolve().parents[2]
WAIT = 60.0
"""Bound of every wait, on a machine that has much else to do [s]."""


def named(text: str) -> list[int]:
    """List the processes with a text in their command or their environment, but this one."""
    found = []
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit() and int(folder.name) != os.getpid():
            with contextlib.suppress(OSError):  # it has ended meanwhile
                if text.encode() in (folder / "cmdline").read_bytes() + (folder / "environ").read_bytes():
                    found.append(int(folder.name))
    return found


class Processes:
    """Programs of this repository by name, each with its output in a file of its own.

    Args:
        commands: Program below the repository and arguments, by the name of the process.
        folder: Where the files are.
    """

    def __init__(self, commands: Mapping[str, Sequence[str]], folder: Path):
        self._commands, self._folder = dict(commands), folder
        self._running: dict[str, subprocess.Popen] = {}
        self._read: dict[str, int] = {}
        self.names = tuple(commands)

    def start(self, name: str) -> None:
        """Start a process that does not run."""
        program, *arguments = self._commands[name]
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
        with self.log(name).open("a") as log:
            self._running[name] = subprocess.Popen(
                [sys.executable, str(REPOSITORY / program), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env=environment,
                start_new_session=True,
            )

    def stop(self, name: str) -> None:
        """Stop a process."""
        self._running[name].send_signal(signal.SIGSTOP)

    def go_on(self, name: str) -> None:
        """Let a stopped process go on."""
        self._running[name].send_signal(signal.SIGCONT)

    def kill(self, name: str) -> None:
        """Kill a process."""
        process = self._running.pop(name)
        process.kill()
        process.wait(WAIT)

    def terminate(self, name: str) -> None:
        """Ask a process to end."""
        self._running[name].terminate()

    def over(self, name: str) -> bool:
        """Return whether a process does not run, since it has done what it was to do."""
        if name in self._running and self._running[name].poll() == 0:
            del self._running[name]
        return name not in self._running

    def ended(self, name: str) -> bool:
        """Return whether a process that was asked to end has done so, in good order or not."""
        if self._running[name].poll() is None:
            return False
        del self._running[name]
        return True

    def missing(self) -> list[str]:
        """List the processes that do not run, in the order of their starts."""
        return [name for name in self.names if name not in self._running]

    def log(self, name: str) -> Path:
        """Return the file of a process' output."""
        return self._folder / f"{name}.log"

    def errors(self) -> list[str]:
        """List what is wrong since the last call: processes that ended by themselves, tracebacks, zombies."""
        found = []
        for name, process in list(self._running.items()):
            if process.poll() is not None:
                found.append(f"{name} ended by itself with code {process.returncode}: {self._last_line(name)}")
                del self._running[name]
        for name in self.names:
            if "Traceback (most recent call last)" in self._news(name):
                found.append(f"{name} printed a traceback: {self._last_line(name)}")
        return found + self._zombies()

    def close(self) -> None:
        """End all of them."""
        for process in self._running.values():
            process.kill()  # also a process that stands still
        for process in self._running.values():
            process.wait(WAIT)
        self._running.clear()

    def _news(self, name: str) -> str:
        """Return the output of a process since the last call."""
        if not self.log(name).exists():
            return ""
        text = self.log(name).read_text(errors="replace")
        news = text[self._read.get(name, 0) :]
        self._read[name] = len(text)
        return news

    def _last_line(self, name: str) -> str:
        lines = self.log(name).read_text(errors="replace").split("\n")
        return next((line for line in reversed(lines) if line.strip()), "")

    def _zombies(self) -> list[str]:
        """List dead children of the processes that were not waited for."""
        ours, found = {process.pid: name for name, process in self._running.items()}, []
        for folder in Path("/proc").iterdir():
            if not folder.name.isdigit():
                continue
            with contextlib.suppress(OSError):
                state, parent = (folder / "stat").read_text().rpartition(")")[2].split()[:2]
                if state == "Z" and int(parent) in ours:
                    found.append(f"process {folder.name} of {ours[int(parent)]} is a zombie")
        return found
