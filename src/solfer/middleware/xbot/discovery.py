"""What is said and offered in a namespace at present, for those who have no configuration that tells it."""

import dataclasses
import json
from collections.abc import Container
from dataclasses import dataclass

from solfer.errors import MiddlewareError
from solfer.middleware.xbot.lane import KIND, PIPES
from solfer.middleware.xbot.namespace import Namespace
from solfer.middleware.xbot.segment import Segment
from solfer.middleware.xbot.services import SERVICES, offered

COMMANDS = "/command"
"""End of the names of topics of the lower level's controllers."""


@dataclass(frozen=True)
class Told:
    """A topic on which somebody speaks.

    Attributes:
        topic: Its name.
        message: Canonical name of its message.
    """

    topic: str
    message: str


@dataclass(frozen=True)
class Offered:
    """A service that somebody offers.

    Attributes:
        name: Its full name.
        interface: `package/Type`.
        request: Dataclass with the fields of the request.
        reply: Dataclass with the fields of the reply.
    """

    name: str
    interface: str
    request: type
    reply: type


def told(namespace: Namespace, known: Container[str] = ()) -> list[Told]:
    """Topics on which somebody who lives speaks; commands to controllers of the lower level are left out.

    Args:
        namespace: Where.
        known: Topics that are not looked at.
    """
    found = {}
    for topic in namespace.present(PIPES):
        if topic.endswith(COMMANDS) or topic in known:
            continue
        for sender in namespace.present(PIPES, topic):
            try:
                segment = Segment.attach(namespace.path(PIPES, topic, sender), KIND)
            except MiddlewareError:
                continue  # it ends at this moment, or it is damaged, which its listeners say
            if segment.owned():
                found[topic] = Told(topic, json.loads(segment.layout)["message"])
    return list(found.values())


def services(namespace: Namespace, known: Container[str] = ()) -> list[Offered]:
    """Services that somebody who lives offers.

    Args:
        namespace: Where.
        known: Services that are not looked at.
    """
    found = []
    for name in namespace.present(SERVICES):
        segment = None if name in known else offered(namespace, name)
        if segment is not None:
            interface, request, reply = json.loads(segment.layout)
            found.append(Offered(name, interface, _dataclass("Request", request), _dataclass("Reply", reply)))
    return found


def _dataclass(name: str, fields: list[str]) -> type:
    """A dataclass with the fields that a service's segment tells."""
    return dataclasses.make_dataclass(name, fields, frozen=True)
