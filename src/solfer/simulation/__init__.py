"""A robot and its lower level in the world of a physics engine."""

from solfer.simulation.bundle import find_robot, read_bundle
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.rendering.pictures import Pictures
from solfer.simulation.sensors import Rates
from solfer.simulation.server.rates import changed_rates
from solfer.simulation.server.server import SimulationServer
from solfer.simulation.simulation import Simulation

__all__ = [
    "BundleRecord",
    "Pictures",
    "Rates",
    "Simulation",
    "SimulationServer",
    "changed_rates",
    "find_robot",
    "read_bundle",
]
