"""The Middleware of a node without ROS: everything is in shared memory."""

import json
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Protocol

from solfer.components.declaration import Service
from solfer.errors import MiddlewareError, UnknownName
from solfer.middleware.xbot.calls import Calls
from solfer.middleware.xbot.clock import MonotonicClock
from solfer.middleware.xbot.endpoints import XbotQueue, XbotReader, XbotWriter
from solfer.middleware.xbot.namespace import Namespace
from solfer.middleware.xbot.reports import Reports
from solfer.middleware.xbot.services import Offer
from solfer.middleware.xbot.simulated import SimulatedTime
from solfer.pipes.messages import canonical
from solfer.pipes.middleware import Middleware, Report, Submit

PARAMETERS = "parameters"
WAIT = 1e-3
"""Time between two looks for what is waited for [s]."""


class Clock(Protocol):
    """A clock that all processes of a namespace have in common."""

    def now(self) -> float:
        """Time [s], which never goes back."""

    def sleep_until(self, deadline: float) -> None:
        """Return at `deadline` [s], or at once when it has passed."""


class XbotMiddleware(Middleware):
    """Topics, services, parameters and reports in the shared memory of a namespace.

    Topic names are those of all nodes of the namespace. Services are answered, and replies to requests arrive, in
    `poll`, which `sleep_until` calls; who cycles without it calls `poll` in each cycle.

    Args:
        namespace: Name of the namespace, or the namespace itself, which several nodes of one process may share.
        name: Name of the node; it is the sender of what it writes.
        parameters: Values that can be asked for by name.
        clock: Clock of all nodes of the namespace; None: the machine's monotonic clock.

    Raises:
        MiddlewareError: There is no such namespace and none can be made.
    """

    def __init__(self, namespace: Namespace | str, name: str = "node", parameters: Mapping[str, Any] | None = None,
                 clock: Clock | None = None):
        self.namespace = namespace if isinstance(namespace, Namespace) else Namespace(namespace)
        self.name, self._clock = name, clock or MonotonicClock()
        self.now = self._clock.now  # without a call in between: a cycle asks for the time some thirty times
        self._parameters = {key.lstrip("/"): value for key, value in (parameters or {}).items()}
        self._ended = False
        self._endpoints: list[XbotReader | XbotQueue | XbotWriter] = []
        self._offers: list[Offer] = []
        self._any, self._busy = self.namespace.any_bell(), True
        self._calls, self._reports = Calls(self.namespace, name, self.now), Reports(self.namespace)
        self._simulated, self._worker = SimulatedTime(self.namespace.folder), ThreadPoolExecutor(1)

    @property
    def rewinds(self) -> int:
        """See `Middleware.rewinds`; of a simulation in this namespace."""
        return self._simulated.rewinds

    def now(self) -> float:
        """See `Middleware.now`."""
        return self._clock.now()

    def sleep_until(self, deadline: float) -> None:
        """See `Middleware.sleep_until`; calls and replies are taken afterwards."""
        self._clock.sleep_until(deadline)
        self.poll()

    def poll(self) -> None:
        """Take calls of services and replies to requests that have come. Does not block."""
        if self._busy or self._any.rung():
            self._any.hear()
            for offer in self._offers:
                offer.poll()
            self._busy = any(offer.busy for offer in self._offers)
        self._calls.poll()

    def tell_time(self, simulated: float) -> None:
        """See `Middleware.tell_time`; nobody goes by it, but all know when it goes back."""
        self._simulated.tell(simulated)

    def end(self) -> None:
        """Ask for the end."""
        self._ended = True

    def running(self) -> bool:
        """See `Middleware.running`."""
        return not self._ended

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`; the node's own, else those that somebody has set with `provide`."""
        if name.lstrip("/") in self._parameters:
            return self._parameters[name.lstrip("/")]
        try:
            return json.loads(self.namespace.path(PARAMETERS, name).read_text())
        except FileNotFoundError:
            known = (*self._parameters, *self.namespace.present(PARAMETERS))
            raise UnknownName("parameter", name, known, where=where) from None
        except (OSError, ValueError) as error:
            raise MiddlewareError(f"parameter '{name}' cannot be read: {error}", where=where) from error

    def provide(self, name: str, value: Any) -> None:
        """Set a parameter of the namespace, which stays when this node ends.

        Raises:
            MiddlewareError: There is no room for it.
        """
        path = self.namespace.place(PARAMETERS, name)
        draft = path.with_name(f"{path.name}.{os.getpid()}.new")
        try:
            draft.write_text(json.dumps(value))
            draft.rename(path)
        except OSError as error:
            raise MiddlewareError(f"parameter '{name}' cannot be set: {error.strerror}", where=str(path)) from error

    def reader(self, topic: str, message: str) -> XbotReader:
        """See `Middleware.reader`."""
        return self._keep(XbotReader(self.namespace, topic, message, self._clock.now))

    def queue(self, topic: str, message: str, size: int = 64) -> XbotQueue:
        """See `Middleware.queue`."""
        return self._keep(XbotQueue(self.namespace, topic, message, size))

    def writer(self, topic: str, message: str) -> XbotWriter:
        """See `Middleware.writer`.

        Raises:
            MiddlewareError: Another node of this name writes there, or the topic carries another message.
        """
        return self._keep(XbotWriter(self.namespace, topic, message, self.name, self._clock.now))

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.joint_order`."""
        reader = XbotReader(self.namespace, topic, canonical(message, where), self.now)
        end = self.now() + timeout
        while not reader.read():
            if self.now() >= end or not self.running():
                raise MiddlewareError(f"nothing on topic '{topic}' within {timeout:g} s", where=where)
            self.sleep_until(self.now() + WAIT)
        return reader.message.names

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`."""
        answer = self.request(name, interface, request, reply, timeout)
        while not answer.done():
            if not self.running():
                raise MiddlewareError(f"the caller of service '{name}' ends")
            self.sleep_until(self.now() + WAIT)
        return answer.result()

    def request(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> "Future[Any]":
        """See `Middleware.request`; the reply comes in `poll`."""
        return self._calls.ask(name, interface, request, reply, timeout)

    def serve(self, owner: str, services: Sequence[Service], submit: Submit) -> None:
        """See `Middleware.serve`.

        Raises:
            MiddlewareError: Another process or node offers such a service.
        """
        self._busy = True
        for service in services:
            self._offers.append(Offer(self.namespace, owner, service, submit, self.now, self._worker))

    def report(self, name: str, level: int, summary: str, values: Mapping[str, float | str]) -> None:
        """See `Middleware.report`."""
        self._reports.write(name, Report(level, summary, values), self.now())

    def reports(self) -> Mapping[str, Report]:
        """See `Middleware.reports`."""
        return self._reports.read()

    def close(self) -> None:
        """See `Middleware.close`; nothing is queued here."""
        for part in (*self._offers, *self._endpoints, self._calls, self._reports):
            part.close()
        self._offers.clear()
        self._endpoints.clear()
        self._worker.shutdown(wait=False)

    def _keep(self, endpoint: Any) -> Any:
        self._endpoints.append(endpoint)
        return endpoint
