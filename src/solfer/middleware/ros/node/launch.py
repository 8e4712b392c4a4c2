"""A `roslaunch` of its own master in a child process, for programs that bring their whole system along."""

import os
import secrets
import signal
import socket
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from xmlrpc.client import ServerProxy

from solfer.errors import MiddlewareError
from solfer.supervision import descendants

EPHEMERAL_PORTS = Path("/proc/sys/net/ipv4/ip_local_port_range")
"""Ports that the kernel gives to outgoing connections, and to nodes that bind to port 0: lowest and highest."""


def free_port() -> int:
    """Find a free TCP port for a master that binds to it seconds later.

    It lies below the ephemeral ports, where any connection could take it meanwhile, and is not ROS' own 11311, where a
    second start would find the first one's master.
    """
    lowest = int(EPHEMERAL_PORTS.read_text().split()[0])
    while True:
        port = lowest - 1 - secrets.randbelow(lowest // 2)
        with socket.socket() as probe, suppress(OSError):
            probe.bind(("", port))
            return port


class Launch:
    """Starts a launch file with a master of its own, and ends all of it on leaving the context.

    Args:
        arguments: Arguments of roslaunch: package, file, `name:=value`.
        log: File for the output of the nodes.
        port: Port of the master.

    Attributes:
        timeout: Time for the nodes to end [s]; those that are left then are killed.
        uri: URI of the master; this process uses it, too.
    """

    def __init__(self, arguments: Sequence[str], log: Path, port: int):
        self._arguments = list(arguments)
        self._log = log
        self._port = port
        self._process: subprocess.Popen | None = None
        self.timeout = 10.0
        self._checked = 0.0
        self.uri = f"http://localhost:{port}"

    def __enter__(self) -> "Launch":
        os.environ["ROS_MASTER_URI"] = self.uri
        try:
            self._log.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise MiddlewareError(
                f"folder '{self._log.parent}' cannot be made: {error.strerror}",
                expected="a folder that you may write to",
            ) from error
        command = ["roslaunch", "--port", str(self._port), *self._arguments]
        with self._log.open("w") as log:
            try:
                self._process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True
                )
            except FileNotFoundError as error:
                raise MiddlewareError("roslaunch is not on PATH", expected="a sourced ROS environment") from error
        return self

    def request_end(self) -> None:
        """Let the system end, without waiting; what is left to do here can be done meanwhile."""
        self._checked = self._checked or time.monotonic()
        if self._process.poll() is None:
            # roslaunch takes it as it takes SIGINT, of which Python complains while it still begins
            os.killpg(self._process.pid, signal.SIGTERM)

    def __exit__(self, *_: object) -> None:
        nodes = descendants(self._process.pid)
        if not self._checked:
            self.request_end()
        self._wait(self._checked + self.timeout - time.monotonic())
        if self._process.poll() is None:
            self._process.terminate()
            self._wait(0.5 * self.timeout)
        if self._process.poll() is None:  # its nodes have sessions of their own
            for each in (*nodes, self._process.pid):
                with suppress(ProcessLookupError):
                    os.kill(each, signal.SIGKILL)
            self._process.wait()

    def _wait(self, timeout: float) -> None:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(max(0.0, timeout))

    def check(self) -> None:
        """Raise if the system has ended.

        Raises:
            MiddlewareError: roslaunch is gone; holds the end of what it printed.
        """
        if self._process.poll() is not None:
            tail = "\n    ".join(self._log.read_text().splitlines()[-12:])
            raise MiddlewareError(
                f"roslaunch ended with code {self._process.returncode}:\n    {tail}",
                expected="a launch file whose required nodes stay alive",
            )

    def simulate_time(self) -> None:
        """Let nodes of this process follow simulated time, too; roslaunch may set the parameter after they read it."""
        ServerProxy(self.uri).setParam("/roslaunch", "/use_sim_time", True)  # noqa: FBT003 its own interface

    def wait_for_master(self, timeout: float) -> None:
        """Wait until the master listens.

        Raises:
            MiddlewareError: It does not within `timeout` [s].
        """
        end = time.monotonic() + timeout
        while time.monotonic() < end:
            self.check()
            with socket.socket() as probe:
                if probe.connect_ex(("localhost", self._port)) == 0:
                    return
            time.sleep(0.05)
        raise MiddlewareError(
            f"no ROS master at {self.uri} within {timeout:g} s",
            expected="a machine that is less busy; the log of roslaunch says more",
        )
