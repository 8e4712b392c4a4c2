"""A robot that is described by MJCF, MuJoCo's XML, as URDF and SRDF."""

import logging
import re
import warnings
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement
from xml.parsers import expat

import numpy as np

from solfer.errors import ModelError, SolferError, raise_all
from solfer.model.documents import PlacedElement, parse, read_text
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.simulation.loading.body_urdf import Transform, inertial, text_of
from solfer.simulation.mujoco.library import load_mujoco
from solfer.simulation.mujoco.mjcf_shapes import GeomWriter, placement

EFFORT = 100.0
"""Effort limit of a joint for which the MJCF has none [Nm, N]."""

VELOCITIES = {"revolute": 10.0, "continuous": 10.0, "prismatic": 1.0}
"""Velocity limits, of which MJCF has none [rad/s, m/s]."""

RANGE = 1000.0
"""Limit of a slide that has no range, which a URDF needs [m]."""

SHARE = 1e-9
"""Share of the mass behind a link between two joints of a body; none would be refused by solfer and by MuJoCo."""

FIRST_STATE = "home"
"""Keyframe in which the robot begins."""

logger = logging.getLogger(__name__)


def is_mjcf(path: Path) -> bool:
    """Return whether a file is XML with the outermost element `<mujoco>`."""
    with suppress(OSError, ElementTree.ParseError):
        for _, element in ElementTree.iterparse(path, events=("start",)):
            return element.tag == "mujoco"
    return False


def convert_mjcf(path: Path, name: str) -> dict[str, bytes]:
    """Write the robot of an MJCF as URDF; warnings name what the URDF does not have, and what was made up.

    Bodies, joints and the keyframes with names keep their names, positions of joints their values.

    Args:
        path: The MJCF.
        name: Name of the robot.

    Returns:
        Contents of files by name: `NAME.urdf`, its meshes, and `NAME.srdf` if there are keyframes or excluded contacts.

    Raises:
        MissingDependency: MuJoCo is not installed.
        ModelError: MuJoCo cannot read the file, or the robot has what a URDF cannot describe.
    """
    return _Converter(path, name).files()


class _Converter:
    def __init__(self, path: Path, name: str):
        self._mujoco = load_mujoco()
        self._name = name
        self._where = str(path)
        documents = _documents(path)
        self._places = dict(_places(documents, path.parent))
        self._model = self._compile(path, documents)
        kinds = self._mujoco.mjtObj
        self._links = self._names(kinds.mjOBJ_BODY, self._model.nbody, "link")
        self._joints = self._names(kinds.mjOBJ_JOINT, self._model.njnt, "joint")
        self._free = self._of_type(self._mujoco.mjtJoint.mjJNT_FREE)
        roots = self._model.body_rootid[self._model.jnt_bodyid]
        self._check(roots)
        self._bodies = [body for body in range(1, self._model.nbody) if self._model.body_rootid[body] in roots]
        self._geoms = GeomWriter(self._mujoco, self._model)
        self._efforts: dict[int, float] = {}
        self._leaders: dict[int, dict[str, str]] = {}

    def files(self) -> dict[str, bytes]:
        """See `convert_mjcf`."""
        self._read_actuators()
        self._read_equalities()
        robot = Element("robot", name=self._name)
        SubElement(robot, "link", name=self._links[0])
        for body in self._bodies:
            self._add_body(robot, body)
        self._warn_of_defaults()
        self._warn_of_lacks()
        made = {f"{self._name}.urdf": _bytes(robot)}
        semantics = Element("robot", name=self._name)
        semantics.extend((*self._states(), *self._excluded()))
        if len(semantics):
            made[f"{self._name}.srdf"] = _bytes(semantics)
        return made | {f"meshes/{file}": content for file, content in self._geoms.meshes.items()}

    def _compile(self, path: Path, documents: dict[str, Element]) -> Any:
        read = self._mujoco.MjSpec
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                if path.suffix.lower() == ".xml":
                    spec = read.from_file(self._where)
                else:  # of a file with another end MuJoCo reads the text alone
                    included = {name: (path.parent / name).read_bytes() for name in documents if name != path.name}
                    spec = read.from_string(read_text(path, "MJCF"), include=included)
                    spec.modelfiledir = str(path.parent)
                spec.compiler.fusestatic = False  # every body is a link
                spec.compiler.discardvisual = False
                model = spec.compile()
        except (ValueError, self._mujoco.FatalError) as error:
            reason = " ".join(str(error).split())
            place = re.search(r"line (\d+)(?:, column (\d+))?", reason)
            line = "" if place is None else "".join(f":{number}" for number in place.groups() if number)
            raise ModelError(
                f"MuJoCo cannot read the MJCF: {reason}", where=self._where + line, expected="a file that MuJoCo reads"
            ) from error
        for each in caught:
            logger.warning("%s: MuJoCo: %s", self._where, " ".join(str(each.message).split()))
        return model

    def _at(self, kind: str, name: str) -> str:
        place = self._places.get((kind, name), self._where)
        return f"{place}: {kind} '{name}'"

    def _placed(self, kind: str, name: str, more: str = "") -> str:
        """Return the name of an element, and where it is if that is known."""
        place = self._places.get((kind, name))
        return f"{name}{more} ({place})" if place else name + more

    def _names(self, kind: Any, count: int, stem: str) -> list[str]:
        """Return the names of all elements of a kind; those without get their numbers."""
        names = [self._mujoco.mj_id2name(self._model, kind, each) or "" for each in range(count)]
        for number, name in enumerate(names):
            if not name:
                names[number] = _unused(f"{stem}_{number}", names)
        return names

    def _name_of(self, kind: Any, number: int) -> str:
        return self._mujoco.mj_id2name(self._model, kind, number) or f"number {number}"

    def _of_type(self, kind: Any) -> list[int]:
        return [joint for joint in range(self._model.njnt) if self._model.jnt_type[joint] == kind]

    def _check(self, roots: np.ndarray) -> None:
        """Raise errors for what makes the robot one that a URDF cannot describe."""
        faults: list[SolferError] = []
        for joint in self._of_type(self._mujoco.mjtJoint.mjJNT_BALL):
            where = self._at("joint", self._joints[joint])
            faults.append(ModelError("ball joints are not supported", where=where, expected="three hinges in its body"))
        moving = {int(root) for root in roots}
        if not moving:
            what = "no body has a joint"
            faults.append(ModelError(what, where=self._where, expected="a robot with joints of type hinge or slide"))
        if self._free and len(moving) > 1:
            base = int(roots[self._free[0]])
            for body in sorted(moving - {base}):
                what = f"the body moves beside the robot on '{self._links[base]}', whose base floats"
                where = self._at("body", self._links[body])
                faults.append(ModelError(what, where=where, expected="a file with the robot alone"))
        if self._model.nflex:
            flex = self._mujoco.mjtObj.mjOBJ_FLEX
            flexes = ", ".join(f"'{self._name_of(flex, each)}'" for each in range(self._model.nflex))
            what = f"flexible bodies are not supported: {flexes}"
            faults.append(ModelError(what, where=self._where, expected="rigid bodies"))
        raise_all(faults)

    def _read_actuators(self) -> None:
        """Add up the limits of effort of each joint's actuators; infinite where one has none."""
        model, mujoco = self._model, self._mujoco
        of_joint = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
        unread = []
        for actuator in range(model.nactuator):
            muscle = model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_MUSCLE
            if muscle or int(model.actuator_trntype[actuator]) not in of_joint:
                unread.append(self._name_of(mujoco.mjtObj.mjOBJ_ACTUATOR, actuator))
                continue
            joint = int(model.actuator_trnid[actuator, 0])
            gear = abs(float(model.actuator_gear[actuator, 0]))
            self._efforts[joint] = self._efforts.get(joint, 0.0) + gear * self._force(actuator)
        self._warn("actuators that pull no joint, or by muscles, are left out: their joints get motors", unread)
        for joint in range(model.njnt):
            if model.jnt_actfrclimited[joint]:
                limit = float(np.abs(model.jnt_actfrcrange[joint]).max())
                self._efforts[joint] = min(self._efforts.get(joint, np.inf), limit)

    def _force(self, actuator: int) -> float:
        """Return the largest force of an actuator; infinite if nothing bounds it."""
        model, mujoco = self._model, self._mujoco
        if model.actuator_forcelimited[actuator]:
            return float(np.abs(model.actuator_forcerange[actuator]).max())
        control = model.actuator_ctrladr[actuator]
        plain = (
            model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_FIXED
            and model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
            and model.actuator_dyntype[actuator] == mujoco.mjtDyn.mjDYN_NONE
        )
        if plain and control >= 0 and model.actuator_ctrllimited[control]:
            return float(np.abs(model.actuator_ctrlrange[control]).max() * abs(model.actuator_gainprm[actuator, 0]))
        return np.inf

    def _read_equalities(self) -> None:
        """Find the joints that follow others, q - q0 = a + b (p - p0)."""
        model = self._model
        unread = []
        for number in range(model.neq):
            data = model.eq_data[number]
            joint, leader = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
            of_joints = model.eq_type[number] == self._mujoco.mjtEq.mjEQ_JOINT and model.eq_active0[number]
            if of_joints and leader >= 0 and data[1] and not data[2:5].any() and joint not in self._leaders:
                zero, other = model.qpos0[model.jnt_qposadr[[joint, leader]]].tolist()
                self._leaders[joint] = {
                    "joint": self._joints[leader],
                    "multiplier": repr(float(data[1])),
                    "offset": repr(float(zero + data[0] - data[1] * other)),
                }
            else:
                name = self._name_of(self._mujoco.mjtObj.mjOBJ_EQUALITY, number)
                of_bodies = model.eq_objtype[number] == self._mujoco.mjtObj.mjOBJ_BODY
                ends = f" of {self._links[joint]} and {self._links[leader]}" if of_bodies else ""
                unread.append(self._placed("equality", name, ends))
        self._warn(
            "equalities that are not of two joints in proportion are left out, so that loops are open: fix or remove "
            "the joints that they hold",
            unread,
        )

    def _add_body(self, robot: Element, body: int) -> None:
        """Add the joints of a body, and its link; where it has several, links of nearly no mass are between them."""
        model = self._model
        parent = self._links[model.body_parentid[body]]
        name = self._links[body]
        place = placement(model.body_pos[body], model.body_quat[body])
        first = int(model.body_jntadr[body])
        joints = range(first, first + int(model.body_jntnum[body]))
        for joint in joints:
            if joint in self._free:
                break
            anchor = model.jnt_pos[joint].copy()
            last = joint == joints[-1]
            child = name if last and not anchor.any() else _unused(f"{name}_{self._joints[joint]}", self._links)
            self._add_joint(robot, joint, (parent, child), place @ Transform(translation=anchor))
            if child != name:
                self._links.append(child)
                link = SubElement(robot, "link", name=child)
                if not last:
                    mass = SHARE * float(model.body_subtreemass[body])
                    link.append(inertial(mass, np.zeros(3), 0.01 * mass * np.eye(3)))
            parent = child
            place = Transform(translation=-anchor)
        if joints and joints[0] in self._free:
            self._connect(robot, self._joints[joints[0]], "floating", ends=(parent, name), place=place)
        elif parent != name:
            fixed = _unused(f"{name}_fixed", self._joints)
            self._connect(robot, fixed, "fixed", ends=(parent, name), place=place)
        link = SubElement(robot, "link", name=name)
        if model.body_mass[body] > 0.0:
            axes = rotation_from_quaternion(np.roll(model.body_iquat[body], -1))
            inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
            link.append(inertial(float(model.body_mass[body]), model.body_ipos[body], inertia))
        geoms = range(int(model.body_geomadr[body]), int(model.body_geomadr[body] + model.body_geomnum[body]))
        unread = [
            self._name_of(self._mujoco.mjtObj.mjOBJ_GEOM, geom) for geom in geoms if not self._geoms.write(link, geom)
        ]
        self._warn(f"geoms of '{name}' that URDF lacks are left out: replace them by boxes or meshes", unread)

    def _connect(self, robot: Element, name: str, kind: str, ends: tuple[str, str], place: Transform) -> Element:
        joint = SubElement(robot, "joint", name=name, type=kind)
        SubElement(joint, "parent", link=ends[0])
        SubElement(joint, "child", link=ends[1])
        SubElement(joint, "origin", place.origin())
        return joint

    def _add_joint(self, robot: Element, joint: int, ends: tuple[str, str], place: Transform) -> None:
        """Add a hinge or slide whose body is at `place` where its position is that of MuJoCo's `ref`."""
        model = self._model
        kind = self._kind(joint)
        axis = model.jnt_axis[joint]
        reference = float(model.qpos0[model.jnt_qposadr[joint]])
        if kind == "prismatic":
            place = place @ Transform(translation=-reference * axis)
        else:
            turn = np.array((*(-np.sin(0.5 * reference) * axis), np.cos(0.5 * reference)))
            place = place @ Transform(rotation=rotation_from_quaternion(turn))
        element = self._connect(robot, self._joints[joint], kind, ends=ends, place=place)
        SubElement(element, "axis", xyz=text_of(axis))
        effort = self._efforts.get(joint, np.inf)
        limit = SubElement(
            element, "limit", effort=repr(effort if np.isfinite(effort) else EFFORT), velocity=repr(VELOCITIES[kind])
        )
        if kind != "continuous":
            lower, upper = model.jnt_range[joint].tolist() if model.jnt_limited[joint] else (-RANGE, RANGE)
            limit.set("lower", repr(lower))
            limit.set("upper", repr(upper))
        dof = model.jnt_dofadr[joint]
        losses = {"damping": model.dof_damping[dof], "friction": model.dof_frictionloss[dof]}
        if any(losses.values()):
            SubElement(element, "dynamics", {name: repr(float(value)) for name, value in losses.items()})
        if joint in self._leaders:
            SubElement(element, "mimic", self._leaders[joint])

    def _kind(self, joint: int) -> str:
        if self._model.jnt_type[joint] == self._mujoco.mjtJoint.mjJNT_SLIDE:
            return "prismatic"
        return "revolute" if self._model.jnt_limited[joint] else "continuous"

    def _states(self) -> Iterator[Element]:
        """Yield the keyframes that have names as states, behind the group of their joints."""
        model = self._model
        joints = [joint for joint in range(model.njnt) if joint not in self._free and joint not in self._leaders]
        keys = [(model.key(key).name, key) for key in range(model.nkey) if model.key(key).name]
        if not keys or not joints:
            return
        group = Element("group", name="joints")
        for joint in joints:
            SubElement(group, "joint", name=self._joints[joint])
        yield group
        for name, key in sorted(keys, key=lambda each: each[0] != FIRST_STATE):
            state = Element("group_state", name=name, group="joints")
            for joint in joints:
                value = float(model.key_qpos[key, model.jnt_qposadr[joint]])
                SubElement(state, "joint", name=self._joints[joint], value=repr(value))
            yield state

    def _excluded(self) -> Iterator[Element]:
        """Yield the pairs of bodies of the robot that do not touch; the world cannot be one of them."""
        unread = []
        for signature in self._model.exclude_signature.tolist():
            pair = [signature >> 16, signature & 0xFFFF]
            first, second = (self._links[body] for body in pair)
            if {*pair} <= {*self._bodies}:
                yield Element("disable_collisions", link1=first, link2=second, reason="Exclude")
            else:
                unread.append(self._placed("exclude", f"{first} {second}"))
        self._warn("contacts of the robot with the world are excluded, which a URDF cannot say", unread)

    def _warn_of_defaults(self) -> None:
        """Note the limits that were made up; a follower has those of its leader."""
        model = self._model
        own = [joint for joint in range(model.njnt) if joint not in self._free and joint not in self._leaders]
        speeds = f"{VELOCITIES['revolute']:g} rad/s or {VELOCITIES['prismatic']:g} m/s"
        self._warn(f"MJCF has no velocity limits, so that {speeds} counts until you correct them", self._named(own))
        unbounded = [joint for joint in own if not np.isfinite(self._efforts.get(joint, np.inf))]
        self._warn(f"no effort limit, so that {EFFORT:g} Nm or N counts until you correct it", self._named(unbounded))
        self._warn(
            f"slides without a range, so that {RANGE:g} m counts",
            self._named(joint for joint in own if self._kind(joint) == "prismatic" and not model.jnt_limited[joint]),
        )

    def _warn_of_lacks(self) -> None:
        """Note what a URDF cannot have."""
        model = self._model
        moving = [joint for joint in range(model.njnt) if joint not in self._free]
        rotors = {joint: float(model.dof_armature[model.jnt_dofadr[joint]]) for joint in moving}
        for actuator in range(model.nactuator):
            joint = int(model.actuator_trnid[actuator, 0])
            if joint in rotors and joint in self._efforts:
                rotors[joint] += float(model.actuator_gear[actuator, 0] ** 2 * model.actuator_armature[actuator])
        self._warn(
            "armature [kg m^2, kg] is left out: write it into an actuators' file as `phi`, beside `Ks`, `D` and "
            "`Torque_limit`, with `reflect_inertia: true`",
            [f"{self._joints[joint]} {value:g}" for joint, value in rotors.items() if value],
        )
        self._warn(
            "springs of joints are left out: add them to the actuators' file",
            self._named(
                joint for joint in moving if model.jnt_stiffness[joint] or model.jnt_stiffnesspoly[joint].any()
            ),
        )
        self._warn(
            "damping that grows with the speed is left out, beside that at rest",
            [
                self._placed("joint", self._joints[joint])
                for joint in moving
                if model.dof_dampingpoly[model.jnt_dofadr[joint]].any()
            ],
        )
        self._warn(
            "gravcomp is left out: the component `compensation` carries the weight",
            [self._placed("body", self._links[body]) for body in self._bodies if model.body_gravcomp[body]],
        )
        kinds = self._mujoco.mjtObj
        dampers = np.flatnonzero(model.actuator_damping)
        self._warn(
            "damping of actuators is left out: add it to that of their joints",
            [self._placed("actuator", self._name_of(kinds.mjOBJ_ACTUATOR, int(each))) for each in dampers],
        )
        tendons = [self._name_of(kinds.mjOBJ_TENDON, each) for each in range(model.ntendon)]
        self._warn("tendons are left out: couple their joints by equalities of joints", tendons)
        plugins = [self._name_of(kinds.mjOBJ_PLUGIN, each) for each in range(model.nplugin)]
        self._warn("plugins are left out", plugins)
        kept = {0, *self._bodies}
        scene = [self._links[body] for body in range(model.nbody) if body not in kept]
        scene += [
            f"geom {self._name_of(kinds.mjOBJ_GEOM, each)}"
            for each in range(model.ngeom)
            if model.geom_bodyid[each] == 0
        ]
        self._warn(
            "what stands in the world without joints is left out: a world of solfer has grounds and boxes", scene
        )

    def _named(self, joints: Iterable[int]) -> list[str]:
        return [self._joints[joint] for joint in joints]

    def _warn(self, what: str, names: list[str]) -> None:
        if names:
            logger.warning("%s: %s: %s", self._where, what, ", ".join(names))


def _unused(name: str, used: list[str]) -> str:
    while name in used:
        name += "_"
    return name


def _bytes(document: Element) -> bytes:
    ElementTree.indent(document)
    return ElementTree.tostring(document, encoding="utf-8") + b"\n"


def _documents(path: Path) -> dict[str, Element]:
    """Parse an MJCF and the files that it includes, by their names in it, except those that are no XML."""
    found: dict[str, Element] = {}
    names = [path.name]
    for name in names:  # grows while it is walked
        with suppress(ModelError, expat.ExpatError):
            found[name] = parse(read_text(path.parent / name, "MJCF"))
            included = {each.get("file", "") for each in found[name].iter("include")}
            names += sorted(included - {*names})
    return found


def _places(documents: dict[str, Element], folder: Path) -> Iterator[tuple[tuple[str, str], str]]:
    """Yield `file:line:column` of elements by their kind and their name, or the bodies that they exclude."""
    for file, root in documents.items():
        for parent in root.iter():
            for element in parent:
                assert isinstance(element, PlacedElement)
                kind = parent.tag if parent.tag in ("equality", "tendon", "actuator") else element.tag
                place = f"{folder / file}:{element.line}:{element.column}"
                if kind == "exclude":
                    first, second = element.get("body1", ""), element.get("body2", "")
                    yield (kind, f"{first} {second}"), place
                    yield (kind, f"{second} {first}"), place
                elif element.get("name"):
                    yield (kind, element.get("name", "")), place
