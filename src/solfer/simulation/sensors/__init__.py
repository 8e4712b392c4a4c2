"""What a simulated robot measures."""

from solfer.simulation.sensors.equipment import Equipment, load_equipment
from solfer.simulation.sensors.records import Rates, SensorsRecord
from solfer.simulation.sensors.sensors import Sensors

__all__ = ["Equipment", "Rates", "Sensors", "SensorsRecord", "load_equipment"]
