"""The rospy node of a process: its name, its start, and its end."""

import copy
import io
import logging
import signal
import socket
import sys
import threading
from collections.abc import Callable, Sequence

import rosgraph
import rospy
from rospy.names import _set_caller_id as set_caller

from solfer.errors import ConfigError, MiddlewareError, SolferError
from solfer.middleware.ros.lockstep import followers, show
from solfer.middleware.ros.node.clock import make_clock
from solfer.middleware.ros.node.master import CALL_TIMEOUT, knows, refuse_twin, require_master
from solfer.middleware.ros.node.master_watch import MasterWatch
from solfer.middleware.ros.node.ports import bound_ports
from solfer.process import ProcessEnd
from solfer.transport.lockstep.step_clock import StepClock
from solfer.transport.waiting import ShutdownRequested

logger = logging.getLogger(__name__)


class RosNode:
    """A started node.

    Ctrl-C, SIGTERM, a closed terminal and `rosnode kill` ask the loop to end, so that it can bring the robot to rest
    while its topics are still open. A second signal ends the process at once. A node that has lost its master ends in
    the same way, with an error: no other node finds it any more, so that none could stop it.

    Args:
        name: Name of the node, unless the arguments have `__name:=`.
        argv: Arguments with remappings, and `__ns:=` for a namespace; by default those of the process.
        publishes_time: Whether the node simulates, and publishes the time for all others if /use_sim_time is true.

    Attributes:
        name: Resolved name.
        clock: Clock of the node.
        loss: What happened to the master, in one line; empty while all is well.

    Raises:
        ConfigError: The name cannot be a node's name.
        MiddlewareError: No master answers, a living node has this name, or /use_sim_time is true and no node publishes
            the time.
    """

    SHUTDOWN_TIMEOUT = 3.0
    """Longest time that `rosnode kill` waits for the loop to bring the robot to rest [s]."""

    def __init__(self, name: str, argv: Sequence[str] | None = None, publishes_time: bool = False):
        argv = list(sys.argv if argv is None else argv)
        base = rosgraph.names.load_mappings(argv).get("__name", name)
        if not rosgraph.names.is_legal_base_name(base):
            raise ConfigError(
                f"'{base}' cannot be the name of a node",
                expected="a letter, then letters, digits and underscores; another name by __name:=NAME",
            )
        self._ends, self._closing, self._gone = (threading.Event() for _ in range(3))
        self._watch: MasterWatch | None = None
        self.loss = ""
        require_master()
        namespace = rosgraph.names.get_ros_namespace(argv=argv)
        refuse_twin(rosgraph.names.ns_join(namespace, base))
        set_caller(rosgraph.names.ns_join(namespace, "unnamed"))  # rospy has read it from the process' own arguments
        self._end = ProcessEnd(self._ends.set)
        bound_ports()
        try:
            rospy.init_node(base, argv=argv, disable_signals=True, disable_rostime=True)
        except rospy.ROSException as error:
            raise MiddlewareError(
                f"node '{base}' cannot start: {error}", expected="a ROS master that answers"
            ) from error
        self.name = rospy.get_name()
        connect_logs()
        rospy.on_shutdown(self._on_shutdown)
        rospy.core.add_shutdown_hook(lambda reason: self._gone.set())
        try:
            self._watch = MasterWatch(self._on_loss, known=lambda: knows(self.name, rospy.get_node_uri()))
            follows = self.name in followers()
            self.clock = StepClock(self.running, show) if follows else make_clock(self.running, publishes_time)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "RosNode":
        return self

    def __exit__(self, *failure: object) -> None:
        self.close()

    def running(self) -> bool:
        """Return whether the end was not requested yet."""
        return self._end.running() and not self._ends.is_set()

    def close(self) -> None:
        """Unregister from the master.

        Raises:
            MiddlewareError: The node has ended because its master was lost.
        """
        self._ends.set()
        if self._watch is not None:
            self._watch.close()
        self._closing.set()
        socket.setdefaulttimeout(CALL_TIMEOUT)  # rospy would wait for a master that hangs; new connections are not made
        rospy.signal_shutdown("end")
        # When `rosnode kill` began the shutdown, another thread is still at it.
        self._gone.wait(self.SHUTDOWN_TIMEOUT)
        if self.loss:
            raise MiddlewareError(
                f"node {self.name} ends: {self.loss}; start it again",
                expected="a ROS master that stays, and knows the node",
            )

    def _on_loss(self) -> None:
        """End the node with an error, unless it has to end already."""
        if not self._ends.is_set():
            self.loss = self._watch.loss
            self._ends.set()

    def _on_shutdown(self) -> None:
        """Keep rospy from closing the topics before the loop has sent its last command."""
        self._ends.set()
        if threading.current_thread() is not threading.main_thread():
            self._closing.wait(self.SHUTDOWN_TIMEOUT)


def arguments(argv: Sequence[str]) -> list[str]:
    """Return the command line without the program's name and without remappings such as `__name:=other`."""
    return rospy.myargv(list(argv))[1:]


def run_main(main: Callable[[list[str]], int]) -> None:
    """Run a node's `main` on the process' arguments and exit with its code; an error is printed in one block."""
    try:
        code = main(sys.argv)
    except KeyboardInterrupt:  # before the node took the signals over
        code = 128 + signal.SIGINT
    except ShutdownRequested:
        code = 0
    except SolferError as error:
        code = error.exit_code
        sys.stdout.flush()
        print(f"error: {error}", file=sys.stderr)
    sys.exit(code)


class OneLine(logging.Handler):
    """Passes records to rospy's handlers, each message on one line."""

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a record on."""
        flat = copy.copy(record)
        flat.msg = "; ".join(line.strip() for line in record.getMessage().splitlines())
        flat.args = None
        for handler in logging.getLogger("rosout").handlers:
            handler.handle(flat)


def connect_logs() -> None:
    """Send the records of solfer and its tools to the terminal and to /rosout.

    Rospy's root logger writes them into the log file.
    """
    # Under roslaunch the output is a pipe; without this, messages come out when its buffer is full.
    if isinstance(sys.stdout, io.TextIOWrapper):  # a notebook or a test may have replaced it
        sys.stdout.reconfigure(line_buffering=True)
    for package in ("solfer", "solfer_tools"):
        ours = logging.getLogger(package)
        if ours.level == logging.NOTSET:
            ours.setLevel(logging.INFO)
        ours.handlers[:] = [OneLine()]
