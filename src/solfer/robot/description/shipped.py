"""A configuration's robot without a master: from files instead of parameters."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

from solfer.config import Configuration, Problems, SourceRecord
from solfer.config.yaml.files import is_file, located, read_node, read_text
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.packages import shipped_folder
from solfer.errors import ConfigError, SolferError, UnknownName
from solfer.model import Description, Kinematics, Semantics
from solfer.model.urdf.cut import cut
from solfer.robot.defaults import ALL
from solfer.robot.names import RobotNames


@dataclass(frozen=True)
class Cut:
    """A part of a robot that is a robot of its own.

    Attributes:
        name: Name of the part.
        link: Link above the cut.
        keep: 'upper' or 'lower': what stays.
    """

    name: str
    link: str
    keep: str


@dataclass(frozen=True)
class ControllerGroups:
    """The joints of a lower-level controller.

    Attributes:
        name: Name of the controller.
        group: Group of the SRDF, or `all`.
        without: Group that it leaves out, if there is one.
    """

    name: str
    group: str
    without: str | None


@dataclass(frozen=True)
class RobotFiles:
    """The files that describe a robot.

    Attributes:
        urdf: Links and joints.
        srdf: Groups and named states, if there are any.
        others: URDFs of models that may have names that the first one does not have.
        actuators: Actuators, if its bundle names them.
        contacts: Contacts, if its bundle names them.
        parts: Parts that its bundle cuts it into.
        controllers: Lower-level controllers of its bundle; empty: they are not known.
        measured: Topics of what its simulation measures, but for contacts; empty: they are not known.
        floating_base: Whether its bundle lets the base float; None: as in the URDF.
    """

    urdf: Path
    srdf: Path | None = None
    others: tuple[Path, ...] = ()
    actuators: Path | None = None
    contacts: Path | None = None
    parts: tuple[Cut, ...] = ()
    controllers: tuple[ControllerGroups, ...] = ()
    measured: tuple[str, ...] = ()
    floating_base: bool | None = None

    def names(self) -> RobotNames:
        """Read the names in these files.

        Raises:
            SolferError: A file cannot be read, or does not contain a robot.
        """
        return _names(self)

    def kinematics(self) -> Kinematics:
        """Read links and joints, and the base that its bundle decides."""
        return _kinematics(read_text(str(self.urdf)), self.floating_base)

    def part(self, part: Cut) -> str:
        """Return the URDF of a part."""
        return _cut(read_text(str(self.urdf)), part.link, part.keep)

    def driven(self, controller: ControllerGroups | None) -> tuple[str, ...]:
        """Return the joints of a lower-level controller; None: all that move."""
        kinematics = self.kinematics()
        moving = kinematics.dofs[0 if kinematics.base is None else 6 :]
        if controller is None:
            return moving
        left_out = self._members(controller.without, moving) if controller.without else ()
        members = self._members(controller.group, moving)
        return tuple(joint for joint in moving if joint in members and joint not in left_out)

    def _members(self, group: str, moving: tuple[str, ...]) -> tuple[str, ...]:
        """Return the joints of a group; all that move where it is not known."""
        known = {} if self.srdf is None else _semantics(read_text(str(self.srdf)), read_text(str(self.urdf))).groups
        return known[group].joints if group != ALL and group in known else moving


@lru_cache(maxsize=4)
def _kinematics(urdf: str, floating_base: bool | None) -> Kinematics:
    return Kinematics(Description.from_text(urdf, "URDF"), floating_base)


@lru_cache(maxsize=4)
def _semantics(srdf: str, urdf: str) -> Semantics:
    return Semantics.from_text(srdf, Description.from_text(urdf, "URDF"))


@lru_cache(maxsize=8)
def _cut(urdf: str, link: str, keep: str) -> str:
    return cut(Description.from_text(urdf, "URDF"), link, keep)


@cache
def _names(files: RobotFiles) -> RobotNames:
    return RobotNames.of_files(files.urdf, files.srdf, files.others)


def robot_files(configuration: Configuration) -> RobotFiles | None:
    """Return the files that a configuration names, else those of the shipped robot `robot.name`; None without both.

    A parameter may contain a part of the robot: the files describe the whole, which has the names of its parts.

    Raises:
        SolferError: A file that is named is not there.
    """
    sources = configuration.sources or SourceRecord()
    urdf, srdf = (None if source is None else source.location for source in (sources.urdf, sources.srdf))
    if urdf is not None and (sources.srdf is None or srdf is not None):
        models = [record.urdf for record in configuration.mappings.values() if record.urdf is not None]
        others = [model.location for model in models if model.location is not None]
        return RobotFiles(urdf, srdf, tuple(path for path in others if path != urdf and is_file(path)))
    bundle = _bundle(_robot_name(configuration), _folders(configuration.file))
    return bundle if bundle is not None or urdf is None else RobotFiles(urdf)


def bundle_of(configuration: Configuration) -> Path | None:
    """Return the bundle of the robot `robot.name`, or the URDF that a configuration names; None without both."""
    found = _bundle_file(_robot_name(configuration), _folders(configuration.file))
    files = robot_files(configuration) if found is None else None
    return files.urdf if files is not None else found


def with_bundled_base(configuration: Configuration, description: Description) -> Description:
    """Return a description with the base that `floating_base` of the bundle of the robot `robot.name` decides.

    A part of the robot with another root has a base of its own, and stays as it is.
    """
    path = _bundle_file(_robot_name(configuration), _folders(configuration.file))
    files = None if path is None else _read_bundle(path)
    if files is None or files.floating_base is None:
        return description
    return description.with_base(files.floating_base) if description.root == _root(files.urdf) else description


@cache
def _root(urdf: Path) -> str:
    return Description.from_file(urdf).root


def robot_named(name: str) -> RobotFiles:
    """Find the files of a robot that solfer ships.

    Raises:
        UnknownName: There is no such robot.
    """
    folders = tuple(_shipped())
    bundle = _bundle(name, folders)
    if bundle is None:
        raise UnknownName("robot", name, shipped_robots())
    return bundle


def robot_of(robot: str) -> tuple[str, RobotFiles]:
    """Find name and files of a robot: one that solfer ships, or the one whose bundle a path names.

    Raises:
        UnknownName: There is no such robot.
        SolferError: The bundle cannot be read.
    """
    path = Path(robot)
    return (path.absolute().parent.name, _read_bundle(path)) if is_file(path) else (robot, robot_named(robot))


def robots_beside(main: str) -> tuple[str, ...]:
    """Return the names of the robots beside a main configuration and of those that solfer ships."""
    return _names_in(_folders(main))


def shipped_robots() -> tuple[str, ...]:
    """Return the names of the robots that solfer ships."""
    return _names_in(_shipped())


def _robot_name(configuration: Configuration) -> str:
    name = configuration.tree.get("robot", "name")
    return name.value if name and isinstance(name.value, str) else ""


def _names_in(folders: Iterable[Path]) -> tuple[str, ...]:
    return tuple(sorted({path.parent.name for folder in folders for path in folder.glob("*/robot.yaml")}))


def _bundle(name: str, folders: Iterable[Path]) -> RobotFiles | None:
    """Find the files of a robot in the first of some folders that has it."""
    path = _bundle_file(name, folders)
    return None if path is None else _read_bundle(path)


def _bundle_file(name: str, folders: Iterable[Path]) -> Path | None:
    return next((path for each in folders if name and is_file(path := each / name / "robot.yaml")), None)


def _read_bundle(path: Path) -> RobotFiles:
    """Read what a bundle names; the simulation, which knows the record of a bundle, checks it."""
    node = read_node(path, Problems())
    keys = ("urdf", "srdf", "actuators", "contacts")
    urdf, srdf, actuators, contacts = (_file(node.get(key), path.parent) for key in keys)
    if urdf is None:
        raise ConfigError("the robot names no file as its 'urdf'", where=str(node.head), expected="urdf: FILE")
    controllers = [
        ControllerGroups(name, _word(each, "group") or ALL, _word(each, "except") or None)
        for name, each in _entries(node, "controllers")
    ]
    parts = [Cut(name, _word(each, "at"), _word(each, "keep")) for name, each in _entries(node, "parts")]
    measured = tuple(_measured(node, actuators is not None))
    base = node.get("floating_base")
    floating = base.value if base is not None and isinstance(base.value, bool) else None
    return RobotFiles(
        urdf,
        srdf,
        (),
        actuators=actuators,
        contacts=contacts,
        parts=tuple(parts),
        controllers=tuple(controllers),
        measured=measured,
        floating_base=floating,
    )


def _measured(node: YamlNode, has_motors: bool) -> Iterator[str]:
    yield "joint_states"
    base = node.get("floating_base")
    if base is None or base.value is not False:
        yield "floating_base"
    if has_motors:
        yield "motor_states"
    if node.get("sensors", "imu") is not None:
        yield "imu"


def _file(node: YamlNode | None, folder: Path) -> Path | None:
    return located(node.value, folder) if node is not None and isinstance(node.value, str) else None


def _entries(node: YamlNode, key: str) -> Iterator[tuple[str, YamlNode]]:
    found = node.get(key)
    return iter(()) if found is None else found.items()


def _word(node: YamlNode, key: str) -> str:
    found = node.get(key)
    return found.value if found is not None and isinstance(found.value, str) else ""


def _folders(main: str) -> Iterator[Path]:
    """Yield the folders of robots: beside the main configuration, then those that solfer ships."""
    yield Path(main).absolute().parent / "robots"
    yield from _shipped()


def _shipped() -> Iterator[Path]:
    own = shipped_folder()
    if own is not None:
        yield own / "config" / "robots"
    try:
        yield located("package://solfer/config/robots", "")
    except SolferError:
        return  # ROS does not know the package: then what lies beside the code is all there is
