"""Lock-step under ROS 2, see `solfer.transport.lockstep`. There is no master: each node has found the others itself."""

import math
import threading
import time
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node

from solfer.errors import MiddlewareError
from solfer.middleware.ros2.codecs import filled, interface
from solfer.middleware.ros2.services import replied
from solfer.transport.lockstep.client import (
    SERVICE,
    TICK,
    Endpoint,
    LockstepCall,
    LockstepNetwork,
    Tick,
    Ticked,
    is_writer,
)
from solfer.transport.threaded_calls import as_fields

KIND: Any = interface(TICK, "srv")

PRESENCE_PERIOD = 0.5
"""Time between two looks whether a node that does not answer is there [s]."""

DISCOVERY_TIME = 0.2
"""Time in which all nodes find one that this node has found [s]."""


class Ros2Lockstep(LockstepNetwork):
    """The graph and services of ROS 2.

    Args:
        node: The node.
    """

    def __init__(self, node: Node):
        self.name = node.get_fully_qualified_name()
        self._node = node

    def others(self, endpoints: Iterable[Endpoint]) -> list[set[str]]:
        """See `LockstepNetwork.others`."""
        return [each.others() if is_writer(each) else each.subscription.others() for each in endpoints]

    def offer(self, answer: Callable[[Tick], Ticked]) -> Callable[[], None]:
        """See `LockstepNetwork.offer`; a time of the next cycle that is no number stands for an error."""

        def handle(request: Any, response: Any) -> Any:
            try:
                reply = answer(replied(request, Tick))
            except MiddlewareError as error:
                self._node.get_logger().warning(str(error))
                reply = Ticked(math.nan, (), ())
            return filled(type(response), as_fields(reply))

        group = ReentrantCallbackGroup()
        server = self._node.create_service(KIND, f"{self.name}/{SERVICE}", handle, callback_group=group)

        def withdraw() -> None:
            self._node.destroy_service(server)

        return withdraw

    def connect(self, node: str) -> "Ros2LockstepCall | None":
        """See `LockstepNetwork.connect`."""
        call = Ros2LockstepCall(self._node, f"{node}/{SERVICE}")
        if call.ready():
            time.sleep(DISCOVERY_TIME)
            return call
        call.close()
        return None


class Ros2LockstepCall(LockstepCall):
    """A client of the service of a node."""

    def __init__(self, node: Node, service: str):
        self._node = node
        self._service = service
        self._client = node.create_client(KIND, service, callback_group=ReentrantCallbackGroup())

    def ready(self) -> bool:
        """Return whether one node offers the service; a killed one does until its lease ends."""
        end = time.monotonic() + DISCOVERY_TIME
        while self._node.count_services(self._service) == 1:
            if self._client.service_is_ready():
                return True
            if time.monotonic() > end:
                break
            time.sleep(0.01)
        return False

    def __call__(self, tick: Tick) -> Ticked:
        """See `LockstepCall.__call__`."""
        answered = threading.Event()
        answer = self._client.call_async(filled(KIND.Request, as_fields(tick)))
        answer.add_done_callback(lambda _: answered.set())
        while not answered.wait(PRESENCE_PERIOD):
            if self._node.count_services(self._service) != 1:  # none any more, or a second one in its place
                raise MiddlewareError("no answer", expected="a node that follows")
        reply: Ticked = replied(answer.result(), Ticked)
        if math.isnan(reply.next):
            raise MiddlewareError("it refuses the cycle", expected="the cause is in its log")
        return reply

    def close(self) -> None:
        """End the connection."""
        self._node.destroy_client(self._client)
