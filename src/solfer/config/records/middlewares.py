"""The middlewares that a configuration may choose, each with a section of its own keys."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from solfer.config.records.record import Record


class MiddlewareRecord(Record):
    """The part of a configuration for one middleware."""

    source: dict[str, Any] = Field(default_factory=dict, description="where URDF, SRDF, actuators and contacts are")
    mapping: dict[str, Any] = Field(default_factory=dict, description="maps, by name")
    feedback: dict[str, Any] = Field(default_factory=dict, description="this middleware's part of feedbacks, by pipe")
    controller: dict[str, Any] = Field(
        default_factory=dict, description="this middleware's part of controllers, by pipe"
    )


@dataclass(frozen=True)
class MiddlewareKind:
    """A middleware as a configuration knows it.

    Attributes:
        name: Value of the tag `middleware`.
        layer: Layer that it serves: RT or NRT.
        title: What it is, in words.
        map: Map of every Robot in the order in which the lower level publishes its joints; None: there is none.
        named: Whether each pipe names its topic, its message and its type; else the layer of the other end may show it.
        keys: Record of its section.
        block: Name of its section, if that is another middleware's; empty: its own.
    """

    name: str
    layer: str
    title: str
    map: str | None = None
    named: bool = True
    keys: type[Record] = MiddlewareRecord
    block: str = ""

    @property
    def section(self) -> str:
        """Name of the section of its keys."""
        return self.block or self.name.lower()


_ALL = (
    MiddlewareKind("ROS", "NRT", "ROS"),
    MiddlewareKind("XBOT", "RT", "XBotCore", map="XBOT", named=False),
    MiddlewareKind("ROS2", "NRT", "ROS 2", block="ros"),  # one word selects ROS 2 for the pipes of ROS
)
"""Registered middlewares; of each layer the first one counts where the layer alone is known."""

MIDDLEWARES = {kind.name: kind for kind in _ALL}
"""All of them, by name."""

SECTIONS = tuple(kind.section for kind in _ALL if not kind.block)
"""Names of their sections."""

PREDEFINED_MAPS = tuple(kind.map for kind in _ALL if kind.map is not None)
"""Names of the maps that they give every Robot."""

DEFAULT_MIDDLEWARE = _ALL[0].name
"""The middleware of a configuration that names none, so that its other mistakes are found."""

RT = next(kind for kind in _ALL if kind.layer == "RT")
"""The middleware of the real-time layer."""

if TYPE_CHECKING:
    MiddlewareName = str
else:
    MiddlewareName = Literal[tuple(MIDDLEWARES)]
