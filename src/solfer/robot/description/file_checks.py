"""Checks of the files of a robot that a configuration names, or that belong to the robot's name."""

from solfer.config import Configuration, Problems, read
from solfer.config.yaml.files import is_file
from solfer.errors import SolferError, nearest
from solfer.model.actuators import ActuatorsRecord
from solfer.robot.description.shipped import RobotFiles, robot_files, robots_beside
from solfer.robot.description.sources import is_robot_read, require_robot


def checked_files(configuration: Configuration, problems: Problems, robot: RobotFiles | None) -> RobotFiles | None:
    """Find the files of the robot; None if there are none, or if they are wrong."""
    urdf = configuration.tree.nearest((configuration.section, "source", "urdf")).head
    if _lacks_files(configuration):
        return None
    try:
        files = robot or robot_files(configuration)
        if files is not None:
            files.names()
            return files
    except SolferError as error:
        problems.put(urdf, error.at(str(urdf)))
        return None
    if _check_robot(configuration, problems):
        return None
    name = configuration.tree.get("robot", "name")
    close = nearest(str(name.value), robots_beside(configuration.file)) if name else ()
    what = "the robot has no files here, so names of its groups, links and joints are not checked"
    if name is not None and close:
        problems.warn(name.mark, f"{what}; did you mean {' or '.join(close)}?")
    else:
        problems.warn(urdf, f"{what}; a URDF and an SRDF make it possible")
    return None


def _lacks_files(configuration: Configuration) -> bool:
    """Whether a file of the model or its groups is not there, which was reported when the configuration was read."""
    sources = configuration.sources
    named = (sources.urdf, sources.srdf) if sources is not None else ()
    paths = [source.location for source in named if source is not None and source.location is not None]
    return not all(is_file(path) for path in paths)


def _check_robot(configuration: Configuration, problems: Problems) -> bool:
    """Check that the files of actuators and contacts know the robot; return whether one does not."""
    sources = configuration.sources
    for source in (sources.actuators, sources.contacts) if sources is not None and is_robot_read(configuration) else ():
        if source is not None and source.location is not None and is_file(source.location):
            try:
                require_robot(configuration, source.location)
            except SolferError as error:
                problems.put(source.place(), error.at(str(source.place())))
                return True
    return False


def check_actuators(configuration: Configuration, problems: Problems) -> None:
    """Check that the file of the actuators knows the robot, whose joints are not known."""
    source = configuration.sources.actuators if configuration.sources else None
    robot = configuration.robot
    if source is None or source.file is None or robot is None or not robot.actuators.read:
        return
    if not is_robot_read(configuration):
        return
    try:
        require_robot(configuration, source.location)
        read(source.location, ActuatorsRecord, (robot.name,))
    except SolferError as error:
        mark = source.place()
        problems.put(mark, error.at(str(mark)))
