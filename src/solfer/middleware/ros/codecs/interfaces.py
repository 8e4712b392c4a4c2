"""Python classes of ROS messages and services, by their names."""

import importlib
from typing import Any

from solfer.errors import MissingDependency, UnknownName


def message_class(name: str) -> Any:
    """Import the class of the message `package/Type`.

    Raises:
        MissingDependency: The package is not there, or not built.
        UnknownName: The package has no such message.
    """
    return _find(name, "msg", "message")


def service_class(name: str) -> Any:
    """Import the class of the service type `package/Type`; it holds the classes of request and response.

    Raises:
        MissingDependency: The package is not there, or not built.
        UnknownName: The package has no such service type.
    """
    return _find(name, "srv", "service type")


def _find(name: str, kind: str, noun: str) -> type:
    package, _, type_name = name.partition("/")
    try:
        module = importlib.import_module(f"{package}.{kind}")
    except ImportError as error:
        raise MissingDependency(
            f"no Python module {package}.{kind} for {noun} {name}",
            expected=f"catkin package '{package}', built, and its workspace sourced",
        ) from error
    found = getattr(module, type_name, None)
    if found is None:
        known = [item for item in vars(module) if item[:1].isupper() and not item.endswith(("Request", "Response"))]
        raise UnknownName(f"{noun} in {package}", type_name, known)
    return found
