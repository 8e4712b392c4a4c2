"""What a running plugin tells about itself."""

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from solfer.components import Service
from solfer.config import Configuration


@dataclass(frozen=True)
class GetConfig:
    """Asks for the configuration; `origins`: each line ends with the place that its value is from."""

    origins: bool = True


@dataclass(frozen=True)
class ConfigReply:
    """The effective configuration as `yaml`."""

    success: bool = True
    message: str = ""
    yaml: str = ""


def configuration_service(configuration: Configuration) -> Service:
    """The service `<plugin>/get_config`. The texts are made here, so that no cycle waits for them."""
    texts = {origins: configuration.text(origins) for origins in (True, False)}
    return Service(
        "get_config", "solfer/GetConfig", GetConfig, ConfigReply,
        lambda request: ConfigReply(yaml=texts[bool(request.origins)]),
    )  # fmt: skip


def answer_at_once(call: Callable[[], Any]) -> Future:
    """Carry out a call that touches nothing of the cycle: it is answered also by a plugin that waits or holds."""
    future: Future = Future()
    future.set_result(call())
    return future
