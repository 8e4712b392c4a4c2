"""Records of a robot's sensors, made of those of the kinds: how often and how well they measure."""

import importlib
import pkgutil
from typing import Any

from pydantic import Field, create_model

from solfer.config import Record
from solfer.config.records.bounds import SEED
from solfer.simulation.sensors import kinds
from solfer.simulation.sensors.sensor import Sensor


def _kinds() -> tuple[type[Sensor], ...]:
    """Find the sensors in the modules of `kinds`."""
    names = [found.name for found in pkgutil.iter_modules(kinds.__path__)]
    modules = [importlib.import_module(f"{kinds.__name__}.{name}") for name in names]
    members = ((module, member) for module in modules for member in vars(module).values())
    return tuple(
        member
        for module, member in members
        if isinstance(member, type) and issubclass(member, Sensor) and member.__module__ == module.__name__
    )


KINDS = _kinds()
"""All kinds of sensors, in alphabetical order of their modules."""

_rates: dict[str, Any] = {  # at most that of the steps
    kind.name: (float, Field(default=kind.rate, ge=0.01, le=1000.0, description=kind.what)) for kind in KINDS
}
_tags: dict[str, Any] = {name: field for kind in KINDS for name, field in kind.tags.items()}
_RatesOfKinds: Any = create_model("_RatesOfKinds", __base__=Record, **_rates)
_TagsOfKinds: Any = create_model("_TagsOfKinds", __base__=Record, **_tags)


class Rates(_RatesOfKinds):
    """Rates of publication in simulated time [Hz]; each is the rate of the steps divided by a whole number."""


class SensorsRecord(_TagsOfKinds):
    """Sensors of a robot."""

    seed: int = Field(default=0, **SEED, description="seed of all noise; equal seeds give equal noise")
    delay: float = Field(
        default=0.0, ge=0.0, le=0.1, description="time from a measurement to its message; whole steps of 1 ms [s]"
    )
    rates: Rates = Field(default_factory=Rates, description="rates of publication")

    def scaled(self, factor: float) -> "SensorsRecord":
        """Return sensors with the errors of gyroscope, accelerometer and joints so many times as large."""
        tags: Any = self  # of the kinds
        changes: dict[str, Record] = {"joint_noise": _scaled(tags.joint_noise, factor)}
        imu = tags.imu
        if imu is not None:
            errors = {name: _scaled(getattr(imu, name), factor) for name in ("gyroscope", "accelerometer")}
            changes["imu"] = imu.model_copy(update=errors)
        return self.model_copy(update=changes)

    def perfect(self) -> "SensorsRecord":
        """Return sensors that measure without errors and without delay, at the same rates."""
        tags = {name: tag.model_copy(update={"exact": True}) for name, tag in self if hasattr(tag, "exact")}
        return self.model_copy(update=tags | {"delay": 0.0})


def _scaled(errors: Record, factor: float) -> Record:
    """Return a record of errors, each so many times as large; what is a step or a switch stays."""
    changes = {name: factor * value for name, value in errors if isinstance(value, float) and name != "resolution"}
    return errors.model_copy(update=changes)
