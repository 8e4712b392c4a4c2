"""Contacts that are lifted: the service `lift` of components that carry the robot."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LiftContacts:
    """Which contacts carry the robot.

    Attributes:
        contacts: Names of contacts; empty: all that are tracked.
        lifted: Whether they carry nothing from now on; else they carry again.
    """

    contacts: tuple[str, ...] = ()
    lifted: bool = True


@dataclass(frozen=True)
class LiftReply:
    """Answer to `LiftContacts`: whether it is carried out, and why not."""

    success: bool = True
    message: str = ""
