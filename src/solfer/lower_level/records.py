"""Records of a robot's lower level: its controllers and their default gains."""

from typing import Literal

from pydantic import Field

from solfer.config import Record
from solfer.lower_level.controller import TIMEOUT

LEASE = 0.3  # [s]
FADE = 0.5  # [s]

ALL = "all"
"""Group that every moving joint belongs to."""


class JointControllerRecord(Record):
    """A controller of joints.

    Joints of a group that do not move are left out.
    """

    type: Literal["impedance", "velocity"] = Field(description="springs and dampers, or motors that hold a speed")
    group: str = Field(default=ALL, min_length=1, description="group of the SRDF that it controls, or `all`")
    except_: str | None = Field(default=None, alias="except", min_length=1, description="group that it leaves out")
    timeout: float = Field(default=TIMEOUT, gt=0.0, description="age at which a commanded velocity becomes zero [s]")


class LowerLevelRecord(Record):
    """How the lower level defends its robot."""

    lease: float = Field(default=LEASE, gt=0.0, description="silence after which a claim on joints ends [s]")
    silence: Literal["keep", "hold", "stop", "damp"] = Field(
        default="hold", description="what happens then: keep: wheels turn on, until their controller's timeout; hold: "
        "wheels stop, positions hold; stop: hold, and the owner has to claim anew; damp: emergency stop")
    fade: float = Field(default=FADE, gt=0.0, description="time in which springs vanish in an emergency stop [s]")


class GainRecord(Record):
    """Gains of a joint under an impedance controller."""

    stiffness: float = Field(ge=0.0, description="[Nm/rad]")
    damping: float = Field(ge=0.0, description="[Nms/rad]")


class GainsRecord(Record):
    """The part of a gains file that belongs to one robot."""

    gains: dict[str, GainRecord] = Field(description="gains of each joint that an impedance controller holds")
