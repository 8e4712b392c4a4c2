"""What several tests of joint pipes share."""

import numpy as np
from scipy import signal
from support.unit.cart import URDF

from solfer.config.kinds.table import record_of
from solfer.config.records.pipes import ControllerRecord, FeedbackRecord
from solfer.model import BidirectionalMap, Description, Kinematics, Semantics
from solfer.robot import Robot

RATE = 200.0
SRDF = '<robot name="cart"><group name="front"><joint name="free"/><joint name="shoulder"/></group></robot>'


def make_robot():
    description = Description.from_text(URDF)
    robot = Robot(Kinematics(description), Semantics.from_text(SRDF, description))
    robot.maps.add(BidirectionalMap("LIMBS", robot.dofs, ("roll", "shoulder", "nose")))
    return robot


def dofs(**changes):
    return {"chain": "all", "type": "all", "mapping": "RBDL"} | changes


def received(**changes):
    """Make the record of a feedback on the topic `joints`."""
    record = {
        "name": "pipe",
        "space": "JOINT",
        "dofs": dofs(),
        "interface": {"position": True},
        "function": "reference",
        "source": "joints",
        "message": "custom_messages::CustomCmnd",
    } | changes
    return record_of(FeedbackRecord, record["space"]).model_validate(record)


def published(**changes):
    """Make the record of a controller on the topic `joints`."""
    return record_of(ControllerRecord, changes.get("space")).model_validate(
        {"name": "pipe", "type": "reference", "dofs": dofs(), "interface": {"position": True}, "sink": "joints"}
        | changes
    )


def low_passed(values, frequency, damping):
    """SciPy's filter, started at the first value."""
    bent = 2.0 * RATE * np.tan(np.pi * frequency / RATE)
    numerator, denominator = signal.bilinear([bent**2], [1.0, 2.0 * damping * bent, bent**2], RATE)
    start = signal.lfilter_zi(numerator, denominator) * values[0]
    return signal.lfilter(numerator, denominator, values, zi=start)[0]


FILTER = {"frequency": 20.0, "damping": 0.8}
