"""Callers of the parameters' services: under ROS, and in the shared memory of an RT layer."""

import contextlib
import os
from collections.abc import Iterator
from typing import Any, Protocol

from solfer.transport.parameters import GET_INTERFACE, GET_PARAMETERS

TIMEOUT = 3.0
"""Longest time until a service answers [s]; a plugin whose loop stands still answers after 2 s."""


class Caller(Protocol):
    """Calls services of plugins."""

    def plugins(self) -> list[str]:
        """List the plugins that live and have parameters."""

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """Call a service; see `Middleware.call`."""


@contextlib.contextmanager
def caller(namespace: str) -> Iterator[Caller]:
    """Make the caller of a namespace; of an empty one that of ROS.

    Raises:
        UnknownName: There is no such namespace.
        MissingDependency: There is no ROS.
        MiddlewareError: The ROS master does not answer.
    """
    if not namespace:
        from solfer.middleware.ros.caller import RosCaller

        yield RosCaller(GET_PARAMETERS)
        return
    from solfer.middleware.shared_memory.discovery import services
    from solfer.middleware.shared_memory.middleware import XbotMiddleware
    from solfer.realtime.namespaces import find

    class _LayerCaller(XbotMiddleware):
        def plugins(self) -> list[str]:
            found = (each.name for each in services(self.namespace) if each.interface == GET_INTERFACE)
            return [name.removesuffix(f"/{GET_PARAMETERS}") for name in found]

    with contextlib.closing(_LayerCaller(find(namespace), f"solfer_params_{os.getpid()}")) as made:
        yield made
