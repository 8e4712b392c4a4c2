"""Files by which a process is found are removed or replaced while it runs."""

import shutil

import pytest

from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.segments.presence import Presence


@pytest.fixture
def namespace(tmp_path):
    return Namespace("x", tmp_path)


def replaced(namespace) -> None:
    shutil.rmtree(namespace.folder)
    Namespace(namespace.name, namespace.folder.parent)


@pytest.mark.parametrize(
    ("act", "what"),
    [
        (lambda namespace: shutil.rmtree(namespace.folder), "solfer-x was removed"),
        (lambda namespace: (namespace.folder / "bells").unlink(), "bells was removed"),
        (lambda namespace: (namespace.folder / "estop").unlink(), "estop was removed"),
        (replaced, "solfer-x was replaced"),
        (lambda namespace: namespace.folder.rename(namespace.folder.with_name("y")), "solfer-x was removed"),
    ],
    ids=["all", "bells", "stop", "replaced", "renamed"],
)
def test_what_is_lost_is_named(namespace, act, what):
    presence = Presence(namespace, [EmergencyStopLatch(namespace.folder).segment])
    presence.look()
    presence.require()
    act(namespace)
    presence.look()
    with pytest.raises(MiddlewareError, match=what):
        presence.require()


def test_it_is_not_looked_at_in_each_cycle(namespace, monkeypatch):
    now = [100.0]
    monkeypatch.setattr("solfer.segments.presence.time.monotonic", lambda: now[0])
    presence = Presence(namespace)
    shutil.rmtree(namespace.folder)
    assert not presence.lost()
    now[0] += 0.11
    assert presence.lost()


def test_a_lost_folder_is_not_made_again(namespace):
    node = XbotMiddleware(namespace, "robot")
    writer = node.writer("t", "sensor_msgs/JointState")
    shutil.rmtree(namespace.folder)
    with pytest.raises(MiddlewareError, match="No such file"):
        node.writer("u", "sensor_msgs/JointState")
    with pytest.raises(MiddlewareError, match="No such file"):
        EmergencyStopLatch(namespace.folder)
    writer.close()
    node.close()
    assert not namespace.folder.exists()
