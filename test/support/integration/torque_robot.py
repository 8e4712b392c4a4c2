"""Robots of `example-robot-data` on torques: the files that `solfer new robot` writes, with contacts and a plugin."""

from contextlib import closing
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from support.integration.carried import with_other_masses

from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.bundle import Bundle, load_bundle
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import main

ROBOTS = "cmeel.prefix/share/example-robot-data/robots/"
FRICTION = 0.7
COMMANDED = ("position", "velocity", "effort", "stiffness", "damping")


def _rows(count: int) -> dict[str, list[int]]:
    """Return the constraint of a point (3 rows) or of a sole (6 rows)."""
    names = [f"{kind}_{row}" for kind in ("force", "momentum") for row in (1, 2, 3)]
    return {name: np.roll(np.eye(6, dtype=int)[row], 3).tolist() for row, name in enumerate(names[:count])}


@dataclass(frozen=True)
class Legged:
    """What distinguishes one robot from another.

    Attributes:
        urdf, srdf: Its files, relative to those of `example-robot-data`, or absolute.
        state: Named state in which it begins.
        feet: Links of its feet; none: its base is fixed.
        rows: Rows that a foot holds.
        contact: Further keys of a contact.
        tags: Further tags of the component.
        base: Link whose orientation stays.
        tip: Link that draws a circle of 5 cm in the world, in place of the squat.
    """

    urdf: str
    srdf: str
    state: str
    feet: tuple[str, ...]
    rows: int
    contact: dict[str, Any] = field(default_factory=dict)
    tags: dict[str, Any] = field(default_factory=dict)
    base: str = "base_link"
    tip: str = ""


def _arm(urdf: str, srdf: str, state: str, tip: str) -> Legged:
    """Make an arm on a fixed base."""
    return Legged(urdf, srdf, state, (), 3, tip=tip)


def _quadruped(urdf: str, srdf: str, foot: str, legs: str, base: str) -> Legged:
    """Make a robot on four points, which begins standing."""
    return Legged(urdf, srdf, "standing", tuple(foot.format(leg) for leg in legs.split()), 3, base=base)


LEGGED = {
    "talos": Legged(
        "talos_data/robots/talos_reduced.urdf",
        str(Path(__file__).parents[3] / "examples/talos.srdf"),
        "half_sitting",
        ("left_sole_link", "right_sole_link"),
        6,
        tags={"sole": [0.1, 0.06]},
    ),
    "solo": Legged(
        "solo_description/robots/solo12.urdf",
        "solo_description/srdf/solo.srdf",
        "straight_standing",
        tuple(f"{leg}_FOOT" for leg in ("FL", "FR", "HL", "HR")),
        3,
        contact={"offset": [0.0, 0.0, -0.0165]},
    ),
    "anymal": _quadruped(
        "anymal_b_simple_description/robots/anymal.urdf",
        "anymal_b_simple_description/srdf/anymal.srdf",
        "{}_FOOT",
        legs="LF RF LH RH",
        base="base",
    ),
    "hyq": _quadruped(
        "hyq_description/robots/hyq_no_sensors.urdf",
        "hyq_description/srdf/hyq.srdf",
        "{}_foot",
        legs="lf rf lh rh",
        base="base_link",
    ),
} | {
    name: _quadruped(
        f"{name}_description/urdf/{name}.urdf",
        f"{name}_description/srdf/{name}.srdf",
        "{}_foot",
        legs="FL FR RL RR",
        base="base",
    )
    for name in ("go1", "go2", "b1")
}
ARMS = {
    "panda": _arm("panda_description/urdf/panda.urdf", "panda_description/srdf/panda.srdf", "default", "panda_hand"),
    "z1": _arm("z1_description/urdf/z1.urdf", "z1_description/srdf/z1.srdf", "arm_up", "link06"),
}
CIRCLE = {"radius": 0.05, "period": 4.0, "plane": "yz"}


def hand_task(link: str, base: str) -> dict[str, Any]:
    """Return the task of a link that draws a circle, as a base sees it."""
    circle = {"radius": 0.03, "period": 4.0, "plane": "yz"}
    return {"point": "position", "link": link, "relative": base, "gain": 4, "reference": {"circle": circle}}


def write(name: str, folder: Path, amplitude: float, hand: str | None = None) -> Path:
    """Write the files of a robot that squats with a sine of an amplitude [m]; return its configuration.

    A link `hand` draws a circle meanwhile.
    """
    legged = (LEGGED | ARMS)[name]
    try:
        share = Path(str(distribution("example-robot-data").locate_file(ROBOTS)))
    except PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    files = ["--urdf", str(share / legged.urdf), "--srdf", str(share / legged.srdf)]
    base = ["--floating-base"] if legged.feet else []
    assert main(["new", "robot", name, *files, *base, "--package", str(folder / name)]) == 0
    configuration = folder / name / f"config/{name}.yaml"
    bundle = configuration.parent / f"robots/{name}/robot.yaml"
    contact = {"type": "contact_point", "position": [0.0, 0.0, 0.0], "constraint_matrix": _rows(legged.rows)}
    contacts = {
        f"contact{index}": {"name": foot, "end_frame": foot} | contact | legged.contact
        for index, foot in enumerate(legged.feet)
    }
    (bundle.parent / "contacts.yaml").write_text(yaml.safe_dump({name: {"contacts": contacts}}))
    _change(
        bundle,
        lambda tree: tree.update(
            contacts="contacts.yaml", start={"state": legged.state}, friction={"default": FRICTION, "ground": 1.0}
        ),
    )

    def add(tree: dict[str, Any]) -> None:
        main_tree = tree["mwoibn"]
        if legged.feet:
            main_tree["robot"]["standing"]["contacts"] = {"read": True}
            main_tree["ros"]["source"]["contacts"] = {"file": f"robots/{name}/contacts.yaml"}
        main_tree["controller"]["position_controller"]["interface"] = dict.fromkeys(COMMANDED, True)
        tasks = {
            "com": {
                "point": "center_of_mass",
                "gain": 8,
                "reference": {"sine": {"amplitude": [0.0, 0.0, -amplitude], "period": 4.0}},
            },
            "base": {"point": "orientation", "link": legged.base, "gain": 8},
            "posture": {"point": "posture", "gain": 5},
        } | ({} if hand is None else {"hand": hand_task(hand, legged.base)})
        if legged.tip:
            tip = {"point": "position", "link": legged.tip, "gain": 8, "reference": {"circle": CIRCLE}}
            base = {"base": tasks["base"] | {"point": "pose"}} if legged.feet else {}
            tasks = {"tip": tip} | base | {"posture": tasks["posture"]}
        main_tree["modules"]["squat"] = {
            "class": "solfer.components.inverse_dynamics:InverseDynamics",
            "layer": "NRT",
            "robot": "standing" if legged.feet else "whole_body",
            "controller": "direct",
            "mode": "full",
            "kinematics": True,
            "dynamics": True,
            "model_change": False,
            "friction": FRICTION,
            "gains": [{"chain": "all", "stiffness": 0}],
            "stack": {"tasks": tasks, "levels": [[name for name in tasks if name != "posture"], ["posture"]]},
        } | legged.tags

    _change(configuration, add)
    return configuration


def _change(file: Path, change: Any) -> None:
    tree = yaml.safe_load(file.read_text())
    change(tree)
    file.write_text(yaml.safe_dump(tree))


def _with_wrong(record: BundleRecord, share: float, seed: int) -> Bundle:
    """Load a robot with other masses; its meshes are found without the file that names them."""
    package = Path(str(distribution("example-robot-data").locate_file(ROBOTS))).parent
    urdf = record.urdf.location.read_text().replace("package://example-robot-data", f"file://{package}")
    return load_bundle(record, with_other_masses(urdf, share, seed))


class TorqueRobot:
    """A simulated robot on a bus, with its plugin.

    Args:
        name: Name of the robot, in `LEGGED`.
        folder: Where its files are written.
        amplitude: How far it squats to each side [m].
        wrong: Share and seed of masses and inertias that differ from those of the model; None: they do not.
        hand: A link that draws a circle; None: none does.
    """

    def __init__(
        self,
        name: str,
        folder: Path,
        amplitude: float,
        wrong: tuple[float, int] | None = None,
        hand: str | None = None,
    ):
        configuration = write(name, folder, amplitude, hand)
        record = read_bundle(configuration.parent / f"robots/{name}/robot.yaml")
        self.bus = Bus(robot_parameters(record))
        perfect = record.with_perfect_sensors()
        self.simulation = Simulation.from_file(perfect) if wrong is None else Simulation(_with_wrong(perfect, *wrong))
        self.bus.every(0.001, SimulationServer(self.simulation, MemoryMiddleware(self.bus, "simulator")).cycle)
        loaded = load(configuration, "squat")
        generator = Registry().find("inverse_dynamics", loaded.module.class_)
        self.bus.run_until(0.5)
        self.plugin: Plugin = generate(loaded, MemoryMiddleware(self.bus, "squat"), generator)
        self.bus.every(1.0 / self.plugin.rate, self.plugin.cycle, cycles=True)

    def run(self, duration: float) -> None:
        """Let `duration` [s] pass."""
        self.bus.run_until(self.bus.time + duration)

    def close(self) -> None:
        """Release the simulation."""
        self.simulation.close()


def opened(name: str, folder: Path, amplitude: float) -> "closing[TorqueRobot]":
    """Return a robot that is closed at the end of a `with` block."""
    return closing(TorqueRobot(name, folder, amplitude))
