"""Requests to the lower level at each start: feed-forward torques on, gains of a file."""

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from functools import partial
from typing import Any, NamedTuple

from solfer.config import ControllerRecord, TextRecord
from solfer.errors import PipeError, SolferError
from solfer.transport import Middleware
from solfer.transport.lower_level import LOAD_GAINS, SWITCH_FEED_FORWARD, Answer, FileRequest
from solfer.transport.middleware import Flag

logger = logging.getLogger(__name__)

REQUEST_PATIENCE = 5.0
"""Longest wait for an answer [s]."""


class StartRequest(NamedTuple):
    """A request.

    Attributes:
        service: Full name of the service.
        interface: `package/Type` of it.
        request: Its fields.
        what: What the lower level is requested, for the log.
    """

    service: str
    interface: str
    request: Any
    what: str


class StartRequests:
    """Sends requests to the lower level without waiting; a refusal is logged, and the lower level stays as it was.

    Args:
        plugin: Name of the plugin, for messages.
        middleware: Carries the requests.
        requests: The requests.
    """

    def __init__(self, plugin: str, middleware: Middleware, requests: Sequence[StartRequest]):
        self._plugin = plugin
        self._middleware = middleware
        self.requests = tuple(requests)

    def send(self) -> None:
        """Send them all."""
        for each in self.requests:
            answer = self._middleware.request(each.service, each.interface, each.request, Answer, REQUEST_PATIENCE)
            answer.add_done_callback(partial(self._report, each))

    def _report(self, request: StartRequest, answer: "Future[Any]") -> None:
        try:
            reply = answer.result()
            refusal = "" if reply.success else reply.message
        except SolferError as error:
            refusal = error.line
        if refusal:
            logger.error("%s: %s does not %s: %s", self._plugin, request.service, request.what, refusal)


def requests_of(records: Sequence[ControllerRecord], gains: TextRecord | None) -> Iterator[StartRequest]:
    """Yield the requests of pipes to the lower level.

    Args:
        records: The pipes.
        gains: Source of the gains, `source.controller`; None: there is none.

    Raises:
        PipeError: The gains are in a parameter: the lower level reads files.
    """
    given = gains if gains is not None and gains.given else None
    if given is not None and given.location is None:
        raise PipeError("gains in a parameter", where=given.where("parameter"), expected="file: FILE")
    for record in records:
        if record.ff_service is not None:
            what = "switch feed-forward torques on"
            yield StartRequest(_service(record, record.ff_service), SWITCH_FEED_FORWARD, Flag(True), what=what)
        if given is not None and (record.load_service is not None or record.has_springs):
            request = FileRequest(str(given.location))
            what = f"load {given.location}"
            service = _service(record, record.load_service or "/load_gains")
            yield StartRequest(service, LOAD_GAINS, request, what=what)


def _service(record: ControllerRecord, service: str) -> str:
    return f"{record.leads_to}/{service.lstrip('/')}"
