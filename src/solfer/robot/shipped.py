"""Names of a configuration's robot without a master: from files instead of parameters."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from solfer.config import Configuration, Problems, SourceRecord
from solfer.config.files import located, read_node
from solfer.errors import ConfigError, SolferError, UnknownName
from solfer.robot.names import RobotNames

_REPOSITORY = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class RobotFiles:
    """The files that describe a robot.

    Attributes:
        urdf: Links and joints.
        srdf: Groups and named states, if there are any.
        others: URDFs of models that may have what the first one has not.
    """

    urdf: Path
    srdf: Path | None = None
    others: tuple[Path, ...] = ()

    def names(self) -> RobotNames:
        """The names in these files.

        Raises:
            SolferError: A file cannot be read, or holds no robot.
        """
        return _names(self)


@cache
def _names(files: RobotFiles) -> RobotNames:
    return RobotNames.of_files(files.urdf, files.srdf, files.others)


def robot_files(configuration: Configuration) -> RobotFiles | None:
    """The files that a configuration names, else those of the robot `robot.name` that solfer ships; None without both.

    A parameter may hold a part of the robot: the files describe the whole, which has the names of its parts.

    Raises:
        SolferError: A file that is named is not there.
    """
    sources = configuration.sources or SourceRecord()
    urdf, srdf = (None if source is None else source.location for source in (sources.urdf, sources.srdf))
    if urdf is not None and (sources.srdf is None or srdf is not None):
        models = [record.urdf for record in configuration.mappings.values() if record.urdf is not None]
        others = [model.location for model in models if model.location is not None]
        return RobotFiles(urdf, srdf, tuple(path for path in others if path != urdf and path.is_file()))
    name = configuration.tree.get("robot", "name")
    bundle = _bundle(name.value if name and isinstance(name.value, str) else "", _folders(configuration.file))
    return bundle if bundle is not None or urdf is None else RobotFiles(urdf)


def robot_named(name: str) -> RobotFiles:
    """The files of a robot that solfer ships.

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
    """The files of a robot in the first of some folders that has it."""
    for folder in folders:
        path = folder / name / "robot.yaml"
        if name and path.is_file():
            node = read_node(path, Problems())
            urdf, srdf = node.get("urdf"), node.get("srdf")
            if urdf is None or not isinstance(urdf.value, str):
                raise ConfigError("the robot names no file as its 'urdf'", where=str(node.head))
            has_srdf = srdf is not None and isinstance(srdf.value, str)
            return RobotFiles(located(urdf.value, path.parent), located(srdf.value, path.parent) if has_srdf else None)
    return None


def _folders(main: str) -> Iterator[Path]:
    """Where robots are looked for: beside the main configuration, then among those that solfer ships."""
    yield Path(main).absolute().parent / "robots"
    yield from _shipped()


def _shipped() -> Iterator[Path]:
    yield _REPOSITORY / "config" / "robots"
    try:
        yield located("package://solfer/config/robots", "")
    except SolferError:
        return  # neither built nor installed: then the repository is all there is
