"""Series elastic actuators: the springs between a robot's motors and its joints."""

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
    """

    stiffness: float
    damping: float
    motor_damping: float
    motor_inertia: float
    torque_limit: float


class ActuatorRecord(Record):
    """An actuator in a file; damping and inertia of the motor stand at its own shaft or at the joint."""

    type: Literal["SEA"] = Field(description="`SEA`: series elastic")
    Ks: float = Field(ge=1e-3, le=1e5, description="stiffness of the spring [Nm/rad]")
    D: float = Field(**_DAMPING, description="damping of the spring [Nms/rad]")
    B: float | None = Field(default=None, **_DAMPING, description="damping of the motor at the joint [Nms/rad]")
    Bm: float | None = Field(default=None, **_DAMPING, description="damping of the motor at its own shaft [Nms/rad]")
    phi: float | None = Field(default=None, **_INERTIA, description="inertia of the rotor at the joint [kg m^2]")
    phim: float | None = Field(default=None, **_INERTIA, description="inertia of the rotor at its own shaft [kg m^2]")
    nu: float | None = Field(default=None, ge=1e-3, le=1e5, description="ratio of the gear")
    Torque_limit: float = Field(ge=1e-3, le=1e5, description="largest torque [Nm]")

    @model_validator(mode="after")
    def _complete(self) -> "ActuatorRecord":
        for joint_side, motor_side in (("B", "Bm"), ("phi", "phim")):
            given = [key for key in (joint_side, motor_side) if getattr(self, key) is not None]
            if len(given) != 1:
                raise ValueError(
                    f"expected either '{joint_side}' or '{motor_side}', got {' and '.join(given) or 'none'}"
                )
            if given == [motor_side] and self.nu is None:
                raise ValueError(f"'{motor_side}' needs the ratio 'nu' of the gear")
        return self

    def actuator(self) -> SeriesElastic:
        """Return the actuator as seen at the joint: motor values are multiplied with the square of the gear's ratio."""
        return SeriesElastic(
            stiffness=self.Ks,
            damping=self.D,
            motor_damping=self.B if self.Bm is None else self.Bm * self.nu**2,
            motor_inertia=self.phi if self.phim is None else self.phim * self.nu**2,
            torque_limit=self.Torque_limit,
        )


class ActuatorsRecord(Record):
    """Actuators by the joint that they move."""

    actuators: dict[str, ActuatorRecord] = Field(default_factory=dict, description="actuators, by joint")


class Actuators:
    """The actuators of a robot.

    Args:
        dofs: Names of the robot's DoFs.
        table: Actuators by DoF; a DoF may have none.

    Attributes:
        dofs: Names of the robot's DoFs.
        names: Names of the DoFs with an actuator, in the robot's order.
        stiffness: [Nm/rad], shape (n,), zero without an actuator, as in all following arrays.
        damping: [Nms/rad], shape (n,).
        motor_damping: [Nms/rad], shape (n,).
        motor_inertia: [kg m^2], shape (n,).
        torque_limit: [Nm], shape (n,).

    Raises:
        UnknownName: The table names a DoF that the robot does not have.
    """

    def __init__(self, dofs: Sequence[str], table: Mapping[str, SeriesElastic] | None = None):
        self.dofs, self._table = tuple(dofs), dict(table or {})
        raise_all([UnknownName("joint", name, self.dofs) for name in self._table if name not in self.dofs])
        self.names = tuple(name for name in self.dofs if name in self._table)
        self.stiffness, self.damping = self._array("stiffness"), self._array("damping")
        self.motor_damping, self.motor_inertia = self._array("motor_damping"), self._array("motor_inertia")
        self.torque_limit = self._array("torque_limit")

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

    def _array(self, attribute: str) -> np.ndarray:
        return np.array([getattr(self._table[name], attribute) if name in self._table else 0.0 for name in self.dofs])

    def __getitem__(self, joint: str) -> SeriesElastic | None:
        if joint not in self.dofs:
            raise UnknownName("joint", joint, self.dofs)
        return self._table.get(joint)

    def __len__(self) -> int:
        return len(self.names)

    def __repr__(self) -> str:
        return f"Actuators({len(self)} of {len(self.dofs)} DoFs)"
