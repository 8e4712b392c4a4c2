"""Calls services as a program that is no node."""

from typing import Any

import rospy

from solfer.middleware.ros.calls import alive, call, provider, replied
from solfer.middleware.ros.node.master import call_master


class RosCaller:
    """Calls services of plugins.

    Args:
        service: Name of the service, behind that of the plugin, which plugins are listed by.

    Raises:
        MiddlewareError: The ROS master does not answer.
    """

    def __init__(self, service: str):
        _, _, services = call_master("getSystemState")
        self._names = [name for name, _ in services if name.endswith(f"/{service}")]
        self._service = service

    def plugins(self) -> list[str]:
        """List the plugins whose nodes live."""
        uris = ((name, provider(name)) for name in self._names)
        living = (name for name, uri in uris if uri is not None and alive(name, uri))
        return [name.removesuffix(f"/{self._service}").lstrip("/") for name in living]

    def call(self, name: str, interface: str, request: Any, reply: type, timeout: float) -> Any:
        """See `Middleware.call`; relative names are those of no namespace."""
        return replied(
            call(f"/{name}", interface, request, timeout=timeout, running=lambda: not rospy.is_shutdown()), reply
        )
