"""Messages between a plugin and the lower level: claims on joints, and refused commands."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from solfer.interfaces.declaration import Service

CLAIM_INTERFACE = "solfer/ClaimJoints"
"""Interface of `lower_level/claim`."""

RELEASE = "solfer/ReleaseJoints"
"""Interface of `lower_level/release`."""

LOAD_GAINS = "solfer/LoadGains"
"""Interface of `<controller>/load_gains`."""

SWITCH_FEED_FORWARD = "std_srvs/SetBool"
"""Interface of `<controller>/set_ff_torque`."""

LOWER_LEVEL = "lower_level"
"""Owner of these services."""

REFUSALS_TOPIC = f"{LOWER_LEVEL}/refusals"
"""Topic on which the lower level publishes the senders of refused commands."""

ALL_OWNERS = "*"
"""Owner in a refusal of the commands of all plugins: the robot was put into another state, and earlier commands and
requests have no meaning any more."""

TOPIC = "topic "
"""Prefix of an owner in a refusal that names a topic: the plugin that follows the topic begins again, and so must the
plugin that publishes it."""


SEPARATOR = "#"
"""Between a node and one of its components in the name of a claimant; no node has it in its own name."""


@functools.lru_cache(256)
def claimant(node: str, component: str) -> str:
    """Return the name of the claimant that commands: a component of a node, such as '/shared#joint_states'.

    The component that has the name of its node, as the only one of a node usually has, is the node itself; so is
    who names no component, such as a tool.
    """
    if not component or component == node.rpartition("/")[2]:
        return node
    return f"{node}{SEPARATOR}{component}"


def node_of(claimant: str) -> str:
    """Return the node of a claimant: the sender of its commands."""
    return claimant.partition(SEPARATOR)[0]


@dataclass(frozen=True)
class ClaimRequest:
    """The joints that a plugin is going to command; granted whole or not at all.

    Attributes:
        owner: Who sends the commands to come, see `claimant`.
        controllers: Controllers of the lower level, one for each of `modes`.
        modes: Field of a command (`position`, `velocity`, `effort`, `stiffness`, `damping`) that is claimed of the
            controller at the same place; empty: every field that the controllers accept.
        joints: The joints of those controllers that are claimed; empty: all of them.
        positions: Where the owner measures each of `joints` [rad, m], NaN: it does not; empty: it measures none.
        follows: Topics of other plugins that the commands follow. Their publishers are informed when the owner begins
            again: the robot has held meanwhile, so what was asked of them before is not desired any more.
    """

    owner: str
    controllers: tuple[str, ...]
    modes: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()
    follows: tuple[str, ...] = ()
    positions: tuple[float, ...] = ()


@dataclass(frozen=True)
class ReleaseRequest:
    """Request to end all claims of `owner`."""

    owner: str


@dataclass(frozen=True)
class FileRequest:
    """A file on the machine of the lower level."""

    file: str


@dataclass(frozen=True)
class Answer:
    """Whether a request succeeded, and if not why."""

    success: bool = True
    message: str = ""


@dataclass(frozen=True)
class ClaimAnswer:
    """Whether a claim is granted, and if not why.

    Attributes:
        again: The owner had commanded before: the publishers of the topics that it follows have to begin again.
        later: The refusal is temporary: no other plugin commands these joints at present.
    """

    success: bool = True
    message: str = ""
    again: bool = False
    later: bool = False


def answered_service(name: str, interface: str, request: type, work: Callable[[Any], None], **options: Any) -> Service:
    """Declare a service that does `work` with a request and answers with success; `options` are further attributes."""

    def handler(request: Any) -> Answer:
        work(request)
        return Answer()

    return Service(name, interface, request, reply=Answer, handler=handler, **options)
