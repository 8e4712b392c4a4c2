"""Stand-ins for the four components of Fig. 5: each reads and writes what the real one does."""

import math

import numpy as np
import yaml
from support.bullet import raw_bullet
from support.integration.world import CONFIG, ROBOT, World, perfect

from solfer.components import Component
from solfer.config import load_shared
from solfer.dynamics import BIAS
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginSet, Registry, generate_shared
from solfer.plugins.life.budget import BudgetRules
from solfer.simulation import Rates, Simulation, SimulationServer
from solfer.simulation.robot_body.placement import StartPlacement

ORDER = ("estimation", "forces", "locomotion", "compensation")
LEGS = ("hip", "knee", "ankle")
FILES = ("actuators", "contacts")


def hang(simulation):
    """Hold the base of a simulated robot in the air, so that its legs can move as they like."""
    simulation.reset(placement=StartPlacement(height=0.5))
    bullet, client, body, *_ = raw_bullet(simulation)
    place, turn = bullet.getBasePositionAndOrientation(body, physicsClientId=client)  # of its mass
    bullet.createConstraint(
        body, -1, -1, -1, bullet.JOINT_FIXED, (0, 0, 0), (0, 0, 0), place, (0, 0, 0, 1), turn,
        physicsClientId=client,
    )  # fmt: skip


class Part(Component):
    """Counts its cycles, and fails as a test sets it.

    Attributes:
        fault: What goes wrong from now on: `update`, `send`, `nan` or `slow`; empty: nothing.
        cycles: Number of updates.
    """

    fault, cycles = "", 0
    worked = 0
    """Time of all components that are slow [ns]."""

    def update(self):
        self.cycles += 1
        if self.fault == "update":
            raise RuntimeError(f"{self.name} fails")
        self.work()
        if self.fault == "nan":
            self.spoil()
        if self.fault == "slow":
            Part.worked += 4_000_000

    def send(self):
        if self.fault == "send":
            raise RuntimeError(f"{self.name} fails")

    def spoil(self):
        """Write a number that is none where it harms most."""
        self.model.command.position[:] = math.nan


class Estimation(Part):
    """Writes where the base is into the State that it reads: from the IMU's turn, and as the wheels roll."""

    def init(self):
        self.wheels = self.model.selectors["wheels"].indices

    def work(self):
        state = self.model.state
        state.position[:2] = 0.078 * state.position[self.wheels].mean(), 1e-3 * state.position[self.wheels[0]]
        state.velocity[0] = 0.078 * state.velocity[self.wheels].mean()

    def spoil(self):
        self.model.state.position[0] = math.nan


class Forces(Part):
    """Writes the reaction forces into the contacts of its Robot: each carries its share of the weight."""

    def init(self):
        self.model.dynamics.subscribe({BIAS: 1})

    def work(self):
        lifted = self.model.dynamics.bias[2] / len(self.model.contacts)
        for contact in self.model.contacts:
            contact.wrench[:3] = 0.0, 0.0, lifted * (1.0 + 0.1 * contact.value[0])

    def spoil(self):
        self.model.contacts[1].wrench[2] = math.nan


class Locomotion(Part):
    """Desires a motion of the legs, lifted by what the ground does to them."""

    def init(self):
        model = self.model
        self.legs = [index for index, name in enumerate(model.dofs) if name.startswith(LEGS)]
        self.wheels = model.selectors["wheels"].indices
        self.begin, self.time = model.state.position.copy(), 0.0

    def work(self):
        self.time += self.period
        model = self.model
        force = model.contacts.forces[0][2]
        reached = model.kinematics.position("wheel_1")
        command = model.command
        command.position[6:] = self.begin[6:]
        command.position[self.legs] += 0.2 * math.sin(1.5 * self.time) + 1e-6 * force + 1e-3 * reached[0]
        command.velocity[self.wheels] = 0.8 * math.sin(self.time)
        command.velocity[self.legs] = 0.3 * math.cos(1.5 * self.time)


class Compensation(Part):
    """Commands what the others desire, with the efforts that carry the robot."""

    def init(self):
        self.model.dynamics.subscribe({BIAS: 1})

    def work(self):
        model = self.model
        carried = sum(contact.jacobian.T @ contact.wrench[:3] for contact in model.contacts)
        model.command.torque[:] = np.clip(1e-3 * (model.dynamics.bias - carried), -1.0, 1.0)


def tree():
    """Read the shipped configuration with absolute paths, with the modules of Fig. 5 in it."""
    tree = yaml.safe_load((CONFIG / "centauro.yaml").read_text())
    main = tree["mwoibn"]
    for ends in (main["ros"], main["xbot"]):
        for name in FILES:
            ends["source"][name] = {"file": str(ROBOT / f"{name}.yaml")}
    for place in (*main["layers"].values(), *main["robot"]["systems"].values()):
        place["file"] = str(CONFIG / place["file"])
    main["feedback"]["ground"] = {"space": "CONTACTS"}
    main["controller"] |= {
        "ground": {"space": "CONTACTS", "type": "reference"},
        "estimated": main["controller"]["odometry"] | {"function": "state"},
        "wave": main["controller"]["upper_body"]
        | {"dofs": {"chain": "all", "type": "actuated", "mapping": "ACTUATED"}},
    }
    for ends in (main["ros"], main["xbot"]):
        ends["feedback"]["ground"] = {"source": "reaction_forces", "message": "solfer/RobotPoints", "initialize": True}
        ends["controller"]["ground"] = {"sink": "reaction_forces", "message": "solfer/RobotPoints"}
        ends["controller"]["estimated"] = {"sink": "base_odometry"}
        ends["controller"]["wave"] = {"sink": "wave"}

    def robot(*feedback):
        return {"feedback": {"list": list(feedback)}, "actuators": {"read": True}, "contacts": {"read": True}}

    main["robot"] |= {
        "estimated": robot("link_side_online", "imu_base"),
        "lower": robot("link_side_online", "odometry", "ground"),
        "whole": robot("link_side_online", "odometry"),
        "commanded": robot("link_side_online", "odometry", "ground", "lower_body", "upper_body"),
    }
    part = {"secondary_file": {"file": str(CONFIG / "support" / "odometry.yaml")}}
    main["modules"] |= {
        "estimation": module("Estimation", "estimated", ["estimated"], model_change=True, **part),
        "forces": module("Forces", "whole", ["ground"], dynamics=True),
        "locomotion": module("Locomotion", "lower", ["lower_body"], **part),
        "compensation": module("Compensation", "commanded", "direct", dynamics=True),
        "shared": {"layer": "NRT", "plugins": [f"{name}::{name}" for name in ORDER]},
    }
    return tree


def module(component, robot, controller, **tags):
    """Return the keys of a plugin with a component of this module, or another."""
    return {
        "class": component if ":" in component else f"{__name__}:{component}",
        "layer": "NRT",
        "robot": robot,
        "controller": controller,
        "mode": "full",
        "kinematics": True,
        "dynamics": False,
        "model_change": False,
    } | tags


class Figure5World(World):
    """CENTAURO that hangs, and the components of Fig. 5: in a shared plugin, or each by itself on the same bus.

    Args:
        file: Their configuration.
        shared: Whether they are a shared plugin.
        nanoseconds: Clock for durations [ns]; None: a virtual one, on which only slow components take time.
    """

    def __init__(self, file, shared=True, nanoseconds=None):
        super().__init__()
        hang(self.simulation)
        self.upper = self.plugin("upper_body")
        if shared:
            loaded, registry = load_shared(file), Registry()
            self.members = generate_shared(loaded.plugins, self._outside, registry)
            self.set = PluginSet(
                self.members.plugins,
                BudgetRules(),
                nanoseconds=nanoseconds or self._virtual,
                polls=[self.members.sharing.turns.next],
                requires=self.members.requires,
            )
            self.parts = {managed.name: managed for managed in self.set.plugins}
            self.plugins = {managed.name: managed.plugin for managed in self.set.plugins}
            self.set.switchboard.serve(MemoryMiddleware(self.bus, "shared"), "shared", self.set.inbox.submit)
            self.set.start()
            self.bus.every(1.0 / self.set.rate, lambda: self.set.cycle())
        else:
            self.plugins = {name: self.plugin(name, file) for name in ORDER}
        self.commands, self.turned = [], []
        self.bus.every(1.0 / self.upper.rate, self._note)

    def offer(self, middleware):
        """See `World.offer`; all rates are 200 Hz, so that all plugins read the same in a cycle."""
        simulation = Simulation.from_file(perfect())
        return simulation, SimulationServer(simulation, middleware, Rates())

    def _outside(self, configuration):
        return MemoryMiddleware(self.bus, configuration.module.name)

    def _virtual(self):
        return round(1e9 * self.bus.time) + Part.worked

    def _note(self):
        command = self.plugins["compensation"].robot.command
        self.turned.append(self.plugins["locomotion"].robot.state.position[self.plugins["locomotion"].component.wheels])
        self.commands.append(np.concatenate((command.position, command.velocity, command.torque)))

    def move(self, duration=2.0):
        """Let the arms go somewhere else while the legs swing."""
        self.run(0.3)
        joints = tuple(dof for dof in self.upper.robot.dofs if dof.startswith(("j_arm", "torso", "neck")))
        begin = self.upper.robot.state.position
        goals = tuple(begin[self.upper.robot.dof(joint)] + 0.28 for joint in joints)
        reply = self.ask("upper_body/trajectory", joints=joints, positions=goals, speed=0.5)
        assert reply.success, reply.message
        self.run(duration)


def write(folder, **modules):
    """Write the configuration into a file, with other tags of some modules, and return the file."""
    figure = tree()
    for name, tags in modules.items():
        figure["mwoibn"]["modules"].setdefault(name, {}).update(tags)
    path = folder / "figure_5.yaml"
    path.write_text(yaml.safe_dump(figure))
    return path
