"""A robot and its lower level in a PyBullet world."""

from solfer.simulation.bundle import find_robot, read_bundle
from solfer.simulation.rates import changed_rates
from solfer.simulation.records import BundleRecord
from solfer.simulation.sensors import Rates
from solfer.simulation.server import SimulationServer
from solfer.simulation.simulation import Simulation

__all__ = ["BundleRecord", "Rates", "Simulation", "SimulationServer", "changed_rates", "find_robot",
           "read_bundle"]
