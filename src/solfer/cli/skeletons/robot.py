"""The package of a new robot."""

import os
from pathlib import Path

from solfer.cli.skeletons.skeleton import Skeleton
from solfer.model.kinematics import Kinematics
from solfer.model.srdf.semantics import Semantics
from solfer.model.urdf.description import Description
from solfer.model.urdf.fixed_base import warn_of_fixed_base

BUNDLE = "config/robots/@NAME@"
TEMPLATES = {
    "package.xml": "package.xml",
    "CMakeLists.txt": "CMakeLists.txt",
    f"{BUNDLE}/robot.yaml": "robot.yaml",
    "config/@NAME@.yaml": "configuration.yaml",
    "launch/@NAME@.launch": "robot.launch",
    "test/test_@NAME@.py": "test_robot.py",
}
SRDF_LINES = {
    "@SRDF_FILE@": "srdf: {srdf}  # groups and named states\n",
    "@SRDF_SOURCE@": "      srdf: /robot_semantic_description\n",
    "@SRDF_PARAMETER@": '  <param name="/robot_semantic_description" textfile="$(arg folder)/{srdf}"/>\n',
}
"""What the files say of an SRDF, if there is one."""


class RobotSkeleton(Skeleton):
    """The package of a new robot, whose URDF and SRDF stay where they are.

    Args:
        name: Name of the robot.
        folder: The package's folder; its last part is the package's name.
        urdf: The URDF.
        srdf: The SRDF, if there is one.
        floating_base: Whether the base floats; None: as in the URDF.

    Attributes:
        dofs: Number of its DoFs.

    Raises:
        ConfigError: A name cannot be used, or the folder exists.
        ModelError, UnknownName: URDF or SRDF cannot be used.
    """

    def __init__(self, name: str, folder: Path, urdf: Path, srdf: Path | None, floating_base: bool | None):
        super().__init__("robot", name, folder)
        description = Description.from_file(urdf)
        warn_of_fixed_base(description, floating_base)
        kinematics = Kinematics(description, floating_base)
        self.dofs = kinematics.size
        if srdf is not None:
            Semantics.from_file(srdf, description)
        self._words = {
            "@URDF@": self._seen_from_bundle(urdf, name),
            "@FLOATING@": "true" if kinematics.base is not None else "false",
        }
        for word, line in SRDF_LINES.items():
            self._words[word] = "" if srdf is None else line.format(srdf=self._seen_from_bundle(srdf, name))
        self._words |= {"@NAME@": name, "@PACKAGE@": self.package}

    def write(self) -> None:
        """Make the folder and all files; see `Skeleton.fill`."""
        self.fill(TEMPLATES, self._words)

    def _seen_from_bundle(self, file: Path, name: str) -> str:
        return os.path.relpath(file.resolve(), self.folder.resolve() / BUNDLE.replace("@NAME@", name))
