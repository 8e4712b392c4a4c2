"""All sensors of a simulated robot."""

from collections.abc import Iterator, Mapping
from typing import Any

from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.records import KINDS
from solfer.simulation.sensors.sensor import Sensor
from solfer.simulation.state import SimulationState


class Sensors(Mapping[str, Any]):
    """The sensors of a simulated robot, by the names of their kinds.

    Args:
        state: What the robot does.
        equipment: What it measures with.

    Attributes:
        rates: Rates of publication.
        record: What the robot measures with.

    Raises:
        UnknownName: A sensor sits on a link that the robot does not have.
    """

    def __init__(self, state: SimulationState, equipment: Equipment):
        self.record = equipment.record
        self.rates = equipment.record.rates
        made = {kind.name: kind.of(state, equipment) for kind in KINDS}
        self._sensors: dict[str, Sensor] = {name: sensor for name, sensor in made.items() if sensor is not None}

    def __getitem__(self, name: str) -> Any:
        return self._sensors[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._sensors)

    def __len__(self) -> int:
        return len(self._sensors)

    def restart(self, seed: int | None = None) -> None:
        """Begin all noise again; `seed` replaces the robot's own until the next restart."""
        for sensor in self.values():
            sensor.restart(seed)
