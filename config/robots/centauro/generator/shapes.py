"""Shapes of the links, made of boxes, cylinders and spheres only: parsers of URDF drop `<capsule>`."""

import math
from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element, SubElement

from generator.entries import opposite, text

# Heights of the nested cylinders that show a wheel's round profile, as parts of half its width.
STEPS = (0.22, 0.44, 0.65, 0.84, 1.0)


def add_shapes(link: Element, shapes: list[dict[str, Any]], wheel: dict[str, float]) -> None:
    """Add a link's `<visual>` and `<collision>` elements."""
    simple = [part for shape in shapes for part in _split(shape, wheel)]
    for tag in ("visual", "collision"):
        for shape in simple:
            if shape.get("only", tag) == tag:
                _add_shape(SubElement(link, tag), shape, coloured=tag == "visual")


def mirror_shapes(shapes: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Mirror the shapes at the plane y = 0."""
    mirrored = [dict(shape) for shape in shapes]
    for shape in mirrored:
        if "at" in shape:
            shape["at"] = opposite(shape["at"], 1)
        if "ends" in shape:
            shape["ends"] = [opposite(end, 1) for end in shape["ends"]]
    return mirrored


def _split(shape: dict[str, Any], wheel: dict[str, float]) -> Iterator[dict[str, Any]]:
    """Make boxes, cylinders and spheres of a shape."""
    if "wheel" in shape:
        yield from _wheel(shape["wheel"], wheel)
    elif "capsule" in shape:
        common = {key: shape[key] for key in ("colour", "only") if key in shape}
        yield {"cylinder": shape["capsule"], "ends": shape["ends"], **common}
        for end in shape["ends"]:
            yield {"sphere": shape["capsule"], "at": end, **common}
    else:
        yield shape


def _wheel(colours: dict[str, str], wheel: dict[str, float]) -> Iterator[dict[str, Any]]:
    """Make a sphere that rolls like the torus, and its picture: tyre, hub, and a mark that shows it turning."""
    half, tube, ring = 0.5 * wheel["width"], wheel["tube_radius"], wheel["ring_radius"]
    yield {"sphere": round(tube + ring, 6), "at": [0.0, 0.0, 0.0], "only": "collision"}

    def disc(radius: float, height: float, colour: str) -> dict[str, Any]:
        ends = [[0.0, 0.0, -height], [0.0, 0.0, height]]
        return {"cylinder": round(radius, 6), "ends": ends, "colour": colour, "only": "visual"}

    for step in STEPS:
        height = round(step * half, 6)
        yield disc(ring + math.sqrt(tube**2 - height**2), height, colours["tyre"])
    yield disc(0.6 * ring + 0.4 * tube, 1.02 * half, colours["hub"])
    across = round(2.0 * (tube + ring) + 0.002, 6)
    yield {"box": [across, 0.02, 0.03], "at": [0.0, 0.0, 0.0], "colour": colours["mark"], "only": "visual"}


def _add_shape(parent: Element, shape: dict[str, Any], coloured: bool) -> None:
    origin, geometry = SubElement(parent, "origin"), SubElement(parent, "geometry")
    if "cylinder" in shape:
        (x, y, z), (ex, ey, ez) = shape["ends"]
        dx, dy, dz = ex - x, ey - y, ez - z
        origin.set("xyz", _rounded([0.5 * (x + ex), 0.5 * (y + ey), 0.5 * (z + ez)]))
        origin.set("rpy", _rounded([0.0, math.atan2(math.hypot(dx, dy), dz), math.atan2(dy, dx)]))
        SubElement(geometry, "cylinder", radius=text(shape["cylinder"]), length=_rounded([math.hypot(dx, dy, dz)]))
    else:
        origin.set("xyz", text(shape["at"]))
        if "box" in shape:
            SubElement(geometry, "box", size=text(shape["box"]))
        else:
            SubElement(geometry, "sphere", radius=text(shape["sphere"]))
    if coloured:
        SubElement(parent, "material", name=shape["colour"])


def _rounded(values: list[float]) -> str:
    return text([round(value, 6) for value in values])
