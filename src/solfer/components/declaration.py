"""What a component offers to the outside, declared without any transport.

A middleware binds a declaration to what it has: the ROS middleware to a service, the memory middleware to a call.
Handlers run between two cycles, never in the middle of one.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Service:
    """A request with a reply.

    Attributes:
        name: Name below the owner's, as in `<owner>/trajectory`.
        interface: `package/Type`, the name of the service type where a middleware has types (ROS: a .srv file).
        request: Dataclass of the request. Its fields are those of the interface; lists arrive as tuples.
        reply: Dataclass of the reply, with the fields of the interface.
        handler: Takes a `request`, returns a `reply`. A `SolferError` that it raises becomes a refusal: the reply
            with `success` false and the error as `message`.
        timeout: Longest time until the reply [s].
    """

    name: str
    interface: str
    request: type
    reply: type
    handler: Callable[[Any], Any]
    timeout: float = 2.0
