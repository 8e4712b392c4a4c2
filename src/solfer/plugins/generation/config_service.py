"""The service that returns the configuration of a running plugin."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from solfer.config import Configuration
from solfer.errors import SolferError
from solfer.interfaces.declaration import Service


@dataclass(frozen=True)
class GetConfig:
    """Request of the configuration; `origins`: each line ends with the place that its value is from."""

    origins: bool = True


@dataclass(frozen=True)
class ConfigReply:
    """The effective configuration as `yaml`."""

    success: bool = True
    message: str = ""
    yaml: str = ""


def configuration_service(configuration: Configuration) -> Service:
    """Make the service `<plugin>/get_config`. The texts are made here, so that no cycle waits for them."""
    texts = {origins: configuration.text(origins) for origins in (True, False)}
    return Service(
        "get_config", "solfer/GetConfig", GetConfig, reply=ConfigReply,
        handler=lambda request: ConfigReply(yaml=texts[bool(request.origins)]),
    )  # fmt: skip


def answer_at_once(call: Callable[[], Any]) -> Future:
    """Run a call that touches nothing of the cycle at once: also a plugin that waits or holds answers it."""
    future: Future = Future()
    try:
        future.set_result(call())
    except SolferError as error:
        future.set_exception(error)
    return future
