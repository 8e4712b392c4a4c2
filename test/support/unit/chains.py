"""Robots of many joints."""

from collections.abc import Callable, Sequence

LINK = (
    '<link name="link_{index}"><inertial><origin xyz="0.05 0.01 0"/><mass value="1"/>'
    '<inertia ixx="0.01" iyy="0.012" izz="0.014" ixy="0.001" ixz="0" iyz="0"/></inertial></link>'
)
JOINT = (
    '<joint name="joint_{index}" type="{kind}"><parent link="link_{parent}"/><child link="link_{index}"/>'
    '<origin xyz="0.1 0 0.02" rpy="0.1 0 0"/><axis xyz="{axis}"/>'
    '<limit lower="-1" upper="1" velocity="1" effort="10"/></joint>'
)
AXES = ("0 0 1", "0 1 0", "1 2 0")


def chain(
    size: int, parent: Callable[[int], int] = lambda index: index - 1, kinds: Sequence[str] = ("revolute",)
) -> str:
    """Write the URDF of a robot of `size` joints: link k, from 1 on, hangs on link `parent(k)`; kinds take turns."""
    parts = ['<robot name="chain"><link name="link_0"/>']
    for index in range(1, size + 1):
        kind, axis = kinds[index % len(kinds)], AXES[index % len(AXES)]
        parts += LINK.format(index=index), JOINT.format(index=index, kind=kind, parent=parent(index), axis=axis)
    return "\n".join(parts) + "</robot>"
