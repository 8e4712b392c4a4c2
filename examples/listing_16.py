"""Listing 16 of the paper: a generator of its own for the joint-space component. It adds a topic that drives the robot.

python examples/listing_16.py [--duration SECONDS]
"""

import argparse
from dataclasses import dataclass, field
from pathlib import Path

from solfer.components import Component, TopicIn, TopicOut
from solfer.components.joint_states import JointStates, MoveJoints
from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Generator, generate
from solfer.simulation import Simulation, SimulationServer
from solfer.transport import Inbox
from solfer.transport.declared import bind

CONFIG = Path(__file__).resolve().parents[1] / "config"
ROBOT = CONFIG / "robots" / "centauro"
TURNS = {"j_wheel_1": 1.0, "j_wheel_2": -1.0, "j_wheel_3": 1.0, "j_wheel_4": -1.0}
RADIUS = 0.078  # of a wheel [m]
STEP, START = 0.001, 0.3  # [s]


@dataclass(frozen=True)
class Vector:
    """geometry_msgs/Vector3; fields that are not needed are left out."""

    x: float = 0.0


@dataclass(frozen=True)
class Twist:
    """geometry_msgs/Twist [m/s]."""

    linear: Vector = field(default_factory=Vector)


class DrivingGenerator(Generator):
    """Generates the joint-space plugin, which then also drives: on `<name>/cmd_vel`, as any navigation publishes it."""

    component = JointStates

    def declarations(self, component: Component) -> tuple:
        """Add the topic to what the component declares itself."""

        def drive(twist: Twist) -> None:
            speeds = tuple(turn * twist.linear.x / RADIUS for turn in TURNS.values())
            component.trajectory(MoveJoints(joints=tuple(TURNS), velocities=speeds))

        return (*super().declarations(component), TopicIn("cmd_vel", "geometry_msgs/Twist", Twist, drive))


def main() -> None:
    """Drive forward, and print how far it was."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--duration", type=float, default=5.0, help="simulated time [s] (default: %(default)g)")
    duration = parser.parse_args().duration
    bus = Bus({
        "/robot_description": (ROBOT / "centauro.urdf").read_text(),
        "/robot_semantic_description": (ROBOT / "centauro.srdf").read_text(),
    })  # fmt: skip
    simulation = Simulation.from_file(ROBOT / "robot.yaml")
    bus.every(STEP, SimulationServer(simulation, MemoryMiddleware(bus, "simulator")).cycle)
    configuration = load(CONFIG / "centauro.yaml", "joint_states")
    plugin = generate(configuration, MemoryMiddleware(bus, "joint_states"), DrivingGenerator)
    bus.every(1.0 / plugin.rate, plugin.cycle)
    velocity = TopicOut("/joint_states/cmd_vel", "geometry_msgs/Twist", Twist, lambda: Twist(Vector(0.2)))
    node = MemoryMiddleware(bus, "navigation")
    navigation = bind("navigation", (velocity,), node, Inbox(), rate=plugin.rate)
    bus.run_until(START)  # until the plugin runs
    begin = simulation.q[:2].copy()
    navigation.run()
    bus.run_until(START + duration)
    forward, aside = simulation.q[:2] - begin
    print(f"drove {forward:.3f} m forward and {aside:.3f} m aside in {duration:g} s")
    simulation.close()


if __name__ == "__main__":
    main()
