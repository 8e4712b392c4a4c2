"""Binds what a component declares to a middleware."""

import math
from collections.abc import Sequence

from solfer.errors import ComponentError, SolferError, UnknownName
from solfer.interfaces.declaration import Action, Declaration, Parameter, Service, TopicIn, TopicOut, full_name
from solfer.transport.declared.action_server import ActionServer
from solfer.transport.declared.fields import exactly
from solfer.transport.declared.publications import Publications
from solfer.transport.declared.topics import DeclaredIn, DeclaredOut, SoleSender
from solfer.transport.inbox import Inbox
from solfer.transport.middleware import Middleware


def bind(
    owner: str, declared: Sequence[Declaration], middleware: Middleware, inbox: Inbox, rate: float
) -> Publications:
    """Read the parameters, and connect the rest; what comes in is received with the calls of the inbox.

    Args:
        owner: Name of the component.
        declared: What it declares.
        middleware: Carries all of it.
        inbox: Calls from outside to the component.
        rate: Cycles per second [Hz].

    Returns:
        What it publishes.

    Raises:
        SolferError: A parameter or a rate is wrong, a name is declared twice, or a dataclass does not fit its
            interface.
    """
    _require_unique(owner, declared)
    _require_rates(owner, declared)
    middleware.serve(owner, [each for each in declared if isinstance(each, Service)], inbox.submit)
    publications = Publications()
    senders: dict[str, SoleSender] = {}
    for each in declared:
        if isinstance(each, Parameter):
            _read(full_name(owner, each.name), each, middleware)
        elif isinstance(each, TopicIn):
            sole = senders.setdefault(each.stream, SoleSender()) if each.stream else None
            topic = DeclaredIn(owner, each, middleware, sole=sole)
            inbox.sources.append(topic.receive)
            inbox.queues.append(topic.queue)
        elif isinstance(each, TopicOut):
            out = DeclaredOut(owner, each, middleware)
            publications.add(out.publish, cycles=1 if each.rate is None else max(1, round(rate / each.rate)))
            if each.rest is not None:
                inbox.sources.append(out.rest)
        elif isinstance(each, Action):
            server = middleware.action(owner, each) or ActionServer(owner, each, middleware)
            inbox.sources.append(server.receive)
            inbox.queues += server.queues
            publications.add(server.publish)
    return publications


def _require_unique(owner: str, declared: Sequence[Declaration]) -> None:
    names = [each.name for each in declared if isinstance(each, TopicIn | TopicOut | Action)]
    for name in names:
        if names.count(name) > 1:
            raise ComponentError(f"'{full_name(owner, name)}' is declared twice", expected="a name for each")


def _require_rates(owner: str, declared: Sequence[Declaration]) -> None:
    for each in declared:
        if not isinstance(each, TopicOut | Action) or each.rate is None:
            continue
        if not isinstance(each.rate, int | float) or not 0.0 < each.rate < math.inf:
            kind = "topic" if isinstance(each, TopicOut) else "action"
            what = f"'{owner}' declares the {kind} '{full_name(owner, each.name)}' with a rate of {each.rate!r:.80} Hz"
            raise ComponentError(what, expected="a positive rate")


def _read(name: str, parameter: Parameter, middleware: Middleware) -> None:
    """Hand a parameter to its component; one that is not there is left at what the component has."""
    try:
        value = middleware.parameter(name)
    except UnknownName:
        return
    try:
        value = exactly(parameter.kind, value)
    except TypeError:
        raise ComponentError(f"parameter '{name}' is {value!r:.80}", expected=f"a {parameter.kind.__name__}") from None
    try:
        parameter.handler(value)
    except SolferError as error:
        raise error.at(f"parameter '{name}'") from None
