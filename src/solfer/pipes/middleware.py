"""What a middleware has to offer.

Plugins, the simulator's server and the tests use this class and its endpoints only; `middleware/` implements them.
"""

import abc
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from solfer.components.declaration import Service
from solfer.errors import MiddlewareError
from solfer.pipes.endpoints import Queue, Reader, Writer

Submit = Callable[[Callable[[], Any]], "Future[Any]"]
"""Takes a call from any thread and runs it between two cycles; the Future holds what it returned or raised."""


JOINT_NAMES = "solfer/GetJointNames"
"""Interface of `<controller>/get_joint_names`."""

TRIGGER = "std_srvs/Trigger"
"""Interface of services without a request, such as `lower_level/emergency_stop`."""


@dataclass(frozen=True)
class NoFields:
    """A request without fields."""


@dataclass(frozen=True)
class Flag:
    """A request to switch something on or off."""

    data: bool


@dataclass(frozen=True)
class JointNames:
    """Reply of `<controller>/get_joint_names`: joints of a lower-level controller, in its order."""

    success: bool = True
    message: str = ""
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class Report:
    """Health of a part: level 0 good, 1 warning, 2 error; one sentence; figures."""

    level: int
    summary: str
    values: Mapping[str, float | str]


class Middleware(abc.ABC):
    """A way to the outside: topics, services, parameters and a clock.

    Topic names without a leading slash are relative to the node's namespace. Message names are canonical
    (`solfer.pipes.messages.canonical`).

    Attributes:
        name: Who this node is to the others: the sender of what it writes.
        rewinds: How often the simulated time that this node goes by has gone back; `now` never does.
    """

    name: str
    rewinds: int = 0

    @abc.abstractmethod
    def now(self) -> float:
        """Monotonic time [s]."""

    @abc.abstractmethod
    def sleep_until(self, deadline: float) -> None:
        """Return at `deadline` (in the time of `now`) [s], or at once when it has passed."""

    @abc.abstractmethod
    def tell_time(self, simulated: float) -> None:
        """Tell a simulation's time [s] to all who go by it; it may go back."""

    @abc.abstractmethod
    def running(self) -> bool:
        """False as soon as somebody asked for the end."""

    @abc.abstractmethod
    def parameter(self, name: str, where: str = "") -> Any:
        """Value of a parameter.

        Raises:
            UnknownName: There is no such parameter; `where` is the place that named it.
        """

    @abc.abstractmethod
    def reader(self, topic: str, message: str) -> Reader:
        """Read the newest message of a topic."""

    @abc.abstractmethod
    def queue(self, topic: str, message: str, size: int = 64) -> Queue:
        """Read every message of a topic."""

    @abc.abstractmethod
    def writer(self, topic: str, message: str) -> Writer:
        """Write to a topic."""

    @abc.abstractmethod
    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """Names of the joints, in the order of the first message on a joint-space topic.

        Raises:
            MiddlewareError: Nothing arrived within `timeout` [s].
        """

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """Names of the joints of a lower-level controller, in its order.

        Raises:
            MiddlewareError: There is no such controller, or it did not answer within `timeout` [s].
        """
        try:
            reply = self.call(f"{controller}/get_joint_names", JOINT_NAMES, NoFields(), JointNames, timeout)
        except MiddlewareError as error:
            raise MiddlewareError(
                f"lower-level controller '{controller}' does not tell its joints: {error.what}",
                where=where,
                expected=error.expected or "a simulator or a robot that runs",
                names=error.names,
            ) from error
        if not reply.success:
            raise MiddlewareError(f"lower-level controller '{controller}' refuses: {reply.message}", where=where)
        return tuple(reply.names)

    @abc.abstractmethod
    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """Ask a service and wait for the answer.

        Args:
            name: Full name of the service, such as 'joint_states/trajectory'.
            interface: `package/Type` of the service.
            request: Dataclass with the fields of the interface's request.
            reply: Dataclass type with the fields of the interface's reply.
            timeout: Longest wait for the service and its answer [s].

        Raises:
            MiddlewareError: Nobody offers the service, or no answer came in time.
        """

    @abc.abstractmethod
    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """Ask a service and go on; see `call`.

        The Future holds the reply, or a MiddlewareError: NotOffered if nobody offers the service.
        """

    @abc.abstractmethod
    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """Offer `services` as `<owner>/<service name>`; requests are carried out by `submit`."""

    @abc.abstractmethod
    def report(self, name: str, level: int, summary: str, values: Mapping[str, float | str]) -> None:
        """Publish the health of a part: level 0 good, 1 warning, 2 error."""

    @abc.abstractmethod
    def reports(self) -> Mapping[str, Report]:
        """The newest health report of each part that was heard since the first call, by the name of the part."""

    @abc.abstractmethod
    def close(self) -> None:
        """Send what is still queued, wait a little for the replies to requests, then release everything."""
