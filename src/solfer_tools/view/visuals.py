"""What the links of a robot look like."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
import trimesh
from trimesh import creation

from solfer.model.documents import PlacedElement, parse
from solfer.model.urdf.description import Description
from solfer.model.urdf.mesh_files import find_mesh, unit_of
from solfer.numerics.rotations import rotation_from_rpy

DEFAULT_GREY = (0.7, 0.7, 0.7, 1.0)

logger = logging.getLogger(__name__)

Color = tuple[float, float, float, float]
"""Red, green, blue, and opacity, each from 0 to 1."""


@dataclass(frozen=True, eq=False)
class Visual:
    """A surface in the frame of a link.

    Attributes:
        mesh: Its triangles [m].
        color: Its colour.
    """

    mesh: trimesh.Trimesh
    color: Color


def visuals_of(description: Description) -> dict[str, list[Visual]]:
    """Make what is seen of each link, one surface for each colour; collision shapes where a link has nothing else.

    Shapes that cannot be read are left out, and logged; so is a colour that is none.
    """
    robot = parse(description.text)
    materials = {each.get("name", ""): each for each in robot.findall("material")}
    found: dict[str, list[Visual]] = {}
    absent: list[str] = []
    wrong: list[str] = []
    for name, link in description.links.items():
        parts: dict[Color, list[trimesh.Trimesh]] = {}
        for shape in link.visuals or link.collisions:
            meshes = list(_meshes(shape, description.where, absent))
            if meshes:
                color, fault = _color(shape, materials)
                parts.setdefault(color, []).extend(meshes)
                wrong += [f"{description.where}:{fault}: link '{name}'"] if fault else []
        found[name] = [Visual(_one(meshes), color) for color, meshes in parts.items()]
    _warn("shapes that cannot be read are left out", absent)
    _warn("a colour has four numbers from 0 to 1", wrong)
    return found


def _warn(what: str, named: list[str]) -> None:
    if named:
        more = f" and {len(named) - 1} more" if len(named) > 1 else ""
        logger.warning("%s: %s%s", what, named[0], more)


def _one(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    joined = trimesh.util.concatenate(meshes)
    assert isinstance(joined, trimesh.Trimesh)
    return joined


def _meshes(shape: Element, where: str, absent: list[str]) -> Iterator[trimesh.Trimesh]:
    for geometry in shape.findall("geometry/*"):
        try:
            mesh = _mesh(geometry, where)
            mesh.apply_transform(_place(shape.find("origin")))
        except Exception:  # whatever a reader of a format raises
            absent.append(geometry.get("filename", geometry.tag))
            continue
        yield mesh


def _place(origin: Element | None) -> np.ndarray:
    """Return the transform of an origin, shape (4, 4)."""
    place = np.eye(4)
    if origin is not None:
        place[:3, :3] = rotation_from_rpy(_numbers(origin, "rpy", (0.0, 0.0, 0.0)))
        place[:3, 3] = _numbers(origin, "xyz", (0.0, 0.0, 0.0))
    return place


def _mesh(geometry: Element, where: str) -> trimesh.Trimesh:
    """Make a shape.

    Raises:
        Exception: It cannot be made, whatever its reader raises then.
    """
    if geometry.tag == "box":
        return creation.box(_numbers(geometry, "size"))
    if geometry.tag == "sphere":
        return creation.icosphere(2, *_numbers(geometry, "radius"))
    if geometry.tag in ("cylinder", "capsule"):
        (radius,) = _numbers(geometry, "radius")
        (length,) = _numbers(geometry, "length")
        return creation.cylinder(radius, length) if geometry.tag == "cylinder" else creation.capsule(length, radius)
    path = find_mesh(where, geometry.get("filename", ""))
    if path is None:
        raise ValueError
    mesh = trimesh.load_mesh(path)
    scale = np.eye(4)
    scale[(0, 1, 2), (0, 1, 2)] = unit_of(path) * np.array(_numbers(geometry, "scale", (1.0, 1.0, 1.0)))
    mesh.apply_transform(scale)
    return mesh


def _color(shape: Element, materials: dict[str, Element]) -> tuple[Color, str]:
    """Return the colour of a shape, and the place and the text of its numbers where they are none; else empty."""
    own = shape.find("material")
    if own is None:
        return DEFAULT_GREY, ""
    color = own.find("color")
    if color is None:
        named = materials.get(own.get("name", ""))
        color = None if named is None else named.find("color")
    text = None if color is None else color.get("rgba")
    if text is None:
        return DEFAULT_GREY, ""
    try:
        numbers = np.array(text.split(), dtype=float)
    except ValueError:
        numbers = np.empty(0)
    assert isinstance(color, PlacedElement)
    fault = f'{color.line}:{color.column}: rgba="{text}"'
    if len(numbers) not in (3, 4) or not np.isfinite(numbers).all():
        return DEFAULT_GREY, fault
    red, green, blue, opacity = (*np.clip(numbers, 0.0, 1.0).tolist(), 1.0)[:4]
    is_right = len(numbers) == 4 and numbers.min() >= 0.0 and numbers.max() <= 1.0
    return (red, green, blue, opacity), "" if is_right else fault


def _numbers(element: Element, attribute: str, default: tuple[float, ...] = ()) -> list[float]:
    text = element.get(attribute)
    return list(default) if text is None else [float(each) for each in text.split()]
