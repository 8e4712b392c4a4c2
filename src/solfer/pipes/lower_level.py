"""Services with which a plugin and the lower level agree on who commands which joints."""

from dataclasses import dataclass

CLAIM = "solfer/ClaimJoints"
"""Interface of `lower_level/claim`."""

RELEASE = "solfer/ReleaseJoints"
"""Interface of `lower_level/release`."""

LOWER_LEVEL = "lower_level"
"""Owner of these services."""


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
