"""The interface of a middleware.

Plugins, the simulator's server and the tests use only this class and its endpoints; `middleware/` implements them.
"""

import abc
import logging
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import Any

from solfer.errors import MiddlewareError
from solfer.interfaces.declaration import Action, Service
from solfer.transport.endpoints import Queue, Reader, Writer
from solfer.transport.health import Health
from solfer.transport.messages import canonical
from solfer.transport.topics import Missing, Topics

logger = logging.getLogger(__name__)

Submit = Callable[[Callable[[], Any]], "Future[Any]"]
"""Runs a call from any thread between two cycles; the Future holds its result or its error."""


JOINT_NAMES = "solfer/GetJointNames"
"""Interface of `<controller>/get_joint_names`."""

CONTROLLER_GAINS = "solfer/GetGains"
"""Interface of `<controller>/get_gains`."""

TRIGGER = "std_srvs/Trigger"
"""Interface of services without a request, such as `lower_level/emergency_stop`."""


SEED = "/robot_seed"
"""Parameter: seed of the noise of a simulated robot."""

SWITCH_ONE = "std_srvs/SetBool"
"""Interface of services that switch one thing on or off."""

SWITCH = "solfer/SwitchControllers"
"""Interface of services that start and stop several controllers or plugins at once."""


@dataclass(frozen=True)
class NoFields:
    """A request without fields."""


@dataclass(frozen=True)
class Flag:
    """A request to switch something on or off."""

    data: bool


@dataclass(frozen=True)
class SwitchRequest:
    """Controllers or plugins to start and to stop."""

    start: tuple[str, ...] = ()
    stop: tuple[str, ...] = ()


@dataclass(frozen=True)
class JointNames:
    """Reply of `<controller>/get_joint_names`: joints of a lower-level controller, in its order."""

    success: bool = True
    message: str = ""
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class ControllerGains:
    """Reply of `<controller>/get_gains`: the gains of an impedance controller's joints, in its order.

    Attributes:
        stiffness: [Nm/rad, N/m].
        damping: [Nms/rad, Ns/m].
    """

    success: bool = True
    message: str = ""
    names: tuple[str, ...] = ()
    stiffness: tuple[float, ...] = ()
    damping: tuple[float, ...] = ()


@dataclass(frozen=True)
class HealthReport:
    """Health of a part: its level, one sentence, figures."""

    level: Health
    summary: str
    values: Mapping[str, float | str]


class Middleware(abc.ABC):
    """A connection to the outside: topics, services, parameters and a clock.

    Topic names without a leading slash are relative to the node's namespace. Message names are canonical
    (`solfer.transport.messages.canonical`).

    Attributes:
        name: Name of this node: the sender of its messages.
        rewinds: How often the simulated time that this node follows has gone back; `now` never does.
        loss: Why this node has to end without a request to, in one line; empty while it need not.
    """

    name: str
    rewinds: int = 0
    loss: str = ""

    @abc.abstractmethod
    def now(self) -> float:
        """Return the monotonic time [s]."""

    def rewind_words(self) -> Any:
        """Return live numbers of which the first is `rewinds`: each cycle of each plugin looks at it."""
        return _Rewinds(self)

    def stamp_time(self) -> float:
        """Return the time in which messages are stamped [s]: `now`, unless the middleware has another one for that."""
        return self.now()

    @abc.abstractmethod
    def sleep_until(self, deadline: float) -> None:
        """Return at `deadline` (in the time of `now`) [s], or at once when it has passed."""

    @abc.abstractmethod
    def publish_time(self, simulated: float) -> None:
        """Publish a simulation's time [s] for all nodes that follow it; it may go back."""

    @abc.abstractmethod
    def running(self) -> bool:
        """Return False as soon as the end was requested."""

    @abc.abstractmethod
    def parameter(self, name: str, where: str = "") -> Any:
        """Return the value of a parameter.

        Raises:
            UnknownName: There is no such parameter; `where` is the place that names it.
        """

    def first_values(self, owner: str) -> Mapping[str, Any]:
        """Return values with which live parameters of a part begin, by name; by default those of its files count."""
        return {}

    def resolve(self, topic: str) -> str:
        """Return the one name of a topic for all that may be given: by default without a leading slash."""
        return topic.lstrip("/")

    @abc.abstractmethod
    def reader(self, topic: str, message: str, kept: int = 0) -> Reader:
        """Make a reader of the newest message of a topic.

        Args:
            topic: Name of the topic.
            message: Canonical name of its message.
            kept: Messages of each publisher that wait for `Reader.read_next`; 0: the newest alone.
        """

    @abc.abstractmethod
    def queue(self, topic: str, message: str, size: int = 64, largest: int | None = None) -> Queue:
        """Make a queue of every message of a topic.

        Args:
            topic: Name of the topic.
            message: Canonical name of its message.
            size: Messages of one sender that may wait.
            largest: Most bytes of a message on the network; a larger one is dropped undecoded. None: any size.
        """

    def declared_queue(self, topic: str, message: str) -> Queue:
        """Make a queue of every message of a topic that a component declares; other layers may publish there, too."""
        return self.queue(topic, message)

    def declared_writer(self, topic: str, message: str) -> Writer:
        """Make a writer of a topic that a component declares."""
        return self.writer(topic, message)

    def pending(self, queues: Sequence[Queue]) -> Callable[[], bool]:
        """Return a function that reports whether messages may wait in any of these queues, as `Queue.waits` does."""
        return partial(any, [queue.waits for queue in queues])

    def require_fields(self, interface: str, message: type) -> None:  # noqa: B027 most have no types
        """Check that the fields of a dataclass are those of an interface, where the middleware has types.

        Raises:
            SolferError: One is not, or there is no such interface.
        """

    def action(self, owner: str, action: Action) -> Any:
        """Return the server of an action in a protocol of the middleware's own; None: it travels by topics.

        The server has the methods of `transport.declared.action_server.ActionServer`.
        """
        return None

    @abc.abstractmethod
    def writer(self, topic: str, message: str) -> Writer:
        """Make a writer to a topic."""

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """Return the names of the joints on a joint-space topic: those of its first message, then those of others.

        All publishers count that are known by then. Warns after a second when the topic has no publisher.

        Raises:
            MiddlewareError: Nothing arrived within `timeout` [s]; names what is wrong with the topic.
        """
        message = canonical(message, where)
        quiet = 1.0  # time without a first message after which a missing publisher is reported [s]
        topic, order = self._first_order(topic, message, min(quiet, timeout))
        if order is None and timeout > quiet:
            missing = self._missing_publisher(topic, message)
            if missing is not None:
                logger.warning("%s%s%s", f"{where}: " if where else "", missing.what, missing.hint)
            topic, order = self._first_order(topic, message, timeout - quiet)
        if order is not None:
            return order
        missing = self._missing_publisher(topic, message)
        raise MiddlewareError(
            f"nothing on topic '{topic}' within {timeout:g} s: "
            + (missing.what if missing is not None else "it has a publisher, but no message arrives"),
            where=where,
            names=missing.names if missing is not None else (),
        )

    @abc.abstractmethod
    def _first_order(self, topic: str, message: str, timeout: float) -> tuple[str, tuple[str, ...] | None]:
        """Resolve a joint-space topic, and wait up to `timeout` [s] for the names in its messages; None: there is none.

        See `JointOrder`.
        """

    def _missing_publisher(self, topic: str, message: str) -> Missing | None:
        """Look up what is wrong with a topic, see `Topics.missing_publisher`; waits for the answer.

        Raises:
            MiddlewareError: The publishers cannot be found out.
        """
        return self.topics().result().missing_publisher(topic, message)

    def is_received(self, topic: str, message: str) -> bool:
        """Return whether another node receives this type of message on a topic; waits for the answer.

        Raises:
            MiddlewareError: The subscribers cannot be found out.
        """
        return self.topics().result().missing_subscriber(topic, message) is None

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """Return the names of the joints of a lower-level controller, in its order.

        Raises:
            ServiceUnavailable: No node offered them within `timeout` [s].
            MiddlewareError: The controller did not answer within `timeout`, or refuses.
        """
        try:
            reply = self.call(
                f"{controller}/get_joint_names", JOINT_NAMES, NoFields(), reply=JointNames, timeout=timeout
            )
        except MiddlewareError as error:
            raise type(error)(
                f"lower-level controller '{controller}' does not name its joints: {error.what}",
                where=where,
                expected=error.expected
                or f"a running simulator or robot, or a node that receives {controller}/command",
                names=error.names,
            ) from error
        if not reply.success:
            raise MiddlewareError(
                f"lower-level controller '{controller}' refuses: {reply.message}",
                where=where,
                expected="a controller of the lower level that runs",
            )
        return tuple(reply.names)

    def controller_gains(self, controller: str, timeout: float, where: str = "") -> dict[str, tuple[float, float]]:
        """Return stiffness [Nm/rad] and damping [Nms/rad] that a lower-level controller has without a command.

        Raises:
            MiddlewareError: There is no such controller, it has no gains, or it did not answer within `timeout` [s].
        """
        try:
            reply = self.call(
                f"{controller}/get_gains", CONTROLLER_GAINS, NoFields(), reply=ControllerGains, timeout=timeout
            )
        except MiddlewareError as error:
            raise MiddlewareError(
                f"lower-level controller '{controller}' does not report its gains: {error.what}",
                where=where,
                expected="an impedance controller, or a pipe without stiffness and damping",
            ) from error
        gains = zip(reply.stiffness, reply.damping, strict=True)
        return dict(zip(reply.names, gains, strict=True))

    @abc.abstractmethod
    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """Call a service and wait for the reply.

        Args:
            name: Full name of the service, such as 'joint_states/trajectory'.
            interface: `package/Type` of the service.
            request: Dataclass with the fields of the interface's request.
            reply: Dataclass type with the fields of the interface's reply.
            timeout: Longest wait for the service and its reply [s].

        Raises:
            MiddlewareError: The service does not exist, or did not reply in time.
        """

    @abc.abstractmethod
    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """Call a service without waiting for the reply; see `call`.

        The Future holds the reply, or a MiddlewareError: ServiceUnavailable if the service does not exist.
        """

    @abc.abstractmethod
    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """Offer `services` as `<owner>/<service name>`; requests run through `submit`."""

    @abc.abstractmethod
    def topics(self) -> "Future[Topics]":
        """Request the topics of all other nodes. Not for the cycle: it takes time, though it does not block.

        The Future holds the answer, or a MiddlewareError if it cannot be found out.
        """

    @abc.abstractmethod
    def report(self, name: str, level: Health, summary: str, values: Mapping[str, float | str]) -> None:
        """Publish the health of a part: its level, one sentence, figures."""

    @abc.abstractmethod
    def reports(self) -> Mapping[str, HealthReport]:
        """Return the newest health report of each part since the first call, by the name of the part."""

    @abc.abstractmethod
    def close(self) -> None:
        """Send what is still queued, wait a little for the replies to requests, then release everything."""


class _Rewinds:
    """The `rewinds` of a middleware as a number at the place 0."""

    def __init__(self, middleware: Middleware):
        self._middleware = middleware

    def __getitem__(self, place: int) -> int:
        return self._middleware.rewinds
