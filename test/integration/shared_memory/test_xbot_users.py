"""Several users of one machine: those in the robot's group may watch and stop it, and others do not get in its way.

They are real users, by numbers that need no names.
"""

import contextlib
import os
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import pytest
from support.integration.xbot_system import until

from solfer.errors import SolferError
from solfer.interfaces.declaration import Service
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.plugins import PluginState
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.telemetry.statistics import RuntimeStatistics
from solfer.transport import Inbox
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import NoFields
from solfer_tools.cli.main import main

ALICE, BOB, MALLORY = 61001, 61002, 61003
ROBOTS, OTHERS = 61010, 61011
"""Groups: that of Alice, the robot's owner, to which Bob belongs; and another one."""

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="needs the right to become other users; skipped without it")


class Child:
    """A function in a process of its own that has become another user, with the usual mask of ordinary users.

    Attributes:
        pid: The process.
    """

    def __init__(self, user: int, group: int, groups: tuple[int, ...], function: Callable[..., int], *arguments):
        self._file, published = os.pipe()
        self.pid = os.fork()
        if self.pid:
            os.close(published)
            return
        code = 70
        try:
            for number in (1, 2):
                os.dup2(published, number)
            sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)
            os.setgroups(groups)
            os.setgid(group)
            os.setuid(user)
            os.umask(0o022)
            code = function(*arguments)
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def end(self) -> tuple[int, str]:
        """Exit code and words."""
        with open(self._file) as file:
            published = file.read()
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1]), published

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)
        self.end()


@pytest.fixture
def name():
    name = f"test-{os.getpid()}-{time.monotonic_ns()}"
    yield name
    shutil.rmtree(folder_of(name), ignore_errors=True)


def folder_of(name: str) -> Path:
    return Path("/dev/shm") / f"solfer-{name}"


def lead(name: str) -> int:
    """Make what others see of an RT layer with one plugin; runs until it is killed."""
    namespace = Namespace(name)
    node, inbox = XbotMiddleware(namespace, "legs"), Inbox()
    stop, statistics = (
        EmergencyStopLatch(namespace.folder),
        RuntimeStatistics.create(namespace.folder, 500.0, ["legs"], ["component"]),
    )

    def put(stage: PluginState) -> Answer:
        statistics.put_life(0, stage, 1, 0, 0)
        return Answer()

    put(PluginState.RUNNING)
    node.serve(
        "legs",
        [Service("abort", "std_srvs/Trigger", NoFields, Answer, lambda _: put(PluginState.STOPPED))],
        inbox.submit,
    )
    while True:
        if stop:
            put(PluginState.ABORTED)
            stop.answer("legs at rest")
        statistics.beat(time.monotonic_ns())
        node.poll()
        inbox.apply()
        time.sleep(0.002)


@contextlib.contextmanager
def layer(name: str):
    """Alice's layer."""
    child = Child(ALICE, ROBOTS, (), lead, name)
    try:
        until((folder_of(name) / "services" / "legs%2Fabort" / "offer").exists, "a layer")
        yield
    finally:
        child.kill()


def solfer_rt(name: str, *action: str, user: int = BOB, group: int = OTHERS, groups: tuple[int, ...] = (ROBOTS,)):
    """Return exit code and output of `solfer rt` as a user; by default Bob, with the robot's group as his second."""
    return Child(user, group, groups, main, ["rt", "--namespace", name, *action]).end()


def make(name: str) -> int:
    """Make a namespace, as the processes of a robot do."""
    try:
        Namespace(name)
    except SolferError as error:
        print(error)
        return error.exit_code
    return 0


def test_a_user_of_the_group_may_stop(name):
    with layer(name):
        code, published = solfer_rt(name, "top", "--once")
        assert code == 0 and "legs" in published, published
        assert solfer_rt(name, "abort", "legs") == (0, "")
        code, published = solfer_rt(name, "estop", "a dog")
        assert code == 0 and "obeys" in published, published
        code, published = solfer_rt(name, "top", "--once", user=ALICE, group=ROBOTS, groups=())
        assert code == 0 and "emergency stop: a dog (process" in published, published


def test_root_stops_the_robot_of_any_user(name):
    with layer(name):
        code, published = solfer_rt(name, "estop", user=0, group=0, groups=())
        assert code == 0 and "obeys" in published, published


def test_a_user_outside_the_group_is_refused(name):
    with layer(name):
        for action in (("top", "--once"), ("estop",)):
            code, published = solfer_rt(name, *action, user=MALLORY, groups=())
            assert code == 2 and f"{folder_of(name)}: shared memory is refused" in published, published
            assert f"a folder of the user {ALICE}, and this process runs as the user {MALLORY}" in published, published


@pytest.mark.parametrize("mode", [0o777, 0o2770, 0o755], ids=oct)
def test_another_users_earlier_folder_is_refused(name, mode, tmp_path):
    folder, victim = folder_of(name), tmp_path / "victim"
    victim.write_text("kept")
    os.chown(victim, ALICE, ROBOTS)
    folder.mkdir()
    for file in ("bells", "estop", "estop.lock", "statistics", "statistics.lock", "simulated_time"):
        (folder / file).symlink_to(victim)
    os.chown(folder, BOB, ROBOTS)  # a user who may watch does not make the folder, either
    folder.chmod(mode)
    code, published = Child(ALICE, ROBOTS, (), make, name).end()
    assert code == 2 and published.startswith(f"{folder}: shared memory is refused: a folder "), published
    assert victim.read_text() == "kept"
