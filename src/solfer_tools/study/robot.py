"""The robot of a run: what is simulated, and what its controllers know of it."""

from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from solfer.config.yaml.files import check_file
from solfer.errors import UnknownName
from solfer.middleware.memory import FaultsRecord, read_faults
from solfer.simulation import BundleRecord, Simulation, find_robot, read_bundle
from solfer.simulation.world.world import find_world
from solfer_tools.study.records import PayloadRecord, SimulationRecord


def bundle_of(record: SimulationRecord, seed: int) -> BundleRecord:
    """Read the robot's bundle, with the sensors of the record and a seed of their noise.

    Raises:
        ConfigError, UnknownName: There is no such robot, or its file is wrong.
    """
    bundle = read_bundle(file_of(record, "robot"))
    sensors = bundle.sensors.perfect() if record.perfect else bundle.sensors.scaled(record.noise)
    changes: dict[str, float] = {"seed": (sensors.seed + seed) % 2**32}
    if record.delay is not None:
        changes["delay"] = record.delay
    return bundle.model_copy(update={"sensors": sensors.model_copy(update=changes)})


def simulation_of(record: SimulationRecord, bundle: BundleRecord, description: str, gui: bool = False) -> Simulation:
    """Make the simulation, whose masses and friction are those of the record; the URDF is what controllers know.

    Raises:
        SolferError: A link, a state, a world or a part of it does not exist, or the robot cannot be put into it.
    """
    changed = with_masses(description, record)
    world = file_of(record, "world")
    simulation = Simulation.from_file(
        bundle, gui, record.state, description_text=changed, world=world, engine=record.engine
    )
    try:
        for name, coefficient in record.friction.items():
            simulation.set_friction(name, coefficient)
    except UnknownName as error:
        simulation.close()
        raise error.at(record.where("friction")) from None
    return simulation


def faults_of(record: SimulationRecord, seed: int) -> FaultsRecord | None:
    """Read the faults of the transport; None: it has none.

    Raises:
        ConfigError, UnknownName: The file is missing, or wrong.
    """
    if record.transport is None:
        return None
    faults = read_faults(record.transport.location)
    return faults.model_copy(update={"seed": (faults.seed + seed) % 2**32})


def files_of(record: SimulationRecord) -> list[Path]:
    """List the files whose contents decide what a run does.

    Raises:
        ConfigError, UnknownName: One of them does not exist, or is wrong.
    """
    files = [*_files_of_robot(file_of(record, "robot")), file_of(record, "world")]
    if record.transport is not None:
        files.append(record.transport.location)
    for file in files:
        check_file(file, record.where())
    return files


FINDERS = {"robot": cache(find_robot), "world": cache(find_world)}  # which look through all ROS packages


@cache
def _files_of_robot(robot: Path) -> list[Path]:
    bundle = read_bundle(robot)
    named = (bundle.urdf, bundle.srdf, bundle.contacts, bundle.actuators, bundle.gains)
    return [robot, *(each.location for each in named if each is not None)]


def file_of(record: SimulationRecord, key: str) -> Path:
    """Find the file of the `robot` or of the `world`, by its name or beside the file that names it.

    Raises:
        UnknownName: There is none of that name.
    """
    name = getattr(record, key)
    is_path = "/" in name or name.endswith((".yaml", ".urdf"))
    try:
        return FINDERS[key](str(Path(record.folder(key)) / name) if is_path else name)
    except UnknownName as error:
        raise error.at(record.where(key)) from None


def with_masses(description: str, record: SimulationRecord) -> str:
    """Return a URDF with the masses of a record.

    Raises:
        UnknownName: The payload is on a link that the robot does not have.
    """
    shift = np.array(record.center)
    if record.mass == 1.0 and not shift.any() and record.payload is None:
        return description
    root = ElementTree.fromstring(description)
    for inertial in root.iterfind("link/inertial"):
        for part in (inertial.find("mass"), inertial.find("inertia")):
            for name, value in {} if part is None else part.attrib.items():
                part.set(name, repr(record.mass * float(value)))
        origin = inertial.find("origin")
        if origin is None:
            origin = ElementTree.SubElement(inertial, "origin")
        center = np.array(origin.get("xyz", "0 0 0").split(), dtype=float) + shift
        origin.set("xyz", _text(center))
    if record.payload is not None:
        _add_payload(root, record.payload)
    return ElementTree.tostring(root, encoding="unicode")


def _add_payload(root: ElementTree.Element, payload: PayloadRecord) -> None:
    links = [link.get("name", "") for link in root.iterfind("link")]
    if payload.link not in links:
        raise UnknownName("link", payload.link, links, where=payload.where("link"))
    if not payload.mass:
        return
    name = "study_payload"  # of the link and of its joint
    link = ElementTree.SubElement(root, "link", name=name)
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value=repr(payload.mass))
    radius = 0.05  # of a solid ball, whose moment of inertia is 2/5 m r^2 [m]
    moment = repr(0.4 * payload.mass * radius**2)
    ElementTree.SubElement(inertial, "inertia", ixx=moment, iyy=moment, izz=moment, ixy="0", ixz="0", iyz="0")
    joint = ElementTree.SubElement(root, "joint", name=name, type="fixed")
    ElementTree.SubElement(joint, "parent", link=payload.link)
    ElementTree.SubElement(joint, "child", link=name)
    ElementTree.SubElement(joint, "origin", xyz=_text(np.array(payload.center)), rpy="0 0 0")


def _text(vector: np.ndarray) -> str:
    return " ".join(repr(value) for value in vector.tolist())
