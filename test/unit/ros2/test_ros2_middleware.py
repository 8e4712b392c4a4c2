"""Nodes of `middleware: ROS2` in one process: clock, texts, services, reports."""

import os
import threading
import time
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass

import pytest

pytest.importorskip("rclpy", reason="needs ./run ros2")

from solfer.errors import ConfigError, MiddlewareError, ServiceUnavailable, UnknownName  # noqa: E402
from solfer.interfaces.declaration import Service  # noqa: E402
from solfer.middleware.ros2 import connect  # noqa: E402
from solfer.transport.health import Health  # noqa: E402
from solfer.transport.middleware import SWITCH_ONE, Flag  # noqa: E402

SIMULATED = ["node", "--ros-args", "-p", "use_sim_time:=true"]


@dataclass(frozen=True)
class Reply:
    """A reply of std_srvs/SetBool."""

    success: bool = True
    message: str = ""


@pytest.fixture(autouse=True)
def domain(monkeypatch):
    """Keep other tests on this machine outside."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))


@pytest.fixture
def nodes():
    """Two nodes."""
    with closing(connect("first", ["node"])) as first, closing(connect("second", ["node"])) as second:
        yield first, second


def until(condition):
    """Wait until a condition holds."""
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_node_follows_the_simulated_time():
    with closing(connect("simulator", SIMULATED, publishes_time=True)) as simulator:
        ended = threading.Event()

        def simulate():
            time_ = 0.0
            while not ended.wait(0.002):
                time_ += 0.01 if time_ < 20.0 else -15.0
                simulator.publish_time(time_)

        thread = threading.Thread(target=simulate)
        thread.start()
        try:
            with closing(connect("follower", SIMULATED)) as follower:
                begin = follower.now()
                follower.sleep_until(begin + 1.0)
                assert 1.0 <= follower.now() - begin < 2.0
                assert abs(follower.stamp_time() - simulator.stamp_time()) < 0.5
                until(lambda: follower.rewinds == 1)
                after = follower.now()
                assert follower.stamp_time() < 20.0 and follower.now() >= after  # it never goes back
        finally:
            ended.set()
            thread.join()


def test_without_a_time_to_follow_there_is_one_error(monkeypatch):
    monkeypatch.setattr("solfer.middleware.ros2.node.Ros2SubscribingClock.FIRST_TIME", 0.2)
    with pytest.raises(MiddlewareError, match="no node publishes the time on /clock"):
        connect("follower", SIMULATED)


def test_a_wrong_name_is_one_error():
    with pytest.raises(ConfigError, match="cannot start"):
        connect("a name", ["node"])


def test_texts_reach_nodes_that_come_later(nodes):
    first, second = nodes
    first.provide("/robot_description", "<robot/>")
    until(lambda: "/robot_description" in second.topics().result().published)
    assert second.parameter("/robot_description") == "<robot/>"
    with closing(connect("late", ["node"])) as late:
        assert late.parameter("/robot_description") == "<robot/>"
    with pytest.raises(UnknownName, match="robot_descriptoin") as error:
        second.parameter("/robot_descriptoin")
    assert "/robot_description" in error.value.names


def test_services_answer_and_refuse(nodes):
    first, second = nodes

    def submit(work):
        answer = Future()
        answer.set_result(work())
        return answer

    def switch(request):
        return Reply(request.data, "done" if request.data else "only on")

    service = Service("switch", SWITCH_ONE, Flag, reply=Reply, handler=switch)
    first.serve("part", [service], submit)
    assert second.call("part/switch", SWITCH_ONE, Flag(True), reply=Reply, timeout=10.0) == Reply(True, "done")
    assert second.request("part/switch", SWITCH_ONE, Flag(False), reply=Reply, timeout=10.0).result() == Reply(
        False, "only on"
    )
    with pytest.raises(ServiceUnavailable, match="no node"):
        second.call("part/swich", SWITCH_ONE, Flag(True), reply=Reply, timeout=0.1)
    with pytest.raises(MiddlewareError, match="offered by another node"):
        second.serve("part", [service], submit)


def test_reports_reach_other_nodes(nodes):
    first, second = nodes
    second.reports()

    def arrives():
        first.report("part", Health.WARNING, "hot", {"temperature": 81.5})
        first._last.clear()
        return "part" in second.reports()

    until(arrives)
    report = second.reports()["part"]
    assert (report.level, report.summary, report.values) == (Health.WARNING, "hot", {"temperature": "81.5"})
