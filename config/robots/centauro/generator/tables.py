"""contacts.yaml, actuators.yaml and gains.yaml."""

from typing import Any

from generator.entries import entries

# Rows of a contact's constraint matrix, three moments before three forces: a point holds against all forces and
# against no moment.
FORCES = [[0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 0, 0, 0, 1]]
NO_MOMENT = [0, 0, 0, 0, 0, 0]


def make_contacts(parameters: dict[str, Any]) -> dict[str, Any]:
    """All contacts, numbered without gaps."""
    contacts = {
        f"contact{number}": _contact(name, contact, parameters["wheel"])
        for number, (name, contact) in enumerate(parameters["contacts"].items())
    }
    return {parameters["name"]: {"contacts": contacts}}


def make_actuators(parameters: dict[str, Any]) -> dict[str, Any]:
    """Return the series elastic drive of each joint."""
    drives = {joint: {"type": "SEA", **drive} for joint, drive in entries(parameters["actuators"]).items()}
    return {parameters["name"]: {"actuators": drives}}


def make_gains(parameters: dict[str, Any], chosen: str) -> dict[str, Any]:
    """Stiffness and damping of each joint."""
    gains = entries(parameters["gains"]["simulation"]) | entries(parameters["gains"][chosen])
    named = {joint: {"stiffness": stiffness, "damping": damping} for joint, (stiffness, damping) in gains.items()}
    return {parameters["name"]: {"gains": named}}


def _contact(name: str, contact: dict[str, Any], wheel: dict[str, float]) -> dict[str, Any]:
    is_wheel = "axle" in contact
    radius = round(wheel["tube_radius"] + wheel["ring_radius"], 6)
    rows = {f"force_{row}": list(force) for row, force in enumerate(FORCES, start=1)}
    rows |= {f"momentum_{row}": list(NO_MOMENT) for row in (1, 2, 3)}
    made = {
        "name": name,
        "end_frame": contact["link"],
        "type": "wheel" if is_wheel else "contact_point",
        "position": [0.0, 0.0, 0.0],
        "offset": [0.0, 0.0, -radius if is_wheel else 0.0],
        "constraint_matrix": rows,
        "active": True,
        "initialize": True,
        "interface": "fixed",
        "topic": f"contacts/{name}/link",
        "message": "geometry_msgs/WrenchStamped",
    }
    if is_wheel:
        made |= {
            "minor_axis": wheel["tube_radius"],
            "major_axis": wheel["ring_radius"],
            "reference_axis": {"x": 0, "y": 0, "z": contact["axle"]},
        }
    return made
