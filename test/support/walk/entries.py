"""For each tag of docs/configuration.md what is run, and a change of the tag that has to change what runs."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from support.walk import benches
from support.walk.files import FILES, ROWS, SPRING, TURNS

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
REAL = benches.module("walk", system="HW")
IN_RT = benches.module("walk", middleware="XBOT", layer="RT")


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
    joints, base = ("joints", "odometry") if path == IN else ("heard", "pose")
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


RUNS: dict[str, dict[str, Change]] = {
    "Top level": {
        "middleware": Change(WALK, {MAIN + "middleware": "XBOT", XBOT + "feedback/joints/source": "motor_states"}),
        "system": Change(WALK, {MAIN + "system": "HW"}),
        "layers": Change(WALK, {MAIN + "layers/NRT/file": "fast.yaml"}),
        "robot": Change(WALK, {ROBOT + "listening/feedback/list": ["joints", "foot"]}),
        "feedbacks": Change(SETS, {MAIN + "feedbacks/some": ["joints"]}),
        "controllers": Change(SETS, {MAIN + "controllers/few": []}),
        "feedback": Change(WALK, {IN + "joints/interface/effort": False}),
        "controller": Change(WALK, {OUT + "heard/interface/effort": False}),
        "calibration": Change(REAL, {MAIN + "calibration/encoders/joints/elbow/offset": 0.5}),
        "ros.source": Change(WALK, {ROS + "source/urdf/file": "bare.urdf"}),
        "ros.mapping": Change(WALK, {ROS + "mapping/OTHER/urdf/file": "smaller.urdf"}),
        "ros.feedback": Change(WALK, {ROS + "feedback/joints/source": "motor_states"}),
        "ros.controller": Change(WALK, {ROS + "controller/heard/sink": "seen"}),
        "xbot.source": Change(IN_RT, {XBOT + "source/urdf/file": "bare.urdf"}),
        "xbot.mapping": Change(IN_RT, {XBOT + "mapping/OTHER/urdf/file": "smaller.urdf"}),
        "xbot.feedback": Change(IN_RT, {XBOT + "feedback/joints/source": "motor_states"}),
        "xbot.controller": Change(IN_RT, {XBOT + "controller/heard/sink": "seen"}),
        "modules": Change(WALK, {MODULES + "walk/blend": 2.0}),
    },
    "`robot`": {
        "name": Change(
            SETS,
            {ROBOT + "name": "wagon"},
            {"actuators/wagon": {"actuators": STIFFER}, "contacts/wagon": {"contacts": {}}},
        ),
        "rate": Change(WALK, {"slow/mwoibn/robot/rate": 250}),
    },
    "`robot.NAME`": {
        "feedback.layer": Change(
            SETS, {ROBOT + "in_sets/feedback/layer": "less"}, {MAIN + "feedbacks/less": ["joints"]}
        ),
        "feedback.list": Change(IMU, {ROBOT + "turning/feedback/list": ["joints"]}),
        "actuators.read": Change(WALK, {ROBOT + "listening/actuators/read": False}),
        "contacts.read": Change(SETS, {ROBOT + "in_sets/contacts/read": False}),
        "contacts.feedback": Change(TOUCHING, {ROBOT + "touching/contacts/feedback": False}),
    },
    "`feedback.NAME`": {
        **pipe(IN, WALK),
        "convention.orientation.convention": Change(IMU, {IN + "imu/convention/orientation/convention": "HAMILTONIAN"}),
        "convention.orientation.order": Change(IMU, {IN + "imu/convention/orientation/order": "xyzw"}),
        "convention.position.type": Change(WALK, {IN + "odometry/convention/position": {"type": "NONE"}}),
        "calibration": Change(REAL, {"real/mwoibn/feedback/joints/calibration": "others"}, OTHERS),
        "space": Change(WALK, {IN + "motors/space": "SKIP"}),
        "function": Change(WALK, {IN + "motors/function": "reference"}),
        "source": Change(WALK, {ROS + "feedback/joints/source": "motor_states"}),
        "initialize": Change(WALK, {ROS + "feedback/marks/initialize": True}),
        **each(WALK, IN + "motors/", timeout=0.5, strikes=4, on_timeout="keep"),
        "reference": Change(IMU, {IN + "imu/reference": "sensor"}),
        **position(IMU, IN + "imu/offset_position"),
        **rotation(IMU, IN + "imu/offset_orientation"),
        **{
            f"output_angles.angle_{axis}": Change(
                ANGLES, {IN + "angles/output_angles": dict(zip(("angle_1", "angle_2", "angle_3"), order, strict=True))}
            )
            for axis, order in ((1, (1, 0, 2)), (2, (0, 2, 1)), (3, (2, 1, 0)))
        },
        "calibrate": Change(WALK, {IN + "odometry/calibrate": False}),
    },
    "`controller.NAME`": {
        **pipe(OUT, WALK),
        "convention.orientation.convention": Change(
            WALK, {OUT + "pose/convention": {"orientation": {"convention": "JPL"}}}
        ),
        "convention.orientation.order": Change(WALK, {OUT + "pose/convention": {"orientation": {"order": "wxyz"}}}),
        "calibration": Change(REAL, {"real/mwoibn/controller/arm_controller/calibration": "others"}, OTHERS),
        "message": Change(WALK, {ROS + "controller/heard/message": "solfer/JointCommand"}),
        "space": Change(WALK, {OUT + "heard/space": "SKIP"}),
        "type": Change(
            WALK,
            {
                OUT + "arm_controller/type": "reference",
                ROS + "controller/arm_controller/message": "solfer/JointCommand",
            },
        ),
        "function": Change(WALK, {OUT + "heard/function": "motor"}),
        "sink": Change(WALK, {ROS + "controller/heard/sink": "seen"}),
    },
    "Points: `space: POINT` or `POINTS` in `feedback.NAME` and `controller.NAME`": {
        "space": Change(
            WALK,
            {IN + "dots": {"space": "POINTS", "quantity": "position", "names": ["c", "d"]}},
        ),
        "interface": Change(WALK, {IN + "goal/interface": "world", IN + "goal/link": None}),
        "link": Change(WALK, {IN + "goal/link": "arm"}),
        "names": Change(WALK, {IN + "marks/names": ["b", "a"]}),
    },
    "Contacts: `space: CONTACT` or `CONTACTS` in `feedback.NAME` and `controller.NAME`": {
        "space": Change(WALK, {IN + "foot/space": "SKIP"}),
        "contact": Change(WALK, {IN + "foot/contact": "tip"}),
        "names": Change(WALK, {IN + "feet/names": ["tip"]}),
        "interface": Change(WALK, {IN + "foot/interface": "world"}),
    },
    "`calibration.NAME`": {
        "joints.NAME.name": Change(
            REAL,
            {
                MAIN + "calibration/encoders/joints/elbow/name": "shoulder",
                MAIN + "calibration/encoders/joints/shoulder/name": "elbow",
            },
        ),
        "joints.NAME.sign": Change(REAL, {MAIN + "calibration/encoders/joints/elbow/sign": -1}),
        "joints.NAME.offset": Change(REAL, {MAIN + "calibration/encoders/joints/elbow/offset": 0.3}),
    },
    "`ros.source`, `xbot.source`": {
        "urdf": Change(WALK, {ROS + "source/urdf/file": "bare.urdf"}),
        "srdf": Change(WALK, {ROS + "source/srdf/file": "other.srdf"}),
        "actuators": Change(WALK, {ROS + "source/actuators/file": "springs.yaml"}, {"springs/cart": {"actuators": {}}}),
        "contacts": Change(SETS, {ROS + "source/contacts/file": "none.yaml"}, {"none/cart": {"contacts": {}}}),
    },
    "`ros.mapping.NAME`, `xbot.mapping.NAME`": {
        "loading": Change(
            MAPPED,
            {ROS + "mapping/OUTSIDE": {"loading": "model", "urdf": {"file": "other.urdf"}}},
            {OUT + "heard/dofs/mapping": "OUTSIDE"},
        ),
        "source": Change(
            MAPPED, {ROS + "mapping/OUTSIDE/source": "joint_states"}, {OUT + "heard/dofs/mapping": "OUTSIDE"}
        ),
        "urdf": Change(WALK, {ROS + "mapping/OTHER/urdf/file": "smaller.urdf"}),
    },
    "`modules.NAME`": {
        **each(WALK, MODULES + "walk/", layer="RT", mode="idle", silent=True, robot="touching", controller=["pose"]),
        **each(WALK, MODULES + "walk/", blend=2.0, stall=0.03, kinematics=False, dynamics=False, model_change=True),
        "class": Change(SETS, {MODULES + "sets/class": "support.plugins.body_pipes:Watcher"}),
        "secondary_file": Change(WALK, {MODULES + "walk/secondary_file": {"file": "laid_over.yaml"}}),
    },
    "`modules.shared`, and every module with `plugins`": each(
        benches.shared, MODULES + "both/", layer="RT", mode="idle", plugins=["joint_states"]
    ),
    "Tags of the component `joint_states`": each(
        MOVING, MODULES + "joint_states/", chain="arm", wheels="arm", speed=0.7, wheel_acceleration=4.0
    ),
    "RT layer (`config/xbot.yaml`): `XBotRTPlugins`": each(
        benches.layer, "layer/XBotRTPlugins/", plugins=["joint_states"]
    ),
    "RT layer: `executor`": {
        **each(
            benches.layer, "layer/executor/", rate=100, start=[], blend=1.0, budget=0.3, overruns=5, grace=7, record=1.0
        ),
        **each(
            benches.layer,
            "layer/executor/",
            schedule__priority=3,
            schedule__cpus=[0],
            schedule__lock_memory=False,
            schedule__timer_slack=3,
            schedule__cpu_latency=False,
            schedule__freeze_collector=False,
        ),
    },
    "Robot's bundle (`config/robots/centauro/robot.yaml`)": {
        "name": Change(
            benches.simulation,
            {BUNDLE + "name": "wagon"},
            {
                "actuators/wagon": {"actuators": STIFFER},
                "contacts/wagon": {"contacts": {}},
                "gains/wagon": {"gains": {name: {"stiffness": 1.0, "damping": 1.0} for name in ("shoulder", "elbow")}},
            },
        ),
        **each(benches.simulation, BUNDLE, urdf="bare.urdf", srdf="other.srdf", contacts=None, actuators=None),
        **each(benches.simulation, BUNDLE, gains="soft_gains.yaml", floating_base=False, start__state="folded"),
        "parts.NAME.at": Change(benches.simulation, {BUNDLE + "parts/upper/at": "arm"}),
        "parts.NAME.keep": Change(benches.simulation, {BUNDLE + "parts/upper/keep": "upper"}),
        "controllers.NAME.timeout": Change(
            benches.simulation, {BUNDLE + "controllers/wheel_controller/timeout": 0.005}
        ),
        "controllers.NAME.type": Change(
            benches.simulation, {BUNDLE + "controllers/wheel_controller/type": "impedance"}, {BUNDLE + "gains": None}
        ),
        "controllers.NAME.group": Change(
            benches.simulation,
            {BUNDLE + "controllers/rest": {"type": "impedance", "group": "wheels"}},
            {
                BUNDLE + "controllers": {"both": {"type": "impedance"}},
                BUNDLE + "controllers/both/group": "arm",
                BUNDLE + "controllers/rest": {"type": "velocity", "group": "wheels"},
                BUNDLE + "gains": None,
            },
        ),
        "controllers.NAME.except": Change(
            benches.simulation,
            {BUNDLE + "controllers": {"arm_controller": {"type": "impedance"}}},
            {BUNDLE + "gains": None},
        ),
        **each(
            benches.simulation,
            BUNDLE,
            lower_level__lease=0.4,
            lower_level__silence="keep",
            lower_level__fade=0.9,
            lower_level__tilt=0.5,
            lower_level__tilt_time=0.9,
            lower_level__overspeed=3.0,
            lower_level__overspeed_time=0.9,
            lower_level__gains_folders=["soft"],
        ),
        **{
            f"lower_level.ration.{name}": Change(benches.server, {f"{BUNDLE}lower_level/ration/{name}": value})
            for name, value in {
                "owners": 3,
                "others": 5,
                "waiting": 7,
                "command": 500,
                "request": 501,
            }.items()
        },
        "lower_level.ration.requests": Change(benches.simulation, {BUNDLE + "lower_level/ration/requests": 3}),
        **each(
            benches.simulation, BUNDLE, friction__default=0.6, friction__groups={"wheels": 0.3}, friction__ground=0.5
        ),
        "sensors.seed": Change(benches.simulation, {BUNDLE + "sensors/seed": 3}),
        **each(
            benches.simulation,
            BUNDLE,
            **{f"sensors__rates__{name}": 250 for name in ("joints", "base", "imu", "motors", "contacts")},
            **{f"sensors__joint_noise__{name}": 0.3 for name in ("position", "velocity", "effort")},
            **{f"sensors__imu__noise__{name}": 0.3 for name in ("orientation", "angular", "acceleration")},
            **{f"sensors__imu__bias__{name}": [0.1, 0.2, 0.3] for name in ("angular", "acceleration")},
            sensors__imu__link="arm",
        ),
        **{
            f"sensors.imu.{tag}": change
            for tag, change in position(benches.simulation, BUNDLE + "sensors/imu/offset_position").items()
        },
        **rotation(benches.simulation, BUNDLE + "sensors/imu/offset_orientation", "sensors.imu.offset_orientation."),
    },
    "Actuators of a robot (`actuators.yaml`), below the robot's name": {
        f"actuators.NAME.{name}": Change(WALK, {f"actuators/cart/actuators/elbow/{name}": value})
        for name, value in {"Ks": 5e3, "D": 2.0, "Bm": 3e-4, "phim": 3e-5, "nu": 90.0, "Torque_limit": 20.0}.items()
    }
    | {
        "actuators.NAME.type": Change(WALK, {"actuators/cart/actuators/elbow": {"type": "UNACTUATED"}}),
        "actuators.NAME.reflect_inertia": Change(WALK, {"actuators/cart/actuators/elbow/reflect_inertia": True}),
        "actuators.NAME.B": Change(
            WALK,
            {"actuators/cart/actuators/elbow/B": 7.0},
            {"actuators/cart/actuators/elbow/Bm": None, "actuators/cart/actuators/elbow/B": 2.0},
        ),
        "actuators.NAME.phi": Change(
            WALK,
            {"actuators/cart/actuators/elbow/phi": 0.7},
            {"actuators/cart/actuators/elbow/phim": None, "actuators/cart/actuators/elbow/phi": 0.2},
        ),
    },
    "Contacts of a robot (`contacts.yaml`), below the robot's name": {
        f"contacts.NAME.{tag}": change
        for tag, change in {
            "name": Change(SETS, {CONTACT + "name": "round"}),
            **each(WALK, CONTACT, end_frame="hand", position=[0.0, 0.1, 0.0], offset=[0.0, -0.06, -0.08], active=False),
            **each(TOUCHING, CONTACT, topic="contacts/other", interface="world"),
            "initialize": Change(TOUCHING, {CONTACT + "initialize": False}),
            "type": Change(WALK, {CONTACT + "type": "contact_point"}),
            **each(WALK, CONTACT, minor_axis=0.05, major_axis=0.05),
            **each(WALK, CONTACT, reference_axis__x=0.5, reference_axis__y=0.5, reference_axis__z=0.5),
            **{
                f"constraint_matrix.{row}": Change(WALK, {f"{TIP}constraint_matrix/{row}": [0, 0, 0, 0, 0, 0]})
                for row in ROWS | TURNS
            },
        }.items()
    },
    "Gains of a robot (`gains.yaml`), below the robot's name": {
        f"gains.NAME.{name}": Change(benches.simulation, {f"gains/cart/gains/elbow/{name}": 50.0})
        for name in ("stiffness", "damping")
    },
    "Mock of a robot's hardware (`hardware/mock.yaml`)": {
        **each(benches.hardware, MOCK, gains="soft_gains.yaml", delay__measurement=0.003, delay__command=0.002, seed=3),
        "robot": Change(
            benches.hardware, {MOCK + "robot/file": "fixed.yaml"}, {"fixed": FILES["bundle"] | {"floating_base": False}}
        ),
        **each(benches.hardware, MOCK, **{f"joint_noise__{name}": 0.3 for name in ("position", "velocity", "effort")}),
        **{f"imu.{tag}": change for tag, change in position(benches.hardware, MOCK + "imu/offset_position").items()},
        **rotation(benches.hardware, MOCK + "imu/offset_orientation", "imu.offset_orientation."),
        **{
            f"joints.NAME.{name}": Change(benches.hardware, {f"{MOCK}joints/elbow/{name}": value})
            for name, value in {"name": "E", "direction": -1, "zero": 0.4}.items()
        },
    },
    "World (`config/worlds/*.yaml`)": {
        **each(benches.simulation, WORLD, ground__slope=0.05, ground__friction=0.4),
        **{
            f"stairs.NAME.{name}": Change(benches.simulation, {f"{WORLD}stairs/up/{name}": value})
            for name, value in {
                "position": [3.5, 0.0],
                "yaw": 0.4,
                "count": 2,
                "rise": 0.2,
                "tread": 0.4,
                "width": 1.0,
                "friction": 0.2,
            }.items()
        },
        **{
            f"boxes.NAME.{name}": Change(benches.simulation, {f"{WORLD}boxes/crate/{name}": value})
            for name, value in {
                "size": [0.4, 0.3, 0.3],
                "position": [-2.5, 0, 2],
                "rpy": [0.1, 0, 0],
                "mass": 2.0,
                "friction": 0.2,
            }.items()
        },
    },
}
"""Changes by the section and the tag of docs/configuration.md."""

REFUSED = {
    ("`feedback.NAME`", "convention.orientation.type"): Change(
        ANGLES, {IN + "angles/convention/orientation/type": "QUATERNION"}
    ),
    ("`feedback.NAME`", "message"): Change(WALK, {ROS + "feedback/goal/message": "geometry_msgs/Vector3Stamped"}),
    ("`controller.NAME`", "convention.orientation.type"): Change(
        WALK, {OUT + "pose/convention": {"orientation": {"type": "EULER"}}}
    ),
    ("`controller.NAME`", "convention.position.type"): Change(
        WALK, {OUT + "pose/convention": {"position": {"type": "NONE"}}}
    ),
    ("Points: `space: POINT` or `POINTS` in `feedback.NAME` and `controller.NAME`", "quantity"): Change(
        WALK, {IN + "goal/quantity": "velocity"}
    ),
    ("Points: `space: POINT` or `POINTS` in `feedback.NAME` and `controller.NAME`", "count"): Change(
        WALK, {IN + "dots/count": 3}
    ),
    ("`ros.mapping.NAME`, `xbot.mapping.NAME`", "message"): Change(
        MAPPED,
        {ROS + "mapping/OUTSIDE/message": "solfer/JointCommand"},
        {OUT + "heard/dofs/mapping": "OUTSIDE"},
    ),
    ("Contacts of a robot (`contacts.yaml`), below the robot's name", "contacts.NAME.message"): Change(
        TOUCHING, {CONTACT + "message": "geometry_msgs/PointStamped"}
    ),
}
"""Tags that have to fit another tag or the component: another value alone ends with an error."""

ONE_VALUE = {
    ("Points: `space: POINT` or `POINTS` in `feedback.NAME` and `controller.NAME`", "dofs"): "Points have no DoFs",
    ("Contacts: `space: CONTACT` or `CONTACTS` in `feedback.NAME` and `controller.NAME`", "dofs"): "nor have contacts",
    (
        "Contacts: `space: CONTACT` or `CONTACTS` in `feedback.NAME` and `controller.NAME`",
        "function",
    ): "contacts are measured",
}
"""Tags that have one value, with the reason."""

WARNED = {
    ("`robot.NAME`", "actuators.feedback"): "actuators are not received",
    ("`controller.NAME`", "initialize"): "a controller starts from the measured state",
    ("RT layer (`config/xbot.yaml`): `XBotRTPlugins`", "io_plugins"): "the bridge connects the layer to ROS",
}
"""Tags of the original program that have no effect: a warning names the reason, and so does the page."""

PENDING = {
    ("`feedback.NAME`", "limits.tolerance.position"): Change(
        WALK, {IN + "joints/limits": {"tolerance": {"position": 3.0}}}
    ),
    ("`feedback.NAME`", "limits.tolerance.velocity"): Change(
        WALK, {IN + "joints/limits": {"tolerance": {"velocity": 3.0}}}
    ),
    ("`feedback.NAME`", "limits.tolerance.torque"): Change(
        WALK, {IN + "joints/limits": {"tolerance": {"torque": 3.0}}}
    ),
    ("`feedback.NAME`", "sensor"): Change(IMU, {IN + "imu/sensor": "sensor"}),
    ("`controller.NAME`", "ff_service"): Change(WALK, {OUT + "arm_controller/ff_service": "/ff"}),
    ("`controller.NAME`", "load_service"): Change(WALK, {OUT + "arm_controller/load_service": "/load"}),
    ("`ros.source`, `xbot.source`", "config"): Change(IN_RT, {XBOT + "source/config": {"file": "simulated.yaml"}}),
    ("`ros.source`, `xbot.source`", "controller"): Change(IN_RT, {XBOT + "source/controller": {"file": "gains.yaml"}}),
}
"""Tags that are to act and do not yet; one that acts does not belong here."""
