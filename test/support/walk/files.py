"""The files of a small robot and of plugins on it, in which every tag of the configuration has something to change."""

from typing import Any

from solfer.config.yaml.nodes import Key

LINK = """<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
  <inertia ixx="0.2" iyy="0.2" izz="0.2" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0 0 0"/><geometry><sphere radius="0.1"/></geometry></collision></link>"""
JOINT = """<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>
  <axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="40"/></joint>"""
URDF = "".join(
    [
        '<robot name="cart"><link name="world"/><link name="sensor"/>',
        LINK.format(name="base", com="0 0 0", mass=5),
        LINK.format(name="arm", com="0 0 0.5", mass=2),
        LINK.format(name="hand", com="0.1 0 0", mass=1),
        LINK.format(name="wheel", com="0 0 0", mass=1),
        '<joint name="free" type="floating"><parent link="world"/><child link="base"/></joint>',
        JOINT.format(name="shoulder", parent="base", child="arm", xyz="0 0 0.3"),
        JOINT.format(name="elbow", parent="arm", child="hand", xyz="0 0 1"),
        '<joint name="roll" type="continuous"><parent link="base"/><child link="wheel"/><origin xyz="0 0.4 -0.2"/>'
        '<axis xyz="0 1 0"/><limit velocity="10" effort="20"/></joint>'
        '<joint name="glue" type="fixed"><parent link="base"/><child link="sensor"/><origin xyz="0.1 0.2 0"/></joint>',
        "</robot>",
    ]
)
SRDF = """<robot name="cart"><group name="wheels"><joint name="roll"/></group><group name="whole"><joint name="free"/>
  <joint name="shoulder"/><joint name="elbow"/><joint name="roll"/></group>
  <group name="arm"><joint name="shoulder"/><joint name="elbow"/></group>
  <group_state name="bent" group="arm"><joint name="shoulder" value="0.2"/></group_state>
  <group_state name="folded" group="arm"><joint name="shoulder" value="0.4"/></group_state></robot>"""

ROWS = {f"force_{row}": [0, 0, 0, *(int(row == column) for column in (1, 2, 3))] for row in (1, 2, 3)}
TURNS = {f"momentum_{row}": [*(int(row == column) for column in (1, 2, 3)), 0, 0, 0] for row in (1, 2, 3)}
SPRING = {"type": "SEA", "Ks": 9e3, "D": 1.0, "Bm": 2e-4, "phim": 2e-5, "nu": 100.0, "Torque_limit": 30.0}
JOINTS = {"chain": "all", "type": "actuated", "mapping": "RBDL"}
COMMANDED = JOINTS | {"mapping": "LOWER_LEVEL"}
ALL = {"position": True, "velocity": True, "effort": True}
BASE = {"chain": "all", "type": "body", "name": "base", "mapping": "RBDL"}
TURNED = {"xx": 0, "xy": -1, "xz": 0, "yx": 1, "yy": 0, "yz": 0, "zx": 0, "zy": 0, "zz": 1}


def joints(**tags: Any) -> dict[str, Any]:
    """Return a pipe of joints."""
    return {"space": "JOINT", "dofs": dict(JOINTS), "interface": dict(ALL)} | tags


def body(**tags: Any) -> dict[str, Any]:
    """Return a pipe of the base."""
    return {"space": "OPERATIONAL", "dofs": dict(BASE), "interface": {"position": True, "velocity": True}} | tags


FEEDBACK = {
    "joints": joints(function="state", initialize=True, filter={"run": True, "frequency": 20.0, "damping": 0.9}),
    "motors": joints(function="motor", timeout=0.05, strikes=3, on_timeout="hold"),
    "wishes": joints(function="reference"),
    "springs": joints(function="reference", interface={"stiffness": True, "damping": True, "acceleration": True}),
    "odometry": body(calibrate=True, convention={"twist": {"frame": "body"}}),
    "imu": body(
        dofs=BASE | {"name": "sensor"},
        reference="case",
        convention={
            "position": {"type": "NONE"},
            "orientation": {"type": "QUATERNION", "convention": "JPL", "order": "wxyz"},
        },
        offset_position={"x": 0.1, "y": 0.2, "z": 0.3},
        offset_orientation=TURNED,
    ),
    "angles": body(
        dofs=BASE,
        interface={"position": True},
        convention={"orientation": {"type": "EULER"}, "position": {"type": "NONE"}},
        output_angles={"angle_1": 0, "angle_2": 1, "angle_3": 2},
    ),
    "goal": {"space": "POINT", "quantity": "position", "interface": "fixed", "link": "hand"},
    "marks": {"space": "POINTS", "quantity": "position", "names": ["a", "b"]},
    "dots": {"space": "POINTS", "quantity": "position", "count": 2},
    "foot": {"space": "CONTACT", "contact": "rolling", "interface": "fixed"},
    "feet": {"space": "CONTACTS", "names": ["rolling", "tip"]},
}
CONTROLLER = {
    "arm_controller": joints(type="impedance", dofs=COMMANDED, filter={"run": True, "frequency": 20.0, "damping": 0.9}),
    "wheel_controller": joints(type="velocity", dofs=COMMANDED, interface={"velocity": True}),
    "desired": joints(type="reference", function="state"),
    "pose": body(type="reference", function="state"),
    "tip": {"space": "POINT", "quantity": "position", "interface": "fixed", "link": "hand", "type": "reference"},
    "push": {"space": "CONTACT", "contact": "rolling", "interface": "fixed", "type": "reference"},
}
FEEDBACK_ENDS = {
    "joints": {"source": "joint_states", "message": "sensor_msgs/JointState"},
    "motors": {"source": "motor_states", "message": "sensor_msgs/JointState"},
    "wishes": {"source": "wishes", "message": "sensor_msgs/JointState"},
    "springs": {"source": "springs", "message": "solfer/JointCommand"},
    "odometry": {"source": "odometry", "message": "nav_msgs/Odometry"},
    "imu": {"source": "imu", "message": "sensor_msgs/Imu"},
    "angles": {"source": "angles", "message": "geometry_msgs/Vector3Stamped"},
    "goal": {"source": "goal", "message": "geometry_msgs/PointStamped"},
    "marks": {"source": "marks", "message": "solfer/RobotPoints"},
    "dots": {"source": "dots", "message": "solfer/RobotPoints"},
    "foot": {"source": "foot", "message": "geometry_msgs/WrenchStamped"},
    "feet": {"source": "feet", "message": "solfer/RobotPoints"},
}
CONTROLLER_ENDS = {
    "arm_controller": {"sink": "/command"},
    "wheel_controller": {"sink": "/command"},
    "desired": {"sink": "desired", "message": "sensor_msgs/JointState"},
    "pose": {"sink": "pose", "message": "nav_msgs/Odometry"},
    "tip": {"sink": "tip", "message": "geometry_msgs/PointStamped"},
    "push": {"sink": "push", "message": "geometry_msgs/WrenchStamped"},
}
STACK = {
    "frames": {
        "pad": {"link": "hand", "offset": [0.1, 0.0, 0.0]},
        "floor": {"type": "ground", "link": "base"},
    },
    "tasks": {
        "hand": {"point": "position", "link": "pad", "relative": "base", "gain": 2.0},
        "high": {"point": "pose", "link": "hand", "relative": "floor", "rows": ["z"]},
        "tilt": {"point": "orientation", "link": "pad", "rows": ["ry"]},
        "eye": {"point": "look_at", "link": "hand", "target": [3.0, 0.0, 1.0]},
        "rest": {"point": "posture", "reference": "bent", "weight": 0.1},
    },
    "levels": [["hand", "tilt"], ["high", "eye", "rest"]],
    "limits": {"workspace": {"near": {"link": "hand", "relative": "base", "farthest": 1.35}}},
}
HANDS = {
    "track": "wheels",
    "reference": "base",
    "IK": ["qp::ARMS"],
    "tunning": "slow",
    "tunnings": {name: {"ARMS": gain, "damping": 0.01} for name, gain in (("slow", 0.5), ("fast", 2.0))},
}
MODULE = {
    "layer": "NRT",
    "robot": "listening",
    "controller": ["arm_controller", "wheel_controller", "desired", "pose", "tip", "push"],
    "mode": "full",
    "kinematics": True,
    "dynamics": True,
    "model_change": False,
    "class": "support.walk.benches:Walker",
}


def middleware(**more: Any) -> dict[str, Any]:
    """Return the part of one middleware, with more files."""
    sources = {name: {"file": name + end} for name, end in (("urdf", ".urdf"), ("srdf", ".srdf"))}
    sources |= {name: {"file": f"{name}.yaml"} for name in ("actuators", "contacts")} | more
    maps = {
        "OUTSIDE": {"loading": "topic", "source": "wishes", "message": "sensor_msgs/JointState"},
        "OTHER": {"loading": "model", "urdf": {"file": "other.urdf"}},
    }
    return {"source": sources, "mapping": maps, "feedback": FEEDBACK_ENDS, "controller": CONTROLLER_ENDS}


def robot(*pipes: str, **tags: Any) -> dict[str, Any]:
    """Return a robot configuration."""
    return {"feedback": {"list": list(pipes)}, "actuators": {"read": True}, "contacts": {"read": True}} | tags


MAIN = {
    "middleware": "ROS",
    "system": "SM",
    "layers": {"NRT": {"file": "slow.yaml"}, "RT": {"file": "fast.yaml"}},
    "robot": {
        "name": "cart",
        "systems": {"SM": {"file": "simulated.yaml"}, "HW": {"file": "real.yaml"}},
        "listening": robot(
            "joints", "motors", "wishes", "springs", "odometry", "goal", "marks", "dots", "foot", "feet"
        ),
        "in_sets": robot("joints") | {"feedback": {"layer": "some"}},
        "wishing": robot("joints", "wishes"),
        "turning": robot("joints", "imu"),
        "angled": robot("joints", "angles"),
        "touching": robot("joints", contacts={"read": True, "feedback": True}),
    },
    "feedbacks": {"some": ["joints", "motors"]},
    "controllers": {"few": ["arm_controller"], "fewer": []},
    "feedback": FEEDBACK,
    "controller": CONTROLLER,
    "calibration": {
        "encoders": {
            "joints": {
                "shoulder": {"name": "shoulder", "sign": 1, "offset": 0.1},
                "elbow": {"name": "elbow", "sign": 1, "offset": 0.1},
                "roll": {"name": "roll", "sign": 1, "offset": 0.1},
            }
        }
    },
    "ros": middleware(),
    "xbot": middleware(config={"file": "layer.yaml"}),
    "modules": {
        "walk": MODULE,
        "sets": MODULE | {"robot": "in_sets", "controller": "few"},
        "imu": MODULE | {"robot": "turning", "controller": ["pose"]},
        "angles": MODULE | {"robot": "angled", "controller": ["pose"]},
        "contacts": MODULE | {"robot": "touching", "controller": ["push"]},
        "mapped": MODULE | {"robot": "in_sets", "controller": ["desired"]},
        "joint_states": {key: MODULE[key] for key in MODULE if key != "class"}
        | {"robot": "in_sets", "controller": "few", "dynamics": False},
        "carrying": MODULE
        | {
            "class": "solfer.components.gravity_compensation:GravityCompensation",
            "robot": "wishing",
            "controller": "few",
        },
        "reaching": MODULE
        | {
            "class": "solfer.components.inverse_kinematics:InverseKinematics",
            "robot": "in_sets",
            "controller": "few",
            "stack": STACK,
        },
        "balancing": MODULE
        | {
            "class": "solfer.components.inverse_dynamics:InverseDynamics",
            "robot": "in_sets",
            "controller": "few",
            "sole": [0.1, 0.05],
            "speed_driven": "wheels",
            "stack": {key: STACK[key] for key in ("frames", "tasks", "levels")},
        },
        "hands": MODULE
        | {
            "class": "solfer.components.inverse_kinematics:InverseKinematics",
            "robot": "in_sets",
            "controller": "few",
        }
        | HANDS,
        "springs": MODULE
        | {
            "class": "solfer.components.compliance_compensation:ComplianceCompensation",
            "robot": "wishing",
            "controller": "few",
        },
        "both": {"layer": "NRT", "mode": "full", "plugins": ["joint_states", "joint_states::sets"], "budget": 0.5},
    },
}
DRIVING_GAINS = {"CONSTRAINTS": 1.0, "BASE": [0.1, 0.1, 4.0, 2.0, 2.0, 3.0], "CONTACT_POINTS": 8.0, "damping": 1e-4}
DRIVING_GAINS |= {"CAMBER": 0.7, "CAMBER_DAMP": 0.08, "CASTER": 1.5, "CASTER_DAMP": 0.12}
DRIVING = {
    "track": "wheels",
    "chain": "lower_body",
    "IK": ["CONSTRAINTS", "BASE", "STEERING", "CONTACT_POINTS", "CAMBER", "CASTER"],
    "tunning": "slow",
    "tunnings": {"slow": DRIVING_GAINS | {"STEERING": 20.0}, "fast": DRIVING_GAINS | {"STEERING": 30.0}},
    "steering": "reactif",
    "steerings": {"reactif": {}, "other": {"sp": 0.2}},
    "reference_axis": {"wheel_1": {"x": 0.0, "y": 0.05, "z": 1.0}},
}
FILES: dict[str, Any] = {
    "driving": {"driving": DRIVING},
    "main": {"mwoibn": MAIN},
    "estimators": {
        "odometry": {"method": "filter"},
        "ground_forces": {"method": "weighted", "track": "wheels", "push_deviation": 100.0},
    },
    "slow": {"mwoibn": {"robot": {"rate": 200}}},
    "fast": {"mwoibn": {"robot": {"rate": 500}}},
    "simulated": {"mwoibn": {}},
    "real": {
        "mwoibn": {
            "feedback": {name: {"calibration": "encoders"} for name in ("joints", "motors")},
            "controller": {name: {"calibration": "encoders"} for name in ("arm_controller", "wheel_controller")},
        }
    },
    "laid_over": {"mwoibn": {"robot": {"rate": 100}}},
    "layer": {
        "XBotRTPlugins": {"plugins": ["joint_states", "joint_states::sets"]},
        "mwoibn": {"config_file": {"file": "main.yaml"}},
        "executor": {"start": ["joint_states"], "schedule": {"priority": 0, "cpus": []}},
    },
    "other_layer": {
        "XBotRTPlugins": {"plugins": ["joint_states"]},
        "mwoibn": {"config_file": {"file": "main.yaml"}},
        "executor": {"rate": 100, "schedule": {"priority": 0, "cpus": []}},
    },
    "actuators": {"cart": {"actuators": {"shoulder": SPRING, "elbow": SPRING, "roll": SPRING}}},
    "contacts": {
        "cart": {
            "contacts": {
                "contact0": {
                    "name": "rolling",
                    "end_frame": "wheel",
                    "type": "wheel",
                    "position": [0.0, 0.0, 0.0],
                    "constraint_matrix": ROWS,
                    "topic": "contacts/rolling",
                    "message": "geometry_msgs/WrenchStamped",
                    "minor_axis": 0.03,
                    "major_axis": 0.07,
                    "reference_axis": {"x": 0.1, "y": 1, "z": 0.1},
                },
                "contact1": {
                    "name": "tip",
                    "end_frame": "hand",
                    "type": "contact_point",
                    "position": [0.1, 0.0, 0.0],
                    "offset": [0.0, 0.0, -0.1],
                    "constraint_matrix": ROWS | TURNS,
                },
            }
        }
    },
    "gains": {
        "cart": {
            "gains": {name: {"stiffness": 200.0, "damping": 5.0} for name in ("shoulder", "elbow", "roll")},
        }
    },
    "bundle": {
        "name": "cart",
        "urdf": "urdf.urdf",
        "srdf": "srdf.srdf",
        "contacts": "contacts.yaml",
        "actuators": "actuators.yaml",
        "gains": "gains.yaml",
        "start": {"state": "bent"},
        "parts": {"upper": {"at": "hand", "keep": "lower"}},
        "controllers": {
            "arm_controller": {"type": "impedance", "except": "wheels"},
            "wheel_controller": {"type": "velocity", "group": "wheels"},
        },
        "lower_level": {"ration": {}},
        "friction": {"default": 0.5, "groups": {"wheels": 0.7}},
        "sensors": {
            "imu": {
                "link": "sensor",
                "noise": {"orientation": 0.01, "angular": 0.01, "acceleration": 0.01},
                "offset_position": {"x": 0.1, "y": 0.2, "z": 0.3},
                "offset_orientation": TURNED,
            },
            "joint_noise": {"position": 1e-3, "velocity": 1e-3, "effort": 1e-3},
            "rates": {"joints": 500, "base": 500, "imu": 500, "motors": 500, "contacts": 500},
        },
    },
    "soft_gains": {"cart": {"gains": {name: {"stiffness": 9.0, "damping": 1.0} for name in ("shoulder", "elbow")}}},
    "mock": {
        "robot": {"file": "bundle.yaml"},
        "joint_noise": {"position": 1e-3},
        "imu": {"offset_position": {"x": 0.1, "y": 0.2, "z": 0.3}, "offset_orientation": TURNED},
        "joints": {
            "shoulder": {"name": "J1", "direction": 1, "zero": 0.1},
            "elbow": {"name": "J2", "direction": 1, "zero": 0.1},
            "roll": {"name": "J3", "direction": 1, "zero": 0.1},
        },
    },
    "world": {
        "ground": {"slope": 0.1},
        "stairs": {
            "up": {
                "position": [3.0, 0.0],
                "yaw": 0.1,
                "count": 3,
                "rise": 0.1,
                "tread": 0.3,
                "width": 2.0,
                "friction": 0.8,
            }
        },
        "boxes": {
            "crate": {"size": [0.3, 0.3, 0.3], "position": [-2.0, 0, 2], "rpy": [0, 0, 0], "mass": 1.0, "friction": 0.4}
        },
    },
}
"""Files by name, without their ending."""


def changed(files: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return copies of the files in which the value at each path, `file/key/key`, is another one; None removes it."""
    for path, value in changes.items():
        files = _put(files, path.split("/"), value)
    return files


def _put(tree: Any, path: list[Key], value: Any) -> Any:
    key, *rest = path
    copy = dict(tree or {})
    if rest:
        copy[key] = _put(copy.get(key), rest, value)
    elif value is None:
        copy.pop(key, None)
    else:
        copy[key] = value
    return copy
