"""Services of a component, declared without any transport.

A middleware binds a declaration to its own means: the ROS middleware to a service, the memory middleware to a call.
Handlers run between two cycles, never in the middle of one.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

LARGEST = 65536
"""Bytes of a request, unless its service wants it otherwise."""


@dataclass(frozen=True)
class Service:
    """A request with a reply.

    Attributes:
        name: Name below the owner's, as in `<owner>/trajectory`.
        interface: `package/Type`, the name of the service type where a middleware has types (ROS: a .srv file).
        request: Dataclass of the request. Its fields are those of the interface; lists arrive as tuples.
        reply: Dataclass of the reply, with the fields of the interface.
        handler: Maps a `request` to a `reply`. A `SolferError` that it raises becomes a refusal: the reply
            with `success` false and the error as `message`.
        timeout: Longest time until the reply [s].
        prepare: Does the slow part, such as reading a file, before the call waits for its turn: maps the `request`
            to the handler's argument. It raises as a handler does, and must not touch what the cycle
            uses.
        largest: Bytes of a request as it comes over a network; a larger one is refused undecoded.
        urgent: Whether it goes before all others and is not rationed: it has to cost next to nothing.
    """

    name: str
    interface: str
    request: type
    reply: type
    handler: Callable[[Any], Any]
    timeout: float = 2.0
    prepare: Callable[[Any], Any] | None = None
    largest: int = LARGEST
    urgent: bool = False

    def prepared(self, request: Any) -> Callable[[], Any]:
        """Run `prepare`, and return the call that is left to do between two cycles. To be called outside of the cycle.

        Where `prepare` requests an end (SystemExit and its like), the returned call raises it in the loop: the loop
        owns the component, the thread that calls here does not.
        """
        if self.prepare is None:
            return functools.partial(self.handler, request)
        try:
            return functools.partial(self.handler, self.prepare(request))
        except Exception:
            raise
        except BaseException as error:
            return functools.partial(_raise, error)


def _raise(error: BaseException) -> None:
    raise error
