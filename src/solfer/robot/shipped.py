"""Names of a configuration's robot without a master: from files instead of parameters."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from solfer.config import Configuration, Problems, SourceRecord
from solfer.config.yaml.files import is_file, located, read_node
from solfer.config.yaml.packages import shipped_folder
from solfer.errors import ConfigError, SolferError, UnknownName
from solfer.robot.names import RobotNames


@dataclass(frozen=True)
class RobotFiles:
    """The files that describe a robot.

    Attributes:
        urdf: Links and joints.
        srdf: Groups and named states, if there are any.
        others: URDFs of models that may have names that the first one does not have.
    """

    urdf: Path
    srdf: Path | None = None
    others: tuple[Path, ...] = ()

    def names(self) -> RobotNames:
        """Read the names in these files.

        Raises:
            SolferError: A file cannot be read, or does not contain a robot.
        """
        return _names(self)


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
    name = configuration.tree.get("robot", "name")
    bundle = _bundle(name.value if name and isinstance(name.value, str) else "", _folders(configuration.file))
    return bundle if bundle is not None or urdf is None else RobotFiles(urdf)


def robot_named(name: str) -> RobotFiles:
    """Find the files of a robot that solfer ships.

    Raises:
        UnknownName: There is no such robot.
    """
    folders = tuple(_shipped())
    bundle = _bundle(name, folders)
    if bundle is None:
        known = sorted({path.parent.name for folder in folders for path in folder.glob("*/robot.yaml")})
        raise UnknownName("robot", name, known)
    return bundle


def _bundle(name: str, folders: Iterable[Path]) -> RobotFiles | None:
    """Find the files of a robot in the first of some folders that has it."""
    for folder in folders:
        path = folder / name / "robot.yaml"
        if name and is_file(path):
            node = read_node(path, Problems())
            urdf, srdf = node.get("urdf"), node.get("srdf")
            if urdf is None or not isinstance(urdf.value, str):
                raise ConfigError("the robot names no file as its 'urdf'", where=str(node.head))
            named = srdf.value if srdf is not None else None
            beside = located(named, path.parent) if isinstance(named, str) else None
            return RobotFiles(located(urdf.value, path.parent), beside)
    return None


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
