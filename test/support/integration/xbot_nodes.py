"""Nodes of a namespace in shared memory, for processes of their own."""

import time
from dataclasses import dataclass

import numpy as np

from solfer.components import Service
from solfer.errors import MiddlewareError
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.transport import Inbox, JointMessage

NAME, TOPIC, JOINT_STATE = "faults", "joint_states", "sensor_msgs/JointState"
JOINTS = tuple(f"joint_{index}" for index in range(46))
PERIOD = 0.001  # [s]


@dataclass(frozen=True)
class Number:
    """The request."""

    number: float


@dataclass(frozen=True)
class Answer:
    """The reply."""

    success: bool = True
    message: str = ""
    number: float = 0.0


def node(folder, name):
    """Make a node of the namespace of the tests."""
    return XbotMiddleware(Namespace(NAME, folder), name)


def publish(folder, ready, name="robot", joints=JOINTS, pause=PERIOD):
    """Send joint states, each of one number only, as fast as the pause lets it."""
    writer, count = node(folder, name).writer(TOPIC, JOINT_STATE), 0
    message = JointMessage.empty(joints, ("position", "velocity"))
    while True:
        count += 1
        message.position[:], message.velocity[:], message.stamp = count, -count, float(count)
        writer.write(message)
        ready.set()
        if pause:
            time.sleep(pause)


def publish_second(folder, ready, refusals):
    """Try to be a second writer of the name `robot`; report how that ended."""
    try:
        node(folder, "robot").writer(TOPIC, JOINT_STATE)
    except MiddlewareError as error:
        refusals.put(str(error))
    ready.set()


def serve(folder, ready, done, hang=False):
    """Offer `doubler/double`; count in `done` what was carried out. With `hang`, receive calls and answer none."""
    middleware, inbox = node(folder, "server"), Inbox()

    def double(request):
        done.put(request.number)
        return Answer(number=2.0 * request.number)

    middleware.serve("doubler", [Service("double", "test/Double", Number, Answer, double, 10.0)], inbox.submit)
    ready.set()
    while True:
        middleware.poll()
        if not hang:
            inbox.apply()
        time.sleep(PERIOD)


def ask(middleware, number, timeout=30.0):
    """Call `doubler/double` and return the answer."""
    return middleware.call("doubler/double", "test/Double", Number(number), Answer, timeout)


def ask_for_ever(folder, ready):
    """Call again and again."""
    middleware = node(folder, "client")
    while True:
        ask(middleware, 1.0)
        ready.set()


def stamps(message):
    """Return the number of a message, after a check that it is of one write only."""
    assert (message.position == message.stamp).all() and (message.velocity == -message.stamp).all()
    assert isinstance(message.position, np.ndarray)
    return message.stamp
