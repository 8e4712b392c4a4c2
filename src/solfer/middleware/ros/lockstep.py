"""Lock-step under rospy, see `solfer.transport.lockstep`."""

from collections.abc import Callable, Iterable
from typing import Any

import rosgraph
import rospy
from rospy.rostime import _set_rostime as set_ros_time

from solfer.errors import MiddlewareError
from solfer.middleware.ros.calls import alive, provider, replied
from solfer.middleware.ros.codecs.interfaces import service_class
from solfer.middleware.ros.node.clock import ros_time
from solfer.transport.lockstep.client import (
    SERVICE,
    TICK,
    Endpoint,
    LockstepCall,
    LockstepNetwork,
    Tick,
    Ticked,
    follower_names,
    is_writer,
)
from solfer.transport.threaded_calls import as_fields


def followers() -> tuple[str, ...]:
    """Read the nodes that the parameter `/lockstep` names, see `follower_names`."""
    return follower_names(
        rospy.get_param("/lockstep", ""),
        resolve=lambda name: rosgraph.names.resolve_name(name, "/"),
        where="parameter /lockstep",
    )


def show(time: float) -> None:
    """Make a time [s] that of ROS in this process."""
    set_ros_time(ros_time(time))


class RosLockstep(LockstepNetwork):
    """The master and services of ROS.

    Args:
        name: Full name of the node.
    """

    def __init__(self, name: str):
        self.name = name

    def others(self, endpoints: Iterable[Endpoint]) -> list[set[str]]:
        """See `LockstepNetwork.others`."""
        publishers, subscribers, _ = rosgraph.Master(self.name).getSystemState()
        writing, reading = dict(publishers), dict(subscribers)
        return [set((reading if is_writer(each) else writing).get(each.topic, ())) for each in endpoints]

    def offer(self, answer: Callable[[Tick], Ticked]) -> Callable[[], None]:
        """See `LockstepNetwork.offer`."""

        def handle(request: Any) -> Any:
            try:
                reply = answer(replied(request, Tick))
            except MiddlewareError as error:
                raise rospy.ServiceException(str(error)) from error
            return service_class(TICK)._response_class(**as_fields(reply))

        withdraw: Callable[[], None] = rospy.Service(f"{self.name}/{SERVICE}", service_class(TICK), handle).shutdown
        return withdraw

    def connect(self, node: str) -> "RosLockstepCall | None":
        """See `LockstepNetwork.connect`; a killed node leaves its registration behind."""
        service = f"{node}/{SERVICE}"
        try:
            uri = provider(service)
        except MiddlewareError:  # the master may be away for a moment
            return None
        return RosLockstepCall(service) if uri is not None and alive(service, uri) else None


class RosLockstepCall(LockstepCall):
    """A persistent connection to the service of a node."""

    def __init__(self, service: str):
        self._proxy = rospy.ServiceProxy(service, service_class(TICK), True)

    def __call__(self, tick: Tick) -> Ticked:
        """See `LockstepCall.__call__`."""
        try:
            reply: Ticked = replied(self._proxy(service_class(TICK)._request_class(**as_fields(tick))), Ticked)
        except (rospy.ServiceException, rospy.ROSException, OSError) as error:
            raise MiddlewareError(str(error), expected="a node that follows") from error
        return reply

    def close(self) -> None:
        """End the connection."""
        self._proxy.close()
