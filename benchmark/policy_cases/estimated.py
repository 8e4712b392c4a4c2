"""What lets `odometry` estimate the base of a walking robot: contacts of its feet, sensors that err, a module."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import yaml

from solfer.simulation import read_bundle
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.sensors.records import SensorsRecord

CONSTRAINT = {f"force_{row + 1}": [0.0] * (3 + row) + [1.0] + [0.0] * (2 - row) for row in range(3)}
SHIPPED = Path(__file__).resolve().parents[2] / "config/robots/centauro/robot.yaml"
"""The robot with the errors of sensors that solfer ships."""

BOTH = {"position": True, "velocity": True}

SOLE = 0.02
"""Height above the lowest one up to which spheres are of the sole [m]."""


def add_odometry(file: Path, feet: tuple[str, ...], base: str, **tags: Any) -> None:
    """Write contacts of the feet, and a module `odometry` with tags, into a robot's configuration.

    Args:
        file: The configuration.
        feet: Links that touch the ground, in a new group `feet`.
        base: The base's link.
        tags: See above.
    """
    folder = file.parent / f"robots/{file.stem}"
    contacts = {}
    urdf = folder / f"{file.stem}.urdf"
    for link in feet:
        for number, (place, radius) in enumerate(spheres_of(urdf, link)):
            contacts[f"contact{len(contacts)}"] = {
                "name": f"{link}_{number}",
                "end_frame": link,
                "type": "contact_point",
                "position": place,
                "offset": [0.0, 0.0, -radius],
                "initialize": False,
                "constraint_matrix": CONSTRAINT,
            }
    (folder / "contacts.yaml").write_text(yaml.safe_dump({file.stem: {"contacts": contacts}}))
    bundle = folder / "robot.yaml"
    bundle.write_text(f"{bundle.read_text()}\ncontacts: contacts.yaml\n")
    _add_groups(folder / f"{file.stem}.srdf", feet=feet, base=(base,))
    tree = yaml.safe_load(file.read_text())
    part = tree["mwoibn"]
    for pipe in ("feedback", "controller"):
        part["ros"][pipe] |= {"odometry": {"source" if pipe == "feedback" else "sink": "base_odometry"}}
    part["ros"]["source"]["srdf"] = "/robot_semantic_description"
    part["ros"]["source"]["contacts"] = {"file": str(folder / "contacts.yaml")}
    part["ros"]["feedback"]["odometry"]["message"] = "solfer/JointCommand"
    part["ros"]["feedback"]["imu_base"] = {"source": "imu", "message": "sensor_msgs/Imu", "initialize": True}
    part["robot"]["odometry"] = _robot("link_side_online", "imu_base")
    part["robot"]["walking"] = _robot("link_side_online", "odometry")
    of_base = {"dofs": {"chain": "base", "type": "all", "mapping": "RBDL"}, "interface": BOTH}
    part["feedback"]["odometry"] = {"space": "JOINT", **of_base, "function": "state"}
    part["controller"]["odometry"] = {"type": "reference", **of_base}
    part["feedback"]["imu_base"] = {
        "space": "OPERATIONAL",
        "dofs": {"chain": "all", "type": "body", "name": base, "mapping": "RBDL"},
        "interface": BOTH,
        "convention": {"position": {"type": "NONE"}},
        "function": "state",
    }
    keep = {"timeout": 0.5, "on_timeout": "keep"}
    histories = {"link_side_online": {**keep, "history": 128}, "imu_base": {**keep, "history": 256}}
    (folder / "odometry.yaml").write_text(yaml.safe_dump({"mwoibn": {"feedback": histories}}))
    part["modules"]["odometry"] = {
        "layer": "NRT",
        "robot": "odometry",
        "controller": ["odometry"],
        "secondary_file": {"file": str(folder / "odometry.yaml")},
        "mode": "full",
        "kinematics": False,
        "dynamics": False,
        "model_change": True,
        "chain": "feet",
        "method": "filter",
        **tags,
    }
    file.write_text(yaml.safe_dump(tree, sort_keys=False))


def with_shipped_sensors(bundle: BundleRecord, base: str, seed: int) -> BundleRecord:
    """Return a robot with the sensors that solfer ships, errors included, and an IMU at the origin of its base."""
    sensors = read_bundle(SHIPPED).sensors.model_dump(exclude_unset=True)
    sensors["imu"]["link"] = base
    return bundle.model_copy(update={"sensors": SensorsRecord.model_validate(sensors | {"seed": seed})})


def _robot(*feedbacks: str) -> dict[str, Any]:
    return {"feedback": {"list": list(feedbacks)}, "actuators": {"read": False}, "contacts": {"read": True}}


def _add_groups(path: Path, **groups: tuple[str, ...]) -> None:
    """Add groups of links to an SRDF, in front of its states."""
    document = ElementTree.parse(path)
    for name, links in groups.items():
        group = ElementTree.Element("group", name=name)
        document.getroot().insert(0, group)
        for link in links:
            ElementTree.SubElement(group, "link", name=link)
    document.write(path)


def spheres_of(urdf: Path, link: str) -> list[tuple[list[float], float]]:
    """Return places in the link [m] and radii [m] of the spheres on which it stands: one, or the corners of a sole."""
    found = []
    for collision in ElementTree.parse(urdf).iterfind(f"link[@name='{link}']/collision"):
        sphere = collision.find("geometry/sphere")
        if sphere is not None:
            place = [float(each) for each in collision.find("origin").get("xyz").split()]
            found.append((place, float(sphere.get("radius"))))
    lowest = min(place[2] - radius for place, radius in found)
    sole = [each for each in found if each[0][2] - each[1] < lowest + SOLE]
    if len(sole) <= 4:
        return sole
    places = np.array([place for place, _ in sole])
    corners = {int(np.argmax(places[:, :2] @ way)) for way in ((1, 1), (1, -1), (-1, 1), (-1, -1))}
    return [sole[index] for index in sorted(corners)]
