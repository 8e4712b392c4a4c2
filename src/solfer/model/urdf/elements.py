"""Links and joints of a URDF, read element by element; every fault of an element is collected."""

import logging
import math
from dataclasses import dataclass, field
from xml.etree.ElementTree import Element

from solfer.errors import ModelError, SolferError, UnknownName
from solfer.model.documents import PlacedElement

MOVING_TYPES = ("revolute", "continuous", "prismatic")
"""Types of joints of one DoF."""

JOINT_TYPES = (*MOVING_TYPES, "fixed", "floating")
"""Types of joints that are supported."""

Numbers = tuple[float, ...]
logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class LinkInfo:
    """A link as the URDF describes it.

    Attributes:
        name: Name of the link.
        mass: Mass [kg], None without `<inertial>`.
        com: Centre of mass in the link's frame, 3 numbers [m], None without `<inertial>`.
        inertia: ixx, ixy, ixz, iyy, iyz, izz about the centre of mass [kg m^2], None without `<inertial>`.
        inertia_rpy: Roll, pitch, yaw of the axes of `inertia` in the link's frame [rad].
        visuals: The `<visual>` elements.
        collisions: The `<collision>` elements.
        parent: Name of the joint that carries the link, None at the root.
        children: Names of the joints that the link carries, in the order of the file.
        where: Its place, for errors.
    """

    name: str
    mass: float | None = None
    com: Numbers | None = None
    inertia: Numbers | None = None
    inertia_rpy: Numbers = (0.0, 0.0, 0.0)
    visuals: tuple[Element, ...] = ()
    collisions: tuple[Element, ...] = ()
    parent: str | None = None
    children: tuple[str, ...] = ()
    where: str = field(default="", compare=False, repr=False)

    @property
    def shapes(self) -> tuple[Element, ...]:
        """All `<visual>` and `<collision>` elements."""
        return self.visuals + self.collisions


@dataclass(frozen=True)
class Mimic:
    """The joint that another one follows: its position is `multiplier` times that of `joint`, plus `offset`.

    Attributes:
        joint: Name of the joint.
        multiplier: Ratio of the positions.
        offset: Position where that of `joint` is zero [rad, m].
    """

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class JointInfo:
    """A joint as the URDF describes it.

    Attributes:
        name: Name of the joint.
        type: One of JOINT_TYPES.
        parent: Name of the parent link.
        child: Name of the child link.
        xyz: Origin of the child link in the parent link's frame at position zero [m].
        rpy: Roll, pitch, yaw of the child link there [rad].
        axis: Unit vector of the motion in the child link's frame.
        lower: Lower limit [rad, m]; None if the joint has none, or follows another one and has no range.
        upper: Upper limit [rad, m]; None if the joint has none.
        velocity: Velocity limit [rad/s, m/s]; None if the joint has none, or follows another one and has 0.
        effort: Effort limit [Nm, N]; None if the joint has none.
        damping: Effort against the motion for each unit of its velocity [Nms/rad, Ns/m].
        friction: Effort against the motion at any velocity [Nm, N].
        mimic: The joint that it follows; None if it moves on its own.
        where: Its place, for errors.
    """

    name: str
    type: str
    parent: str
    child: str
    xyz: Numbers = (0.0, 0.0, 0.0)
    rpy: Numbers = (0.0, 0.0, 0.0)
    axis: Numbers = (1.0, 0.0, 0.0)
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None
    damping: float = 0.0
    friction: float = 0.0
    mimic: Mimic | None = None
    where: str = field(default="", compare=False, repr=False)

    @property
    def moving(self) -> bool:
        """Whether the joint is one DoF (revolute, continuous, prismatic)."""
        return self.type in MOVING_TYPES


class ElementReader:
    """Reads the children of one element and collects its faults.

    Args:
        element: The element.
        file: The file, for errors.
        name: What the element is, for errors, such as a joint with its name.
        faults: The errors so far, shared by all readers of a file.

    Attributes:
        element, faults: See above.
    """

    def __init__(self, element: Element, file: str, name: str, faults: list[SolferError]):
        self.element = element
        self._file = file
        self._name = name
        self.faults = faults

    def where(self, element: Element | None = None) -> str:
        """Return the place of the element, or of another one inside of it."""
        at = self.element if element is None else element
        assert isinstance(at, PlacedElement)
        return f"{self._file}:{at.line}:{at.column}: {self._name}"

    def inside(self, element: Element) -> "ElementReader":
        """Return a reader of a child."""
        return ElementReader(element, self._file, f"{self._name}: {element.tag}", faults=self.faults)

    def fault(self, what: str, expected: str = "", at: Element | None = None) -> None:
        """Note a fault of this element, or of another one inside of it."""
        self.faults.append(ModelError(what, where=self.where(at), expected=expected))

    def find(self, tag: str, required: bool = False) -> Element | None:
        """Return the only child `tag`, None without one."""
        found = self.element.findall(tag)
        if required and not found:
            self.fault(f"<{tag}> is missing")
        if len(found) > 1:
            self.fault(f"{len(found)} elements <{tag}>", expected="one")
        return found[0] if found else None

    def find_first(self, tag: str) -> Element | None:
        """Return the first child `tag`, which alone counts for other parsers, too; a warning if there are several."""
        count = len(self.element.findall(tag))
        if count > 1:
            logger.warning("%s: %d elements <%s>, of which the first counts", self.where(), count, tag)
        return self.element.find(tag)

    def numbers(
        self, element: Element | None, attribute: str, default: Numbers | None, above: float = -math.inf
    ) -> Numbers:
        """Read the numbers of an attribute, as many as in `default`; zeros and a fault where None allows no default.

        Args:
            element: The element, if there is one.
            attribute: Its attribute.
            default: What counts without the attribute.
            above: What each of the numbers is above.
        """
        count = 1 if default is None else len(default)
        text = None if element is None else element.get(attribute)
        if text is None:
            if element is not None and default is None:
                self.fault(f"<{element.tag}> has no '{attribute}'", at=element)
            return default or (0.0,) * count
        try:
            values = tuple(float(word) for word in text.split())
        except ValueError:
            values = ()
        if len(values) == count and all(above < value < math.inf for value in values):
            return values
        self.fault(
            f'{element.tag} {attribute}="{text}"',
            ("a finite number" if count == 1 else f"{count} finite numbers")
            + (f" above {above:g}" if math.isfinite(above) else ""),
            at=element,
        )
        return default or (0.0,) * count


def read_link(reader: ElementReader) -> LinkInfo:
    """Read a link without its joints, which only the whole tree knows."""
    element = reader.element
    visuals = tuple(element.findall("visual"))
    collisions = tuple(element.findall("collision"))
    for shape in visuals + collisions:
        _check_shape(reader.inside(shape))
    inertial = reader.find("inertial")
    if inertial is None:
        return LinkInfo(element.get("name"), visuals=visuals, collisions=collisions, where=reader.where())
    inside = reader.inside(inertial)
    origin = inside.find("origin")
    (mass,) = inside.numbers(inside.find("mass", required=True), "value", None)
    if mass < 0.0:
        inside.fault(f"mass {mass:g} kg is negative")
    tensor = inside.find("inertia", required=True)
    return LinkInfo(
        element.get("name"),
        mass,
        inside.numbers(origin, "xyz", (0.0,) * 3),
        inertia=tuple(inside.numbers(tensor, entry, None)[0] for entry in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
        inertia_rpy=inside.numbers(origin, "rpy", (0.0,) * 3),
        visuals=visuals,
        collisions=collisions,
        where=reader.where(),
    )


_SIZES = {
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
}
"""Attributes of shapes, and how many numbers each has."""

SHAPES = (*_SIZES, "mesh")
"""Shapes that a link may collide with."""


def _check_shape(reader: ElementReader) -> None:
    """Check the numbers of a shape; what is only seen may be flat."""
    collides = reader.element.tag == "collision"
    above = 0.0 if collides else -math.inf
    origin = reader.find_first("origin")
    for attribute in ("xyz", "rpy"):
        reader.numbers(origin, attribute, (0.0,) * 3)
    shapes = reader.element.findall("geometry/*")
    if collides and not (len(shapes) == 1 and shapes[0].tag in SHAPES):
        listed = ", ".join(f"<{shape.tag}>" for shape in shapes) or "nothing"
        reader.fault(f"<geometry> has {listed}", expected=f"one of {', '.join(SHAPES)}")
    for shape in shapes:
        for attribute, count in _SIZES.get(shape.tag, {}).items():
            if attribute in shape.keys():
                reader.numbers(shape, attribute, (0.0,) * count, above)
            else:
                reader.fault(f"<{shape.tag}> has no '{attribute}'", at=shape)
        if shape.tag == "mesh":
            reader.numbers(shape, "scale", (1.0,) * 3)  # a negative one mirrors the mesh


def read_joint(reader: ElementReader) -> JointInfo:
    """Read a joint; its parent and child are checked against the links by the caller."""
    element = reader.element
    kind = element.get("type", "")
    _check_type(kind, reader)
    parent, child = (_link_name(reader, tag) for tag in ("parent", "child"))
    origin = reader.find("origin")
    axis = reader.numbers(reader.find_first("axis"), "xyz", (1.0, 0.0, 0.0))
    length = math.hypot(*axis)
    if length == 0.0 and kind in MOVING_TYPES:
        reader.fault("the axis is zero", expected="a direction")
    mimic = _read_mimic(reader, kind)
    limits = _read_limits(reader, kind)
    if mimic is not None:  # files give one that they do not mean, which would bound the leader
        absent = {"lower", "upper"} if limits.get("lower") == limits.get("upper") else set()
        absent |= set() if limits.get("velocity") else {"velocity"}
        limits = {name: value for name, value in limits.items() if name not in absent}
    return JointInfo(
        element.get("name"),
        kind,
        parent,
        child=child,
        xyz=reader.numbers(origin, "xyz", (0.0,) * 3),
        rpy=reader.numbers(origin, "rpy", (0.0,) * 3),
        axis=tuple(value / (length or 1.0) for value in axis),
        mimic=mimic,
        where=reader.where(),
        **limits,
        **_read_dynamics(reader, kind),
    )


def _read_mimic(reader: ElementReader, kind: str) -> Mimic | None:
    mimic = reader.find("mimic")
    if mimic is None or kind not in MOVING_TYPES:
        return None
    joint = mimic.get("joint")
    if not joint:
        reader.fault("<mimic> has no 'joint'", expected="the name of the joint that it follows")
        return None
    (multiplier,), (offset,) = (
        reader.numbers(mimic, name, (value,)) for name, value in (("multiplier", 1.0), ("offset", 0.0))
    )
    return Mimic(joint, multiplier, offset)


def _check_type(kind: str, reader: ElementReader) -> None:
    if not kind:
        reader.fault("the joint has no type", expected=f"one of {', '.join(JOINT_TYPES)}")
    elif kind == "planar":
        reader.fault("planar joints are not supported", expected="two prismatic joints and a revolute one")
    elif kind not in JOINT_TYPES:
        reader.faults.append(UnknownName("joint type", kind, JOINT_TYPES, where=reader.where()))


def _link_name(reader: ElementReader, tag: str) -> str:
    found = reader.find(tag, required=True)
    if found is not None and not found.get("link"):
        reader.fault(f"<{tag}> has no 'link'")
    return "" if found is None else found.get("link", "")


def _read_limits(reader: ElementReader, kind: str) -> dict[str, float]:
    """Read the limits of a moving joint; `lower` and `upper` default to zero, as in the URDF specification."""
    bounded = kind in ("revolute", "prismatic")
    limit = reader.find("limit", required=bounded)
    if limit is None or kind not in MOVING_TYPES:
        return {}
    limits = {name: reader.numbers(limit, name, None)[0] for name in ("velocity", "effort")}
    for name, value in limits.items():
        if value < 0.0:
            reader.fault(f"limit {name} {value:g} is negative")
    if bounded:
        limits |= {name: reader.numbers(limit, name, (0.0,))[0] for name in ("lower", "upper")}
        if limits["lower"] > limits["upper"]:
            reader.fault(f"lower limit {limits['lower']:g} is above the upper limit {limits['upper']:g}")
    return limits


def _read_dynamics(reader: ElementReader, kind: str) -> dict[str, float]:
    """Read what is lost in a moving joint."""
    if kind not in MOVING_TYPES:
        return {}
    element = reader.find_first("dynamics")
    lost = {name: reader.numbers(element, name, (0.0,))[0] for name in ("damping", "friction")}
    for name, value in lost.items():
        if value < 0.0:
            reader.fault(f"dynamics {name} {value:g} is negative")
    return lost
