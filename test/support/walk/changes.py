"""Changes of tags, and what is run with and without them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from support.walk import benches
from support.walk.files import SPRING

MAIN, ROBOT, IN, OUT = "main/mwoibn/", "main/mwoibn/robot/", "main/mwoibn/feedback/", "main/mwoibn/controller/"
ROS, XBOT, MODULES = "main/mwoibn/ros/", "main/mwoibn/xbot/", "main/mwoibn/modules/"
BUNDLE, MOCK, WORLD = "bundle/", "mock/", "world/"
CONTACT, TIP = "contacts/cart/contacts/contact0/", "contacts/cart/contacts/contact1/"

ABOUT_ALL_AXES = dict(
    zip(
        ("xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"),
        (0.36, 0.48, -0.8, -0.8, 0.6, 0.0, 0.48, 0.64, 0.6),
        strict=True,
    )
)
"""A rotation that differs from that of the files in all its entries."""


STIFFER = {name: SPRING | {"Ks": 5.0} for name in benches.JOINTS}
OTHERS = {
    MAIN + "calibration/others": {
        "joints": {name: {"name": name, "sign": -1, "offset": 0.2} for name in benches.JOINTS}
    }
}


class Change(NamedTuple):
    """What is run, and values by their path in the files; `before` holds with and without the tag's own change."""

    bench: Callable[[Path], str]
    after: Mapping[str, Any]
    before: Mapping[str, Any] = {}


WALK, IMU, ANGLES, SETS = (benches.module(name) for name in ("walk", "imu", "angles", "sets"))
TOUCHING, MAPPED, MOVING = (benches.module(name) for name in ("contacts", "mapped", "joint_states"))
CARRYING, SPRINGS = (benches.module(name) for name in ("carrying", "springs"))
REACHING, HANDS, BALANCING = (benches.module(name) for name in ("reaching", "hands", "balancing"))
REAL = benches.module("walk", system="HW")
IN_RT, IMU_IN_RT = (benches.module(name, middleware="XBOT", layer="RT") for name in ("walk", "imu"))


COMMANDED_GAINS = {f"{OUT}arm_controller/interface/{gain}": True for gain in ("stiffness", "damping")}
"""With these a plugin may send the lower level gains."""


def each(bench: Callable[[Path], str], prefix: str, **values: Any) -> dict[str, Change]:
    """Return changes of tags by their name below a path; `__` stands for a dot."""
    names = {name.replace("__", "."): value for name, value in values.items()}
    return {name: Change(bench, {prefix + name.replace(".", "/"): value}) for name, value in names.items()}


def rotation(bench: Callable[[Path], str], path: str, prefix: str = "offset_orientation.") -> dict[str, Change]:
    """Return changes of all entries of a rotation, which are not free of each other."""
    return {prefix + entry: Change(bench, {path: ABOUT_ALL_AXES}) for entry in ABOUT_ALL_AXES}


def position(bench: Callable[[Path], str], path: str) -> dict[str, Change]:
    """Return changes of a position."""
    return {f"offset_position.{axis}": Change(bench, {f"{path}/{axis}": 0.7}) for axis in "xyz"}


def pipe(path: str, bench: Callable[[Path], str]) -> dict[str, Change]:
    """Return changes of what pipes of both directions have."""
    joints, base = ("joints", "odometry") if path == IN else ("desired", "pose")
    filtered = "joints" if path == IN else "arm_controller"
    return {
        "dofs.chain": Change(bench, {f"{path}{joints}/dofs/chain": "arm"}),
        "dofs.type": Change(bench, {f"{path}{joints}/dofs/type": "OTHER"}),
        "dofs.name": Change(bench, {f"{path}{base}/dofs/name": "wheel"}),
        "dofs.mapping": Change(bench, {f"{path}{joints}/dofs/mapping": "OTHER"}),
        "interface.position": Change(bench, {f"{path}{joints}/interface/position": False}),
        "interface.velocity": Change(bench, {f"{path}{joints}/interface/velocity": False}),
        "interface.effort": Change(bench, {f"{path}{joints}/interface/effort": False}),
        **each(bench, f"{path}{filtered}/", filter__run=False, filter__frequency=30.0, filter__damping=0.5),
        "convention.twist.frame": Change(bench, {f"{path}{base}/convention": {"twist": {"frame": "world"}}}),
        "layer": Change(benches.bridge, {f"{path}{joints}/layer": "NRT"}),
    }
