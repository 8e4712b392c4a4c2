"""Events and requests of a plugin: noted for a recording, sent again in a replay."""

import json
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

from solfer.errors import UnknownName
from solfer.interfaces.declaration import Action, Declaration, Service, TopicIn
from solfer.recording.model import REQUEST
from solfer.transport.declared.fields import made, plain
from solfer.transport.inbox import pass_on


class RequestNotes:
    """Notes requests, messages of declared topics and goals when they are carried out, in the order of the cycle.

    Attributes:
        enabled: Whether notes are recorded.
        notes: What happened since they were taken last: kind and text of an event. That of a request has name and
            fields, as JSON.
        requested: Called with the name of each goal, and of each request that is to move the robot, when it is carried
            out; returns what its caller has to know, empty: nothing.
    """

    def __init__(self) -> None:
        self.enabled = False
        self.notes: list[tuple[str, str]] = []
        self.requested: Callable[[str], str] = lambda name: ""
        self._calls: dict[str, Callable[[Mapping[str, Any]], Callable[[], Any]]] = {}

    def note(self, kind: str, text: str) -> None:
        """Note an event."""
        if self.enabled:
            self.notes.append((kind, text))

    def noted(self, declaration: Declaration) -> Declaration:
        """Return a declaration that does the same, and notes the requests."""
        name = declaration.name
        if isinstance(declaration, Service):
            service = declaration
            request = declaration.request
            self._calls[name] = lambda fields: service.prepared(made(request, fields))
            return self._service(service)
        if isinstance(declaration, TopicIn):
            topic = declaration
            self._calls[name] = lambda fields: _call(topic.handler, made(topic.message, fields))
            return replace(topic, handler=lambda value: self._note(name, value, topic.handler))
        if isinstance(declaration, Action):
            action = declaration
            self._calls[name] = lambda fields: _call(action.begin, made(action.goal, fields))
            self._calls[f"{name}/cancel"] = lambda fields: action.cancel
            return replace(
                action,
                begin=lambda goal: self._begin(name, goal, action.begin),
                cancel=lambda: self._note(f"{name}/cancel", {}, lambda _: action.cancel()),
            )
        return declaration

    def repeated(self, note: str) -> Callable[[], Any]:
        """Return the call that a note is of, to be made between two cycles.

        Raises:
            ValueError: The note was cut.
            UnknownName: The component does not declare this.
            SolferError: The request does not fit.
        """
        name, fields = json.loads(note)
        if name not in self._calls:
            raise UnknownName("declaration", name, self._calls)
        return self._calls[name](fields)

    def _service(self, service: Service) -> Service:
        if service.prepare is None:
            return replace(service, handler=lambda request: self._carry_out(service, request, service.handler))
        prepare = service.prepare
        return replace(
            service,
            prepare=lambda request: (request, prepare(request)),
            handler=lambda pair: self._carry_out(service, pair[0], lambda _: service.handler(pair[1])),
        )

    def _begin(self, name: str, goal: Any, begin: Callable[[Any], Any]) -> Any:
        self.requested(name)
        return self._note(name, goal, begin)

    def _carry_out(self, service: Service, request: Any, handler: Callable[[Any], Any]) -> Any:
        """Carry out a request; its reply, also one that comes later, contains what `requested` returns."""
        reply = self._note(service.name, request, handler)
        warning = self.requested(service.name) if service.commands else ""
        if not warning:
            return reply
        if not isinstance(reply, Future):
            return _warned(reply, warning)
        answer: Future[Any] = Future()
        reply.add_done_callback(lambda done: pass_on(done, answer, lambda value: _warned(value, warning)))
        return answer

    def _note(self, name: str, value: Any, handler: Callable[[Any], Any]) -> Any:
        if self.enabled:
            self.notes.append((REQUEST, json.dumps([name, plain(value)], default=str)))
        return handler(value)


def _warned(reply: Any, warning: str) -> Any:
    """Add a warning to a reply; a refusal, and a reply without a message, stay as they are."""
    message = getattr(reply, "message", None)
    if message is None or not getattr(reply, "success", True):
        return reply
    return replace(reply, message="; ".join(filter(None, (message, warning))))


def _call(handler: Callable[[Any], Any], value: Any) -> Callable[[], Any]:
    return lambda: handler(value)
