"""The Middleware of a node of ROS 2."""

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, wait
from functools import partial
from typing import Any, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import String

from solfer.errors import UnknownName
from solfer.interfaces.declaration import Action, Service
from solfer.middleware.ros2.actions import Ros2Action
from solfer.middleware.ros2.codecs import require_fields, to_time
from solfer.middleware.ros2.endpoints import Ros2Queue, Ros2Reader, Ros2Writer
from solfer.middleware.ros2.lockstep import Ros2Lockstep
from solfer.middleware.ros2.node import Ros2Node
from solfer.middleware.ros2.parameters import NativeParameters
from solfer.middleware.ros2.quality import MismatchWatch, quality
from solfer.middleware.ros2.services import Ros2Service, call, replied
from solfer.transport.endpoints import NEW, JointOrder
from solfer.transport.health import Health
from solfer.transport.lockstep.client import LockstepClient
from solfer.transport.lockstep.server import LockstepServer
from solfer.transport.lockstep.step_clock import StepClock
from solfer.transport.middleware import HealthReport, Middleware, Submit
from solfer.transport.parameters import GET_PARAMETERS, SET_PARAMETERS
from solfer.transport.threaded_calls import in_thread
from solfer.transport.topics import Topics

Endpoint = TypeVar("Endpoint", Ros2Reader, Ros2Queue, Ros2Writer)

REPORT_PERIOD = 1.0
"""Shortest time between two reports of one part while its level stays the same [s]."""

LATCHED_TIMEOUT = 0.5
"""Longest wait for the first message of a latched topic, and until a new node knows which topics there are [s]."""


class Ros2Middleware(Middleware):
    """Topics, services and parameters of ROS 2; the clock is the node's.

    Args:
        node: The process' node; it is closed with the middleware.

    Attributes:
        node: The node.
    """

    def __init__(self, node: Ros2Node):
        self.node = node
        self._known = time.monotonic() + LATCHED_TIMEOUT
        self._ros = node.ros
        self.name = node.name
        self._endpoints: list[Ros2Reader | Ros2Queue | Ros2Writer] = []
        self._mismatches = MismatchWatch(self._ros, lambda: self._endpoints)
        self._services: list[Ros2Service | Ros2Action] = []
        self._live: dict[str, dict[str, Service]] = {}
        self._requests: list[Future[Any]] = []
        self._texts: dict[str, Ros2Reader] = {}
        self._provided: list[Any] = []
        self._diagnostics = self._ros.create_publisher(DiagnosticArray, "/diagnostics", quality(10, reliable=True))
        self._last: dict[str, tuple[float, Health]] = {}
        self._reports: dict[str, HealthReport] | None = None
        self._follower: LockstepClient | None = None
        if isinstance(node.clock, StepClock):
            self._follower = LockstepClient(
                Ros2Lockstep(node.ros), node.clock, self._endpoints, requests=self._open_requests, running=node.running
            )

    def now(self) -> float:
        """See `Middleware.now`."""
        return self.node.clock.now()

    def stamp_time(self) -> float:
        """See `Middleware.stamp_time`: ROS time."""
        return 1e-9 * self.node.clock.present()

    @property
    def rewinds(self) -> int:
        """See `Middleware.rewinds`."""
        self.now()  # takes the times that have come
        return self.node.clock.rewinds

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`."""
        (self._follower or self.node.clock).sleep_until(deadline)

    def publish_time(self, simulated: float) -> None:
        """See `Middleware.publish_time`."""
        self.node.clock.publish(simulated)

    def running(self) -> bool:
        """See `Middleware.running`."""
        return self.node.running()

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`: one of this node, else a text on a latched topic, such as /robot_description.

        ROS 2 has no parameters that nodes share; descriptions of robots are on topics of std_msgs/String instead.
        """
        key = name.strip("/").replace("/", ".")
        if self._ros.has_parameter(key):
            return self._ros.get_parameter(key).value
        topic = self._ros.resolve_topic_name(name.lstrip("/") if not name.startswith("/") else name)
        text = self._latched(topic)
        if text is None:
            present = self.topics().result().published
            texts = [each for each, message in present.items() if message == "std_msgs/String"]
            raise UnknownName("parameter or latched topic", name, [*self._ros._parameters, *texts], where=where)
        return text

    def _latched(self, topic: str) -> str | None:
        """Return the newest text on a latched topic; None: there is none."""
        reader = self._texts.get(topic)
        if reader is None:
            reader = self._texts[topic] = Ros2Reader(self._ros, topic, "std_msgs/String", latched=True)
        end = time.monotonic() + LATCHED_TIMEOUT
        while reader.read() is not NEW and reader.message is None:
            now = time.monotonic()
            if now > end or now > self._known and not self._ros.count_publishers(topic):
                break
            time.sleep(0.01)
        return None if reader.message is None else reader.message.fields["data"]

    def stamp_measurements(self, now: float) -> None:
        """Stamp messages from now on with when they were measured, by a clock that shows `now` [s] at present.

        Without it they are stamped with when they are sent. To be called by a node that does nothing but measure.
        """
        self.node.clock.epoch = self.stamp_time() - now

    def lockstep_server(self) -> LockstepServer | None:
        """Make what lets nodes follow a simulation in this node in lock-step; None if no node is to follow."""
        names = self.node.followers
        return LockstepServer(names, Ros2Lockstep(self._ros), self._endpoints, running=self.running) if names else None

    def provide(self, name: str, text: str, original: str = "") -> None:
        """Publish a text for all nodes that read the parameter `name`, as long as this node lives.

        Args:
            name: The parameter, also the name of the topic.
            text: Its value.
            original: What the text was made of; not needed here.
        """
        publisher = self._ros.create_publisher(String, name, quality(1, reliable=True, latched=True))
        publisher.publish(String(data=text))
        self._provided.append(publisher)

    def first_values(self, owner: str) -> Mapping[str, Any]:
        """See `Middleware.first_values`: parameters of this node that are called `<owner>.parameters.<name>`."""
        given = self._ros.get_parameters_by_prefix(f"{owner.strip('/').replace('/', '.')}.parameters")
        return {name: each.value for name, each in given.items()}

    def resolve(self, topic: str) -> str:
        """See `Middleware.resolve`: with the namespace and the remappings of the node."""
        return self._ros.resolve_topic_name(topic)

    def reader(self, topic: str, message: str, kept: int = 0) -> Ros2Reader:
        """See `Middleware.reader`."""
        reliable = bool(self.node.followers)
        return self._keep(Ros2Reader(self._ros, topic, message, self.now, kept=kept, reliable=reliable))

    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> Ros2Queue:
        """See `Middleware.queue`."""
        return self._keep(Ros2Queue(self._ros, topic, message, size, largest=largest))

    def require_fields(self, interface: str, message: type) -> None:
        """See `Middleware.require_fields`."""
        require_fields(interface, message)

    def writer(self, topic: str, message: str) -> Ros2Writer:
        """See `Middleware.writer`."""
        return self._keep(Ros2Writer(self._ros, topic, message, self.node.clock.stamp_of))

    def action(self, owner: str, action: Action) -> Ros2Action:
        """See `Middleware.action`: the protocol of ROS 2."""
        server = Ros2Action(owner, action, self._ros, self)
        self._services.append(server)
        return server

    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """See `Middleware._first_order`."""
        reader = Ros2Reader(self._ros, topic, message)
        try:
            order = JointOrder(reader)
            end = time.monotonic() + timeout
            while not order.read() and time.monotonic() < end and self.running():
                time.sleep(0.005)
            return reader.topic, tuple(order.names) or None
        finally:
            reader.close()

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`."""
        return replied(call(self._ros, name, interface, request, timeout=timeout, running=self.running), reply)

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`; it is sent also when the node has to end."""
        answer = in_thread(
            lambda: replied(call(self._ros, name, interface, request, timeout=timeout, running=lambda: True), reply)
        )
        self._requests = [*self._open_requests(), answer]
        return answer

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`; services of live parameters become parameters of the node, which has their names.

        Raises:
            ComponentError: A declaration does not fit its interface.
            MiddlewareError: Another node offers a service of that name.
        """
        for service in services:
            if service.name not in (GET_PARAMETERS, SET_PARAMETERS):
                self._services.append(Ros2Service(self._ros, owner, service, submit, running=self.running))
                continue
            pair = self._live.setdefault(owner, {})
            pair[service.name] = service
            if len(pair) == 2:
                prefix = "" if owner.strip("/") == self._ros.get_name() else f"{owner.strip('/').replace('/', '.')}."
                NativeParameters(self._ros, prefix, pair[GET_PARAMETERS], pair[SET_PARAMETERS], submit=submit)

    def topics(self) -> "Future[Topics]":
        """See `Middleware.topics`; the node knows them, so that the answer is there at once."""
        published: dict[str, str] = {}
        received: dict[str, str] = {}
        for topic, kinds in self._ros.get_topic_names_and_types():
            for found, ends in (
                (published, self._ros.get_publishers_info_by_topic),
                (received, self._ros.get_subscriptions_info_by_topic),
            ):
                others = [each for each in ends(topic) if self._full_name(each) != self.name]
                if others:
                    found[topic] = (others[0].topic_type or kinds[0]).replace("/msg/", "/")
        answer: Future[Topics] = Future()
        answer.set_result(Topics(published, received))
        return answer

    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""
        now = time.monotonic()
        last_time, last_level = self._last.get(name, (-REPORT_PERIOD, level))
        # A report that comes once a period must not be left out because it is a little early.
        if level == last_level and now - last_time < 0.9 * REPORT_PERIOD:
            return
        self._last[name] = (now, level)
        node = self.name.lstrip("/")
        pairs = [
            KeyValue(key=key, value=f"{value:.6g}" if isinstance(value, float) else str(value))
            for key, value in values.items()
        ]
        status = DiagnosticStatus(
            level=bytes([level]), name=f"{node}: {name}", message=summary, hardware_id=node, values=pairs
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = to_time(self.node.clock.present())
        self._diagnostics.publish(message)

    def reports(self) -> Mapping[str, HealthReport]:
        """See `Middleware.reports`."""
        if self._reports is None:
            self._reports = {}
            keep = partial(self._keep_reports, self._reports)
            self._ros.create_subscription(DiagnosticArray, "/diagnostics", keep, quality(64, reliable=True))
        return self._reports

    @staticmethod
    def _keep_reports(reports: dict[str, HealthReport], message: Any) -> None:
        for status in message.status:
            level = Health(min(status.level[0], Health.ERROR))  # stale is no level of ours
            values = {pair.key: pair.value for pair in status.values}
            reports[status.name.rpartition(": ")[2]] = HealthReport(level, status.message, values)

    def close(self) -> None:
        """See `Middleware.close`."""
        wait(self._requests, timeout=1.0)
        for part in (*filter(None, (self._follower,)), *self._services, *self._endpoints, *self._texts.values()):
            part.close()
        self._services.clear()
        self._endpoints.clear()
        self._texts.clear()
        self.node.close()

    def _open_requests(self) -> list[Future[Any]]:
        """Drop the requests that are answered and return the others."""
        return [each for each in self._requests if not each.done()]

    def _keep(self, endpoint: Endpoint) -> Endpoint:
        self._endpoints.append(endpoint)
        return endpoint

    @staticmethod
    def _full_name(end: Any) -> str:
        return f"{end.node_namespace.rstrip('/')}/{end.node_name}"
