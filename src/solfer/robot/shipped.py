"""Names of a configuration's robot without a master: from files instead of parameters."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from solfer.config import Configuration, Problems
from solfer.config.files import located, read_node
from solfer.errors import ConfigError, SolferError
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
    sources = configuration.sources
    urdf, srdf = sources.urdf.location, None if sources.srdf is None else sources.srdf.location
    if urdf is not None and (sources.srdf is None or srdf is not None):
        models = [record.urdf for record in configuration.mappings.values() if record.urdf is not None]
        others = [model.location for model in models if model.location is not None]
        return RobotFiles(urdf, srdf, tuple(path for path in others if path != urdf and path.is_file()))
    bundle = _bundle(configuration)
    return bundle if bundle is not None or urdf is None else RobotFiles(urdf)


def _bundle(configuration: Configuration) -> RobotFiles | None:
    """The files of a robot beside the main configuration, or of one that solfer ships."""
    for folder in _folders(configuration.file):
        path = folder / configuration.robot.name / "robot.yaml"
        if configuration.robot.name and path.is_file():
            node = read_node(path, Problems())
            urdf, srdf = node.get("urdf"), node.get("srdf")
            if urdf is None or not isinstance(urdf.value, str):
                raise ConfigError("the robot names no file as its 'urdf'", where=str(node.head))
            has_srdf = srdf is not None and isinstance(srdf.value, str)
            return RobotFiles(located(urdf.value, path.parent), located(srdf.value, path.parent) if has_srdf else None)
    return None


def _folders(main: str) -> Iterator[Path]:
    yield Path(main).absolute().parent / "robots"
    yield _REPOSITORY / "config" / "robots"
    try:
        yield located("package://solfer/config/robots", "")
    except SolferError:
        return  # neither built nor installed: then the repository is all there is
