"""Links and joints of a URDF, read element by element; every fault of an element is collected."""

import logging
import math
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from solfer.errors import ModelError, SolferError, UnknownName

MOVING_TYPES = ("revolute", "continuous", "prismatic")
JOINT_TYPES = (*MOVING_TYPES, "fixed", "floating")
_INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")

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
        lower: Lower limit [rad, m]; None if the joint has none.
        upper: Upper limit [rad, m]; None if the joint has none.
        velocity: Velocity limit [rad/s, m/s]; None if the joint has none.
        effort: Effort limit [Nm, N]; None if the joint has none.
        mimic: The joint that it follows; None if it moves on its own.
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
    mimic: Mimic | None = None

    @property
    def moving(self) -> bool:
        """Whether the joint is one DoF (revolute, continuous, prismatic)."""
        return self.type in MOVING_TYPES


class ElementReader:
    """Reads the children of one element and collects its faults.

    Attributes:
        where: File and element, for the errors.
        faults: The errors so far, shared by all readers of a file.
    """

    def __init__(self, element: Element, where: str, faults: list[SolferError]):
        self._element, self.where, self.faults = element, where, faults

    def fault(self, what: str, expected: str = "") -> None:
        """Note a fault of this element."""
        self.faults.append(ModelError(what, where=self.where, expected=expected))

    def find(self, tag: str, required: bool = False) -> Element | None:
        """Return the only child `tag`, None without one."""
        found = self._element.findall(tag)
        if required and not found:
            self.fault(f"<{tag}> is missing")
        if len(found) > 1:
            self.fault(f"{len(found)} elements <{tag}>", expected="one")
        return found[0] if found else None

    def find_first(self, tag: str) -> Element | None:
        """Return the first child `tag`, which alone counts for other parsers, too; a warning if there are several."""
        count = len(self._element.findall(tag))
        if count > 1:
            logger.warning("%s: %d elements <%s>, of which the first counts", self.where, count, tag)
        return self._element.find(tag)

    def numbers(self, element: Element | None, attribute: str, default: Numbers | None) -> Numbers:
        """Read the numbers of an attribute, as many as in `default`; zeros and a fault where None allows no default."""
        count = 1 if default is None else len(default)
        text = None if element is None else element.get(attribute)
        if text is None:
            if element is not None and default is None:
                self.fault(f"<{element.tag}> has no '{attribute}'")
            return default or (0.0,) * count
        try:
            values = tuple(float(word) for word in text.split())
        except ValueError:
            values = ()
        if len(values) == count and all(math.isfinite(value) for value in values):
            return values
        self.fault(
            f'{element.tag} {attribute}="{text}"',
            expected="a finite number" if count == 1 else f"{count} finite numbers",
        )
        return default or (0.0,) * count


def read_link(element: Element, where: str, faults: list[SolferError]) -> LinkInfo:
    """Read a link without its joints, which only the whole tree knows."""
    reader = ElementReader(element, where, faults)
    visuals, collisions = tuple(element.findall("visual")), tuple(element.findall("collision"))
    inertial = reader.find("inertial")
    if inertial is None:
        return LinkInfo(element.get("name"), visuals=visuals, collisions=collisions)
    inside = ElementReader(inertial, f"{where}: inertial", faults)
    origin = inside.find("origin")
    (mass,) = inside.numbers(inside.find("mass", required=True), "value", None)
    if mass < 0.0:
        inside.fault(f"mass {mass:g} kg is negative")
    tensor = inside.find("inertia", required=True)
    return LinkInfo(
        element.get("name"),
        mass,
        inside.numbers(origin, "xyz", (0.0,) * 3),
        tuple(inside.numbers(tensor, entry, None)[0] for entry in _INERTIA),
        inside.numbers(origin, "rpy", (0.0,) * 3),
        visuals,
        collisions,
    )


def read_joint(element: Element, where: str, faults: list[SolferError]) -> JointInfo:
    """Read a joint; its parent and child are checked against the links by the caller."""
    reader = ElementReader(element, where, faults)
    kind = element.get("type", "")
    _check_type(kind, reader)
    parent, child = (_link_name(reader, tag) for tag in ("parent", "child"))
    origin = reader.find("origin")
    axis = reader.numbers(reader.find_first("axis"), "xyz", (1.0, 0.0, 0.0))
    length = math.hypot(*axis)
    if length == 0.0 and kind in MOVING_TYPES:
        reader.fault("the axis is zero", expected="a direction")
    return JointInfo(
        element.get("name"),
        kind,
        parent,
        child,
        reader.numbers(origin, "xyz", (0.0,) * 3),
        reader.numbers(origin, "rpy", (0.0,) * 3),
        tuple(value / (length or 1.0) for value in axis),
        mimic=_read_mimic(reader, kind),
        **_read_limits(reader, kind),
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
        reader.faults.append(UnknownName("joint type", kind, JOINT_TYPES, where=reader.where))


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
