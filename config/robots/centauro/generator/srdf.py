"""centauro.srdf: groups and named states."""

from typing import Any
from xml.etree.ElementTree import Element, SubElement

from generator.entries import entries, expand_all, text


def make_srdf(parameters: dict[str, Any]) -> Element:
    """Make the SRDF with all groups and states."""
    robot = Element("robot", name=parameters["name"])
    for name, group in parameters["groups"].items():
        element = SubElement(robot, "group", name=name)
        if "chain" in group:
            base, tip = group["chain"]
            SubElement(element, "chain", base_link=base, tip_link=tip)
        for kind in ("group", "link"):
            for member in expand_all(group.get(f"{kind}s", [])):
                SubElement(element, kind, name=member)
    for name, state in _states(parameters).items():
        element = SubElement(robot, "group_state", name=name, group="chains")
        for joint, value in state.items():
            SubElement(element, "joint", name=joint, value=text(value))
    return robot


def _states(parameters: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Values of the joints that each state names."""
    chains = entries(parameters["chains"])
    states: dict[str, dict[str, float]] = {}
    for name, rows in parameters["states"].items():
        rows = dict(rows)
        states[name] = dict(states[rows.pop("like")]) if "like" in rows else {}
        for key, row in entries(rows).items():
            joints, values = (chains[key], row) if key in chains else ([key], [row])
            states[name] |= {joint: value for joint, value in zip(joints, values, strict=True) if value is not None}
    return states
