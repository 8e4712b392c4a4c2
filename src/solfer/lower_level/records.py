"""Records of a robot's lower level: its controllers and their default gains."""

import math
from typing import Literal

from pydantic import Field, model_validator

from solfer.config import Record
from solfer.config.records.bounds import DURATION, TIMEOUT
from solfer.lower_level.laws.controllers import CONTROLLER_TIMEOUT
from solfer.transport.messages import LARGEST_GAIN

LEASE = 0.3  # [s]
RECORD_FADE = 0.5  # [s]
TILT_LIMIT = 1.0472
TILT_DURATION = 0.5  # 60 degrees [rad], [s]
OVERSPEED = 2.0
OVERSPEED_TIME = 0.05  # [s]

RATION_MESSAGES, RATION_BYTES = 10_000, 2**24
"""Largest numbers of a ration: of messages, and of bytes."""

ALL = "all"
"""Group that every moving joint belongs to."""


class JointControllerRecord(Record):
    """A controller of joints.

    Joints of a group that do not move, or have no drive, are left out.
    """

    type: Literal["impedance", "velocity"] = Field(description="springs and dampers, or motors that hold a speed")
    group: str = Field(default=ALL, min_length=1, description="group of the SRDF that it controls, or `all`")
    except_: str | None = Field(default=None, alias="except", min_length=1, description="group that it leaves out")
    timeout: float = Field(
        default=CONTROLLER_TIMEOUT, **TIMEOUT, description="age at which a commanded velocity becomes zero [s]"
    )


class RationRecord(Record):
    """Limits of what senders may cost a cycle of the lower level. Messages beyond wait; oversized ones are dropped."""

    owners: int = Field(
        default=16,
        ge=1,
        le=RATION_MESSAGES,
        description="commands of a controller in a cycle from senders that have a lease; they come first",
    )
    others: int = Field(default=2, ge=1, le=RATION_MESSAGES, description="the same from all other senders")
    requests: int = Field(
        default=2, ge=1, le=RATION_MESSAGES, description="requests in a cycle; an emergency stop needs none"
    )
    waiting: int = Field(
        default=64, ge=1, le=RATION_MESSAGES, description="commands of one sender, and requests, that may wait"
    )
    command: int | None = Field(
        default=None,
        ge=64,
        le=RATION_BYTES,
        description="bytes of a command (default: twice those of one for all joints of the controller, and 1024)",
    )
    request: int | None = Field(
        default=None,
        ge=64,
        le=RATION_BYTES,
        description="bytes of a request (default: twice those of the names of all joints, and 4096)",
    )


class LowerLevelRecord(Record):
    """Settings of the lower level's defences of its robot."""

    lease: float = Field(
        default=LEASE, **TIMEOUT, description="time without a command after which a claim on joints ends [s]"
    )
    silence: Literal["keep", "hold", "stop", "damp"] = Field(
        default="hold",
        description="action then: keep: wheels turn on, until their controller's timeout; hold: wheels stop, "
        "positions hold; stop: hold, and senders without a claim have to claim, too; damp: emergency stop",
    )
    fade: float = Field(
        default=RECORD_FADE, ge=1e-3, le=60.0, description="time in which springs vanish in an emergency stop [s]"
    )
    tilt: float = Field(
        default=TILT_LIMIT,
        ge=0.0,
        lt=math.pi,
        description="tilt of a floating base against the vertical "
        "beyond which the robot has fallen, and holds [rad]; 0: no tilt is too large",
    )
    tilt_time: float = Field(default=TILT_DURATION, **DURATION, description="how long it has to be tilted so far [s]")
    overspeed: float = Field(
        default=OVERSPEED,
        ge=0.0,
        le=100.0,
        description="multiple of its speed limit beyond which a joint "
        "is out of control, and the robot holds, 1 or more; 0: no speed is too large",
    )
    overspeed_time: float = Field(
        default=OVERSPEED_TIME, **DURATION, description="how long a joint has to be so fast [s]"
    )
    gains_folders: tuple[str, ...] = Field(
        default=(),
        description="folders, beside this file's own, from which `load_gains` may read; relative to "
        "this file, or package://...",
    )
    ration: RationRecord = Field(default_factory=RationRecord, description="limits of what senders may cost a cycle")

    @model_validator(mode="after")
    def _beyond_the_limit(self) -> "LowerLevelRecord":
        if 0.0 < self.overspeed < 1.0:
            raise ValueError(
                f"'overspeed' is {self.overspeed:g}: joints may move at their speed limit; expected 1 or "
                "more, or 0 for no such bound"
            )
        return self


class GainRecord(Record):
    """Gains of a joint under an impedance controller."""

    stiffness: float = Field(ge=0.0, le=LARGEST_GAIN, description="[Nm/rad]")
    damping: float = Field(ge=0.0, le=LARGEST_GAIN, description="[Nms/rad]")


class GainsRecord(Record):
    """The part of a gains file that belongs to one robot."""

    gains: dict[str, GainRecord] = Field(description="gains of each joint that an impedance controller holds")
