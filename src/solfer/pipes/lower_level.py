"""What a plugin and the lower level say to each other: who commands which joints, and whose commands are refused."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

CLAIM = "solfer/ClaimJoints"
"""Interface of `lower_level/claim`."""

RELEASE = "solfer/ReleaseJoints"
"""Interface of `lower_level/release`."""

LOWER_LEVEL = "lower_level"
"""Owner of these services."""

REFUSED = f"{LOWER_LEVEL}/refusals"
"""Topic on which the lower level says whose commands it refuses."""

EVERYBODY = "*"
"""Owner in a refusal that is about all commands, and about everybody who moves parts of the robot: it was put into
another state, and what was wanted before has no meaning any more."""


@dataclass(frozen=True)
class ClaimRequest:
    """What somebody is going to command; granted whole or not at all.

    Attributes:
        owner: Who claims: the sender of the commands to come.
        controllers: Controllers of the lower level, one for each of `modes`.
        modes: Field of a command (`position`, `velocity`, `effort`, `stiffness`, `damping`) that is claimed of the
            controller at the same place; empty: every one that the controllers take.
        joints: The joints of those controllers that are claimed; empty: all of them.
    """

    owner: str
    controllers: tuple[str, ...]
    modes: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReleaseRequest:
    """Ends all claims of `owner`."""

    owner: str


@dataclass(frozen=True)
class Answer:
    """Whether a request was carried out, and if not why."""

    success: bool = True
    message: str = ""


@dataclass(frozen=True)
class ClaimAnswer:
    """Whether a claim is granted, and if not why.

    Attributes:
        later: It is refused for the time being only: nobody commands these joints at present.
    """

    success: bool = True
    message: str = ""
    later: bool = False


def answered(work: Callable[[Any], None]) -> Callable[[Any], Answer]:
    """A handler that does `work` with a request and says that it is done."""

    def handler(request: Any) -> Answer:
        work(request)
        return Answer()

    return handler
