"""What a component offers to the outside, declared without any transport.

A middleware binds a declaration to what it has: the ROS middleware to a service, the memory middleware to a call.
Handlers run between two cycles, never in the middle of one.
"""

import functools
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
        prepare: Does what takes long, such as reading a file, before the call waits for its turn: takes the `request`,
            and returns what the handler takes instead. It raises as a handler does, and must not touch what the cycle
            uses.
    """

    name: str
    interface: str
    request: type
    reply: type
    handler: Callable[[Any], Any]
    timeout: float = 2.0
    prepare: Callable[[Any], Any] | None = None

    def prepared(self, request: Any) -> Callable[[], Any]:
        """What is left to do between two cycles; `prepare` is done. To be called outside of the cycle."""
        return functools.partial(self.handler, self.prepare(request) if self.prepare else request)
