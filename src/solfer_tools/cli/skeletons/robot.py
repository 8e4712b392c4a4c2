"""The package of a new robot."""

import os
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from xml.sax.saxutils import escape

from solfer.errors import ConfigError
from solfer.model.documents import read_text
from solfer.model.kinematics import Kinematics
from solfer.model.neutral_posture import neutral_posture
from solfer.model.srdf.semantics import Semantics
from solfer.model.urdf.description import Description
from solfer.model.urdf.fixed_base import warn_of_fixed_base
from solfer.model.urdf.unfit import check_masses, warn_of_unfit
from solfer.robot.description.shipped import shipped_robots
from solfer_tools.cli.skeletons.skeleton import Skeleton, scalar

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
    "@SRDF_PARAMETER@": '  <param name="/robot_semantic_description" textfile="$(arg folder)/{file}"/>\n',
}
"""What the files say of an SRDF, if there is one."""

BASE_PARTS = {
    "@BASE_ROBOT@": """
    standing:  # the joints, and where the base is
      feedback:
        list: [link_side_online, base]
      actuators:
        read: false
      contacts:
        read: false
""",
    "@BASE_FEEDBACK@": """
    base:  # pose and velocity of the base
      space: OPERATIONAL
      convention:
        orientation: {{type: QUATERNION, convention: HAMILTONIAN}}
        position: {{type: FULL}}
      dofs: {{chain: all, type: body, name: {base}, mapping: RBDL}}
      interface: {{position: true, velocity: true}}
""",
    "@BASE_SOURCE@": """      base:
        source: floating_base  # only a simulation knows it; on the robot, name the topic of an estimate
        message: nav_msgs/Odometry
        initialize: true
""",
}
"""What the files say of a floating base, if there is one."""

MODULE = """
    inverse_kinematics:  # moves {what}, asked by the service inverse_kinematics/reference
      layer: NRT
      robot: {robot}
      controller: direct
      mode: full
      kinematics: false  # it has a model of its own, which is where the commands are
      dynamics: false
      model_change: false
      deflection: {{time_constant: 0.5}}  # joints give way under the weight
{stack}"""
"""The module of tasks: of a base above its feet, or of the tip of an arm."""

BASE_STACK = """\
      motions: {{base: {{speed: 0.1, acceleration: 0.3, turn_speed: 0.3, turn_acceleration: 1.0}}}}  # feet do not slip
      stack:
        tasks:
          feet: {{point: {foot}, link: [{feet}], gain: 10}}
          base: {{point: pose, link: {base}, gain: 5}}
          posture: {{point: posture, gain: 0.5, weight: 0.0001}}
        levels:
          - [feet]
          - [base, posture]
"""

TIP_STACK = """\
      stack:
        tasks:
          tip: {{point: position, link: {tip}, gain: 10}}
          posture: {{point: posture, gain: 0.5, weight: 0.0001}}
        levels:
          - [tip, posture]
"""


class RobotSkeleton(Skeleton):
    """The package of a new robot, whose URDF and SRDF stay where they are unless they are made for it.

    Args:
        name: Name of the robot.
        folder: The package's folder; its last part is the package's name.
        urdf: The URDF.
        srdf: The SRDF, if there is one.
        floating_base: Whether the base floats; None: as in the URDF.
        made: Contents of files that are put beside `robot.yaml`, by name; `urdf` and `srdf` may be two of them.

    Attributes:
        dofs: Number of its DoFs.
        bundle: Its bundle, once it is written.

    Raises:
        ConfigError: A name cannot be used, or the folder exists.
        ModelError, UnknownName: URDF or SRDF cannot be used.
    """

    def __init__(
        self,
        name: str,
        folder: Path,
        urdf: Path,
        srdf: Path | None,
        floating_base: bool | None,
        *,
        made: Mapping[str, bytes] = MappingProxyType({}),
    ):
        super().__init__("robot", name, folder)
        if name in shipped_robots():
            raise ConfigError(f"'{name}' is a robot that solfer ships", expected="another name")
        self.bundle = folder / BUNDLE.replace("@NAME@", name) / "robot.yaml"
        self._made = {self.bundle.parent / file: content for file, content in made.items()}
        urdf = self._place(urdf)
        description = Description.from_text(self._text(urdf, "URDF"), where=str(urdf))
        warn_of_fixed_base(description, floating_base)
        kinematics = Kinematics(description, floating_base)
        check_masses(description, kinematics.base is not None)
        warn_of_unfit(description, kinematics.base is not None)
        self.dofs = kinematics.size
        if srdf is not None:
            srdf = self._place(srdf)
            Semantics.from_text(self._text(srdf, "SRDF"), description, where=str(srdf))
        seen = self._seen_from_bundle(urdf)
        quotes = {'"': "&quot;"}
        self._words = {
            "@URDF@": scalar(seen),
            "@URDF_FILE@": escape(seen, quotes),
            "@FLOATING@": "true" if kinematics.base is not None else "false",
        }
        feet = feet_of(kinematics)
        base = scalar(kinematics.base_link or "")
        tip = tip_of(kinematics)
        for word, part in BASE_PARTS.items():
            self._words[word] = part.format(base=base) if feet else ""
        if feet:
            foot = "pose" if len(feet) < 3 else "position"  # few feet carry a robot by their soles
            stack = BASE_STACK.format(base=base, feet=", ".join(map(scalar, feet)), foot=foot)
            module = {"what": "the base above its feet", "robot": "standing", "stack": stack}
        else:
            stack = TIP_STACK.format(tip=scalar(tip or ""))
            module = {"what": "the tip of an arm", "robot": "whole_body", "stack": stack}
        self._words["@TASKS@"] = f", and inverse_kinematics {module['what']}" if feet or tip else ""
        self._words["@TASKS_MODULE@"] = MODULE.format(**module) if feet or tip else ""
        seen = "" if srdf is None else self._seen_from_bundle(srdf)
        for word, line in SRDF_LINES.items():
            self._words[word] = line.format(srdf=scalar(seen), file=escape(seen, quotes)) if seen else ""
        self._words |= {"@NAME@": name, "@PACKAGE@": self.package}

    def write(self) -> None:
        """Make the folder and all files; see `Skeleton.fill`."""
        self.fill(TEMPLATES, self._words, self._made)

    def _place(self, file: Path) -> Path:
        """Return where a file is, or will be if it is made."""
        place = self.bundle.parent / file
        return place if place in self._made else file

    def _text(self, file: Path, kind: str) -> str:
        return self._made[file].decode() if file in self._made else read_text(file, kind)

    def _seen_from_bundle(self, file: Path) -> str:
        return os.path.relpath(file.resolve(), self.bundle.parent.resolve())


def feet_of(kinematics: Kinematics) -> list[str]:
    """Return the lowest links of a robot with a floating base in its neutral posture, one of each leg; else none."""
    base = kinematics.base_link
    if base is None:
        return []
    description = kinematics.description
    kinematics.update(neutral_posture(kinematics))
    heights = {link: kinematics.position(link)[2] for link in description.subtree(base)}
    lowest = min(heights.values())
    highest = lowest + 0.1 * (heights[base] - lowest)  # of a foot
    # of links that are fixed to each other the lowest one counts
    tips = {_last_joint(description, link): link for link in sorted(heights, key=lambda each: -heights[each])}
    inner = {_last_joint(description, joint.parent) for joint in description.moving_joints}
    return [tip for joint, tip in tips.items() if joint and joint not in inner and heights[tip] <= highest]


def tip_of(kinematics: Kinematics) -> str | None:
    """Return the last link of the longest chain of moving joints of a robot with a fixed base; None: it floats."""
    description = kinematics.description
    if kinematics.base_link is not None or not description.moving_joints:
        return None
    links = [joint.child for joint in description.moving_joints]
    return max(links, key=lambda link: _depth(description, link))


def _depth(description: Description, link: str) -> int:
    """Return how many moving joints are above a link."""
    joint = _last_joint(description, link)
    return 1 + _depth(description, description.joints[joint].parent) if joint else 0


def _last_joint(description: Description, link: str) -> str:
    """Return the moving joint next above a link; empty: there is none."""
    name = description.links[link].parent
    while name is not None and not description.joints[name].moving:
        name = description.links[description.joints[name].parent].parent
    return name or ""
