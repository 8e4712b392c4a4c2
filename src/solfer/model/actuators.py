"""Actuators: which joints have a drive, and the springs between motors and joints."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, model_validator

from solfer.config import Record, read
from solfer.config.records.bounds import Bounds
from solfer.errors import SolferError, UnknownName, raise_all

_DAMPING: Bounds = {"ge": 0.0, "le": 1e5}
_INERTIA: Bounds = {"ge": 0.0, "le": 1e4}


@dataclass(frozen=True)
class SeriesElastic:
    """A motor behind a gear, and a spring and a damper between the gear and the joint; all as seen at the joint.

    Attributes:
        stiffness: Stiffness of the spring [Nm/rad].
        damping: Damping of the spring [Nms/rad].
        motor_damping: Damping of the motor [Nms/rad].
        motor_inertia: Inertia of the rotor [kg m^2].
        torque_limit: Largest torque [Nm].
        reflected: Whether the rotor counts in the inertia of the robot's model.
    """

    stiffness: float
    damping: float
    motor_damping: float
    motor_inertia: float
    torque_limit: float
    reflected: bool = False


class ActuatorRecord(Record):
    """An actuator in a file; damping and inertia of the motor stand at its own shaft or at the joint.

    A series elastic one has stiffness, damping and inertia, and a limit; a joint without a drive has nothing else.
    """

    type: Literal["SEA", "UNACTUATED"] = Field(
        description="`SEA`: series elastic; `UNACTUATED`: the joint moves freely, like one that the file does not list"
    )
    Ks: float | None = Field(default=None, ge=1e-3, le=1e5, description="stiffness of the spring [Nm/rad]")
    D: float | None = Field(default=None, **_DAMPING, description="damping of the spring [Nms/rad]")
    B: float | None = Field(default=None, **_DAMPING, description="damping of the motor at the joint [Nms/rad]")
    Bm: float | None = Field(default=None, **_DAMPING, description="damping of the motor at its own shaft [Nms/rad]")
    phi: float | None = Field(default=None, **_INERTIA, description="inertia of the rotor at the joint [kg m^2]")
    phim: float | None = Field(default=None, **_INERTIA, description="inertia of the rotor at its own shaft [kg m^2]")
    nu: float | None = Field(default=None, ge=1e-3, le=1e5, description="ratio of the gear")
    Torque_limit: float | None = Field(
        default=None,
        ge=1e-3,
        le=1e5,
        description="largest torque [Nm]; it bounds efforts beside the limit of the URDF, the lower of the two counts",
    )
    reflect_inertia: bool | None = Field(
        default=None,
        description="whether the inertia of the rotor counts in the inertia matrix of the Robot; not, if left out: "
        "behind a spring the rotor moves on its own",
    )

    @model_validator(mode="after")
    def _complete(self) -> "ActuatorRecord":
        given = [key for key in type(self).model_fields if key != "type" and getattr(self, key) is not None]
        if self.type == "UNACTUATED":
            if given:
                raise ValueError(f"an UNACTUATED joint with '{given[0]}'; expected nothing but the type")
            return self
        for key in ("Ks", "D", "Torque_limit"):
            if key not in given:
                raise ValueError(f"key '{key}' is missing; a series elastic actuator has it")
        for joint_side, motor_side in (("B", "Bm"), ("phi", "phim")):
            given = [key for key in (joint_side, motor_side) if getattr(self, key) is not None]
            if len(given) != 1:
                raise ValueError(
                    f"expected either '{joint_side}' or '{motor_side}', got {' and '.join(given) or 'none'}"
                )
            if given == [motor_side] and self.nu is None:
                raise ValueError(f"'{motor_side}' needs the ratio 'nu' of the gear")
        return self

    def actuator(self) -> SeriesElastic | None:
        """Return the actuator as seen at the joint: motor values are multiplied with the square of the gear's ratio.

        None: there is no drive.
        """
        if self.type == "UNACTUATED":
            return None
        return SeriesElastic(
            stiffness=self.Ks,
            damping=self.D,
            motor_damping=self.B if self.Bm is None else self.Bm * self.nu**2,
            motor_inertia=self.phi if self.phim is None else self.phim * self.nu**2,
            torque_limit=self.Torque_limit,
            reflected=bool(self.reflect_inertia),
        )


class ActuatorsRecord(Record):
    """Actuators by the joint that they move."""

    actuators: dict[str, ActuatorRecord] = Field(default_factory=dict, description="actuators, by joint")


class Actuators:
    """The actuators of a robot.

    Args:
        dofs: Names of the robot's DoFs.
        table: Actuators by DoF; one that it lacks, or that has None, has no drive. Without a table nothing is known of
            the drives, and every DoF has one.
        passive: DoFs that have no drive in any case, such as those of a floating base.

    Attributes:
        dofs: Names of the robot's DoFs.
        driven: Whether there is a drive: the actuation state, shape (n,).
        types: Type of each DoF: `SEA`, `UNACTUATED`, or `RIGID` for a drive of which nothing is known.
        names: Names of the DoFs with an actuator, in the robot's order.
        stiffness: [Nm/rad], shape (n,), zero without an actuator, as in all following arrays.
        damping: [Nms/rad], shape (n,).
        motor_damping: [Nms/rad], shape (n,).
        motor_inertia: [kg m^2], shape (n,).
        torque_limit: [Nm], shape (n,).
        reflected_inertia: Inertia of the rotors that count in the robot's inertia matrix [kg m^2], shape (n,).

    Raises:
        UnknownName: The table names a DoF that the robot does not have.
    """

    def __init__(
        self,
        dofs: Sequence[str],
        table: Mapping[str, SeriesElastic | None] | None = None,
        passive: Collection[str] = (),
    ):
        raise_all([UnknownName("joint", name, dofs) for name in table or () if name not in dofs])
        self.dofs = tuple(dofs)
        self._table = {name: one for name, one in (table or {}).items() if one is not None}
        known = self.dofs if table is None else self._table
        self.driven = np.array([name in known and name not in passive for name in self.dofs], dtype=bool)
        self.types = tuple(map(self._type, self.dofs, self.driven))
        self.names = tuple(name for name in self.dofs if name in self._table)
        self.stiffness, self.damping = self._array("stiffness"), self._array("damping")
        self.motor_damping, self.motor_inertia = self._array("motor_damping"), self._array("motor_inertia")
        self.torque_limit = self._array("torque_limit")
        self.reflected_inertia = self.motor_inertia * self._array("reflected")

    @classmethod
    def from_file(
        cls, path: str | Path, robot: str, dofs: Sequence[str], elsewhere: Collection[str] = ()
    ) -> "Actuators":
        """Read the actuators of the robot called `robot`, `<robot>.actuators.<joint>` in a YAML file.

        Args:
            path: The file.
            robot: Key of the robot in the file.
            dofs: Names of the robot's DoFs.
            elsewhere: Joints of other models of the robot; their actuators are left out.

        Raises:
            ConfigError: The file is missing, or a value does not fit.
            UnknownName: The file names a joint that exists nowhere.
            SolferErrors: Several of these.
        """
        return cls.from_record(read(path, ActuatorsRecord, root=(robot,)), dofs, elsewhere)

    @classmethod
    def from_record(cls, record: ActuatorsRecord, dofs: Sequence[str], elsewhere: Collection[str] = ()) -> "Actuators":
        """Build the actuators of a record; see `from_file`."""
        faults: list[SolferError] = [
            UnknownName("joint", joint, dofs, where=record.where("actuators", joint))
            for joint in record.actuators
            if joint not in dofs and joint not in elsewhere
        ]
        raise_all(faults)
        return cls(dofs, {joint: one.actuator() for joint, one in record.actuators.items() if joint in dofs})

    @property
    def passive(self) -> tuple[str, ...]:
        """Names of the DoFs without a drive."""
        return tuple(name for name, driven in zip(self.dofs, self.driven, strict=True) if not driven)

    def bound(self, effort: np.ndarray) -> np.ndarray:
        """Return the lower of limits of effort and those of the actuators, shape (n,) [Nm]."""
        return np.where(self.torque_limit > 0.0, np.minimum(effort, self.torque_limit), effort)

    def _type(self, name: str, driven: bool) -> str:
        if not driven:
            return "UNACTUATED"
        return "SEA" if name in self._table else "RIGID"

    def _array(self, attribute: str) -> np.ndarray:
        return np.array([getattr(self._table[name], attribute) if name in self._table else 0.0 for name in self.dofs])

    def __getitem__(self, joint: str) -> SeriesElastic | None:
        if joint not in self.dofs:
            raise UnknownName("joint", joint, self.dofs)
        return self._table.get(joint)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Actuators)
            and (self.dofs, self.types) == (other.dofs, other.types)
            and self._table == other._table
        )

    __hash__ = None  # it is compared, and no key

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        return f"Actuators({len(self)} of {len(self.dofs)} DoFs)"
