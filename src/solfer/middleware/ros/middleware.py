"""The Middleware of a rospy node."""

import logging
import os
import re
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, wait
from typing import Any, TypeVar

import rosgraph
import rospy

from solfer.errors import MiddlewareError, UnknownName
from solfer.interfaces.declaration import Service
from solfer.middleware.ros.calls import call, replied
from solfer.middleware.ros.codecs.fields import require_fields
from solfer.middleware.ros.codecs.packed_message import present, set_epoch
from solfer.middleware.ros.diagnostics import Diagnostics
from solfer.middleware.ros.endpoints import RosQueue, RosReader, RosWriter
from solfer.middleware.ros.lockstep import RosLockstep, followers
from solfer.middleware.ros.node.master import lives
from solfer.middleware.ros.node.node import RosNode
from solfer.middleware.ros.reconfigure import ReconfigureServer, first_values
from solfer.middleware.ros.services import RosService
from solfer.middleware.ros.topics import topics_beside
from solfer.transport import Middleware
from solfer.transport.endpoints import JointOrder
from solfer.transport.health import Health
from solfer.transport.lockstep.client import LockstepClient
from solfer.transport.lockstep.server import LockstepServer
from solfer.transport.lockstep.step_clock import StepClock
from solfer.transport.middleware import HealthReport, Submit
from solfer.transport.parameters import GET_PARAMETERS, SET_PARAMETERS
from solfer.transport.threaded_calls import in_thread
from solfer.transport.topics import Topics
from solfer.transport.waiting import wait_for

logger = logging.getLogger(__name__)

Endpoint = TypeVar("Endpoint", RosReader, RosQueue, RosWriter)


class RosMiddleware(Middleware):
    """Topics, services and parameters of ROS; the clock is the node's.

    Args:
        node: The process' node; it is closed with the middleware.
    """

    def __init__(self, node: RosNode):
        self._node = node
        self._clock = node.clock
        self.name = node.name
        self._endpoints: list[RosReader | RosQueue | RosWriter] = []
        self._services: list[RosService | ReconfigureServer] = []
        self._tunings: dict[str, dict[str, RosService]] = {}
        self._requests: list[Future[Any]] = []
        self._diagnostics = Diagnostics(node.name)
        self._follower: LockstepClient | None = None
        if isinstance(node.clock, StepClock):
            self._follower = LockstepClient(
                RosLockstep(node.name), node.clock, self._endpoints, requests=self._open_requests, running=node.running
            )

    def now(self) -> float:
        """See `Middleware.now`."""
        return self._clock.now()

    def stamp_time(self) -> float:
        """See `Middleware.stamp_time`: ROS time."""
        seconds, nanoseconds = present()
        return seconds + 1e-9 * nanoseconds

    @property
    def rewinds(self) -> int:
        """See `Middleware.rewinds`."""
        return self._clock.rewinds

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`."""
        (self._follower or self._clock).sleep_until(deadline)

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`."""
        self._clock.publish(simulated)

    def stamp_measurements(self, now: float) -> None:
        """Stamp messages from now on with when they were measured, by a clock that shows `now` [s] at present.

        Without it they are stamped with when they are sent. To be called by a node that does nothing but measure.
        """
        set_epoch(self.stamp_time() - now)

    def lockstep_server(self) -> LockstepServer | None:
        """Make what lets nodes follow a simulation in this node in lock-step; None if no node is to follow.

        Raises:
            ConfigError: The parameter that names the nodes is wrong.
        """
        names = followers()
        return LockstepServer(names, RosLockstep(self.name), self._endpoints, running=self.running) if names else None

    def running(self) -> bool:
        """See `Middleware.running`."""
        return self._node.running()

    @property
    def loss(self) -> str:
        """See `Middleware.loss`; the master."""
        return self._node.loss

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`; the nearest namespace that has it counts, as in `rosparam`'s search.

        What a node has set with `provide` ends with the node; what a launch file or an operator has set, stays.
        """
        try:
            key = rospy.search_param(name.lstrip("/"))
            present = None if key is None else _living(rospy.get_param(key))
            if present is not None:
                return present
            known = [each for each in rospy.get_param_names() if each != key]
            raise UnknownName("parameter", name, known, where=where)
        except KeyError:  # deleted at this moment
            raise UnknownName("parameter", name, (), where=where) from None
        except (OSError, rospy.ROSException) as error:
            raise MiddlewareError(
                f"parameter '{name}' cannot be read: {error}",
                where=where,
                expected="a running master (roscore) at ROS_MASTER_URI",
            ) from error

    def first_values(self, owner: str) -> Mapping[str, Any]:
        """See `Middleware.first_values`; they are below `<owner>/parameters`, as those of dynamic_reconfigure."""
        try:
            return first_values(owner)
        except (OSError, rospy.ROSException) as error:
            raise MiddlewareError(
                f"parameters of '{owner}' cannot be read: {error}",
                expected="a running master (roscore) at ROS_MASTER_URI",
            ) from error

    def resolve(self, topic: str) -> str:
        """See `Middleware.resolve`: with the namespace and the remappings of the node."""
        return rospy.resolve_name(topic)

    def provide(self, name: str, text: str, original: str = "") -> None:
        """Set a parameter of this node's namespace, which lasts as long as this node.

        One that a launch file or an operator has set stays, with a warning if it differs.

        Args:
            name: The parameter.
            text: Its value.
            original: What the text was made of, which a launch file may have set as well.
        """
        key = rospy.resolve_name(name.lstrip("/"))
        present = rospy.get_param(key, None)
        living = _living(present)
        if living is None:
            if present is not None:
                rospy.delete_param(key)
            mark = "\n<!-- {} -->" if text.lstrip().startswith("<") else " # {}"
            rospy.set_param(key, text + mark.format(f"set by process {os.getpid()} of {rospy.get_node_uri()}"))
        elif str(living).strip() not in (text.strip(), original.strip()):
            logger.warning(
                "parameter %s was there already, stays, and differs from what this node would set; "
                "after another robot: rosparam delete %s, and start again",
                key,
                key,
            )

    def reader(self, topic: str, message: str, kept: int = 0) -> RosReader:
        """See `Middleware.reader`."""
        return self._keep(RosReader(topic, message, self.now, kept=kept, in_lockstep=self._follower is not None))

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> RosQueue:
        """See `Middleware.queue`."""
        return self._keep(RosQueue(topic, message, size, largest=largest))

    def require_fields(self, interface: str, message: type) -> None:
        """See `Middleware.require_fields`."""
        require_fields(interface, message)

    def writer(self, topic: str, message: str) -> RosWriter:
        """See `Middleware.writer`."""
        return self._keep(RosWriter(topic, message))

    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """See `Middleware._first_order`.

        Raises:
            ShutdownRequested: The node has to end.
        """
        reader = RosReader(topic, message)
        try:
            order = JointOrder(reader)
            wait_for(order.read, timeout, self.running)
            return reader.topic, tuple(order.names) or None
        finally:
            reader.close()

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`.

        Raises:
            MiddlewareError: No node offers the service, or no answer came in time.
            ShutdownRequested: The node has to end.
        """
        return replied(call(name, interface, request, timeout=timeout, running=self.running), reply)

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`; it is sent also when the node has to end."""
        answer = in_thread(
            lambda: replied(call(name, interface, request, timeout=timeout, running=lambda: True), reply)
        )
        self._requests = [*self._open_requests(), answer]
        return answer

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`.

        Raises:
            ComponentError: A declaration does not fit its interface.
            MiddlewareError: Another node offers a service of that name.
        """
        for service in services:
            made = RosService(owner, service, submit, running=self.running)
            self._services.append(made)
            if service.name in (GET_PARAMETERS, SET_PARAMETERS):
                pair = self._tunings.setdefault(owner, {})
                pair[service.name] = made
                if len(pair) == 2:
                    self._services.append(ReconfigureServer(owner, pair[GET_PARAMETERS], pair[SET_PARAMETERS]))

    def topics(self) -> "Future[Topics]":
        """See `Middleware.topics`; the master is called in a thread of its own."""
        answer = in_thread(lambda: topics_beside(self.name, tuple(self._endpoints)))
        if self._follower is not None:  # in lock-step it is there in the next cycle, however busy the machine is
            self._requests = [*self._open_requests(), answer]
        return answer

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""
        self._diagnostics.report(name, level, summary, values)

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        return self._diagnostics.reports()

    def close(self) -> None:
        """See `Middleware.close`; the node ends with it.

        Raises:
            MiddlewareError: The node has ended because its master was lost.
        """
        writers = [endpoint for endpoint in self._endpoints if isinstance(endpoint, RosWriter)]
        end = time.monotonic() + 0.5
        while not all(writer.flush() for writer in writers) and time.monotonic() < end:
            time.sleep(0.005)
        time.sleep(0.05)  # rospy's sending threads send what they have already taken
        wait(self._requests, timeout=1.0)
        parts = (*filter(None, (self._follower,)), *self._services, *self._endpoints, self._diagnostics)
        for part in () if self.loss else parts:  # without a master there is nothing to unregister from
            try:
                part.close()
            except (rospy.ROSException, rospy.ServiceException, rosgraph.MasterException, OSError) as error:
                logger.warning("not unregistered: %s", error)
        self._services.clear()
        self._endpoints.clear()
        self._node.close()

    def _open_requests(self) -> list[Future[Any]]:
        """Drop the requests that are answered and return the others."""
        return [each for each in self._requests if not each.done()]

    def _keep(self, endpoint: Endpoint) -> Endpoint:
        self._endpoints.append(endpoint)
        return endpoint


def _living(value: Any) -> Any:
    """Return the value of a parameter as it was set; None if its node has ended without another one that sets it."""
    # a comment of XML or YAML names the node: it goes with the text when another one sets the parameter
    comment = r"(?:\n<!--| #) set by process (\d+) of (\S+?)(?: -->)?\s*$"
    setter = re.search(comment, value) if isinstance(value, str) else None
    if setter is None:
        return value
    return value[: setter.start()] if lives(setter[2], int(setter[1])) else None
