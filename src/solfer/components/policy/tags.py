"""Tags of the component `policy`."""

from typing import Annotated, Literal, get_args

from pydantic import AfterValidator, Field

from solfer.config import ComparedWith, NameOf, Record
from solfer.config.records.bounds import RATE, Name

Number = Annotated[float, Field(ge=-1e5, le=1e5), ComparedWith("nothing")]
"""A number of which the network alone decides what it means."""

PerJoint = Number | Annotated[tuple[Number, ...], Field(min_length=1)] | dict[str, Number]
"""One number for all joints, a list in their order, or a map by their names."""

Term = Literal[
    "angular_velocity",
    "projected_gravity",
    "linear_velocity",
    "commands",
    "joint_position",
    "joint_velocity",
    "last_action",
    "phase",
]
"""What a network can observe."""

TERMS: tuple[str, ...] = get_args(Term)
"""All terms, in the order in which they are gathered."""

ACTIONS = Literal["position", "velocity", "torque"]
"""What the actions of a network can be."""


def _ordered(range_: tuple[float, float]) -> tuple[float, float]:
    if range_[0] > range_[1]:
        raise ValueError(f"the range begins at {range_[0]:g} and ends at {range_[1]:g}; expected the smaller one first")
    return range_


class ObservationRecord(Record):
    """A term of the observations: (number * scale), clipped, the oldest first where it has a history."""

    term: Term = Field(description="what is observed; joints in the order of `joints`")
    pick: tuple[Annotated[int, Field(ge=0, le=1000)], ...] | None = Field(
        None, min_length=1, description="which of its numbers, from zero on, in this order; left out: all"
    )
    scale: Number | Annotated[tuple[Number, ...], Field(min_length=1)] = Field(
        1.0, description="factor of the numbers: one, or one for each of them"
    )
    clip: float = Field(100.0, gt=0.0, le=1e9, description="largest amount of a scaled number")
    history: int = Field(1, ge=1, le=100, description="how many steps of the policy are observed, the present one last")
    period: Annotated[float, ComparedWith("nothing")] = Field(
        1.0, ge=0.01, le=100.0, description="`phase`: period of the gait [s]"
    )
    offsets: tuple[Annotated[float, Field(ge=-1.0, le=1.0)], ...] = Field(
        (0.0,),
        min_length=1,
        description="`phase`: parts of the period by which its sines, and then its cosines, are ahead",
    )
    rest: Annotated[float, Field(ge=0.0, le=1.0)] | None = Field(
        None,
        description="`phase`: part of the period at which it stays while the commanded velocity is below 0.01 m/s and "
        "0.01 rad/s, after which it begins from its offsets; left out: it goes on",
    )


class ActionRecord(Record):
    """What the network's actions are."""

    kind: ACTIONS = Field(
        "position", description="positions relative to `default` [rad, m], velocities [rad/s, m/s] or torques [Nm, N]"
    )
    springs: Literal["lower_level", "plugin"] = Field(
        "lower_level",
        description="what pulls joints to positions: the lower level, which moves its targets smoothly, or "
        "torques of the plugin in each of its cycles, beside the lower level's damping",
    )
    scale: PerJoint | None = Field(None, description="factor of the actions; left out: the file's, or 1")
    clip: float = Field(
        100.0, gt=0.0, le=1e9, description="largest amount of an action before its scale; `last_action` is clipped, too"
    )
    lower: PerJoint | None = Field(None, description="smallest of what the actions become; left out: no bound")
    upper: PerJoint | None = Field(None, description="largest of what the actions become; left out: no bound")


Range = Annotated[tuple[Number, Number], AfterValidator(_ordered)]
"""A smallest and a largest number."""


class CommandRangeRecord(Record):
    """Bounds of the commanded velocity of the base."""

    x: Range = Field((-1e5, 1e5), description="ahead [m/s]")
    y: Range = Field((-1e5, 1e5), description="to the left [m/s]")
    yaw: Range = Field((-1e5, 1e5), description="yaw rate [rad/s]")


class PolicyGainsRecord(Record):
    """Stiffness and damping that belong to the network."""

    stiffness: PerJoint | None = Field(None, description="stiffness [Nm/rad, N/m]; left out: the file's")
    damping: PerJoint | None = Field(None, description="damping [Nms/rad, Ns/m]; left out: the file's")


class PolicyTags(Record):
    """Tags of the component `policy`; what they leave out, the metadata of the file may have."""

    file: Name = Field(description="network: an ONNX file, relative to the file that names it")
    contract: Name | None = Field(
        None,
        description="contract that was exported with the network: `deploy.yaml` of unitree_rl_lab, IO descriptors of "
        "Isaac Lab, or `config.yaml` of rl_sar; tags take precedence over it, and it over the metadata of `file`",
    )
    motors: tuple[Annotated[str, NameOf("joint")], ...] | None = Field(
        None,
        min_length=1,
        description="names of the joints in the order of the motors that `joint_ids_map` of a `deploy.yaml` counts",
    )
    joints: tuple[Annotated[str, NameOf("joint")], ...] | None = Field(
        None, min_length=1, description="names of the joints in the network's order; left out: the file's"
    )
    default: PerJoint | None = Field(None, description="default pose of the joints [rad, m]; left out: the file's")
    observations: tuple[ObservationRecord, ...] | None = Field(
        None, min_length=1, description="terms of the observations in the network's order; left out: the file's"
    )
    history_order: Literal["terms", "oldest_step_first", "newest_step_first"] = Field(
        "terms",
        description="order of histories: `terms`: all steps of a term, the oldest first, before the next term; "
        "otherwise all terms of a step before the next step",
    )
    action: ActionRecord = Field(ActionRecord(), description="what the network's actions are")
    command_range: CommandRangeRecord | None = Field(
        None, description="bounds of the commanded velocity; left out: the file's, or none"
    )
    gains: PolicyGainsRecord = Field(
        PolicyGainsRecord(), description="gains of the joints; those that neither has are the lower level's"
    )
    rate: Annotated[float, ComparedWith("nothing")] = Field(
        50.0, **RATE, description="rate of the network, at most that of the plugin; commands hold in between [Hz]"
    )
    start_tolerance: Annotated[float, ComparedWith("nothing")] = Field(
        0.5, gt=0.0, le=100.0, description="how far joints may be from the default pose at a start [rad, m]"
    )
    largest_tilt: Annotated[float, ComparedWith("nothing")] = Field(
        0.8, gt=0.0, le=3.2, description="tilt of the base beyond which the robot is held [rad]"
    )
