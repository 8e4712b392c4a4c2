"""The files of a robot's meshes."""

import logging
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree.ElementTree import Element

from solfer.config.yaml.files import is_file, located
from solfer.errors import MissingDependency, SimulationError, UnknownName

PACKAGE = "package://"
logger = logging.getLogger(__name__)


class Meshes:
    """Finds the meshes that a URDF names.

    `package://NAME/...` lies in a folder NAME that holds the URDF or stands beside one that does, else in the ROS
    package NAME; a path without a scheme is relative to the URDF.

    Args:
        where: The URDF's file, or another name of its text; then only ROS packages and absolute paths lead to a file.
    """

    def __init__(self, where: str):
        self._urdf = Path(where).absolute()
        self._absent: list[str] = []

    def resolve(self, shape: Element, where: str) -> bool:
        """Make the path of a shape's mesh absolute.

        Args:
            shape: A `<visual>` or `<collision>`.
            where: Its link, for errors.

        Returns:
            False: the mesh of a `<visual>` is missing, so that it has to be left out; `warn` logs it.

        Raises:
            SimulationError: The mesh of a `<collision>` is missing.
        """
        for mesh in shape.iter("mesh"):
            name = mesh.get("filename", "")
            path = self._find(name)
            if path is not None:
                mesh.set("filename", str(path))
            elif shape.tag == "visual":
                self._absent.append(f"{where}: '{name}'")
                return False
            else:
                raise SimulationError(
                    f"the mesh '{name}' of a collision shape is not there", where=where, expected=self._expected(name)
                )
        return True

    def warn(self) -> None:
        """Log which visual shapes were left out."""
        if self._absent:
            more = f" and {len(self._absent) - 1} more" if len(self._absent) > 1 else ""
            logger.warning("visual shapes without their meshes are left out: %s%s", self._absent[0], more)

    def _find(self, name: str) -> Path | None:
        return next((path for path in self._candidates(name) if is_file(path)), None)

    def _candidates(self, name: str) -> list[Path]:
        if name.startswith("file:"):
            return [Path(unquote(urlsplit(name).path))]
        if not name.startswith(PACKAGE):
            return [self._urdf.parent / name]
        path = name.removeprefix(PACKAGE).lstrip("/")
        found = [folder / path for folder in self._urdf.parents]
        try:
            return [*found, located(PACKAGE + path, "")]
        except (MissingDependency, UnknownName):
            return found

    def _expected(self, name: str) -> str:
        if not name.startswith(PACKAGE):
            return f"the file '{self._candidates(name)[0]}'"
        package = name.removeprefix(PACKAGE).lstrip("/").split("/")[0]
        return f"the URDF inside of a folder '{package}', or a ROS package of that name"
