"""A robot with joints that follow others: two fingers beside each other, and the end of a finger behind its root."""

from solfer import Robot

LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
  <inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0.01" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{type}"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="{xyz}" rpy="0.1 0.2 -0.3"/><axis xyz="{axis}"/>
  <limit lower="-3" upper="3" velocity="20" effort="50"/>{mimic}</joint>"""
LINKS = {
    "arm": "0.2 0 0",
    "hand": "0 0.1 0",
    "left": "0 0 0.3",
    "right": "0 0.1 0.3",
    "root": "0 0.2 0",
    "tip": "0.3 0 0",
}
JOINTS = (
    ("elbow", "revolute", "arm", "hand", "0 1 0", ""),
    ("spread", "revolute", "hand", "left", "1 0 0", '<mimic joint="grip" multiplier="-1.5" offset="0.1"/>'),
    ("grip", "revolute", "hand", "right", "0 0 1", ""),
    ("curl", "revolute", "arm", "root", "0 1 0", ""),
    ("bend", "prismatic", "root", "tip", "1 1 0", '<mimic joint="curl" multiplier="0.7"/>'),
    ("far", "revolute", "tip", "end", "0 1 1", '<mimic joint="bend" multiplier="2" offset="-0.2"/>'),
)
"""Names, types, links, axes and leaders; `spread` comes before its leader, `far` follows a follower."""

URDF = "".join(
    [
        '<robot name="grip">',
        LINK.format(name="world", com="0 0 0", mass=7),
        *(LINK.format(name=name, com=com, mass=index + 1) for index, (name, com) in enumerate(LINKS.items())),
        LINK.format(name="end", com="0.1 0.1 0", mass=1),
        JOINT.format(name="lift", type="prismatic", parent="world", child="arm", xyz="0 0 1", axis="0 0 1", mimic=""),
        *(
            JOINT.format(name=name, type=kind, parent=parent, child=child, xyz="0.1 0.2 0.3", axis=axis, mimic=mimic)
            for name, kind, parent, child, axis, mimic in JOINTS
        ),
        "</robot>",
    ]
)
FOLLOWERS = {"spread": ("grip", -1.5, 0.1), "bend": ("curl", 0.7, 0.0), "far": ("curl", 1.4, -0.2)}
"""Followers with their leaders, ratios and offsets."""


def load(floating_base: bool | None = None) -> Robot:
    """Load the robot."""
    return Robot.load(URDF, floating_base=floating_base)
