"""For each tag of docs/reference/configuration.md what is run, and a change of the tag that has to change what runs."""

from pathlib import Path

from support.walk import benches
from support.walk.changes import (
    ANGLES,
    CARRYING,
    COMMANDED_GAINS,
    CONTACT,
    IMU,
    IMU_IN_RT,
    IN,
    IN_RT,
    MAIN,
    MAPPED,
    MODULES,
    MOVING,
    OTHERS,
    OUT,
    REAL,
    ROBOT,
    ROS,
    SETS,
    SPRINGS,
    STIFFER,
    TOUCHING,
    WALK,
    XBOT,
    Change,
    each,
    pipe,
    position,
    rotation,
)
from support.walk.estimators import GROUND, ODOMETRY, STAMPED
from support.walk.robots import ROBOTS
from support.walk.shaping import SHAPING
from support.walk.stacks import DYNAMICS, OF_AN_INVERSE, STACKS
from support.walk.wheels import WHEELS

JUMP = MODULES + "walk/base_jump/"
COMMAND = {"sink": "desired", "message": "solfer/JointCommand"}
MEASURED = {IN + "imu/layer": "online", XBOT + "feedback/imu": {}, IN + "imu/dofs/name": "base"}
"""An inertial sensor as XBotCore's pipes name it."""

STIFF_ARM = {"chain": "arm", "stiffness": 30.0, "damping": 3.0}

FEWER = Path(__file__).parents[2] / "data" / "fewer_contacts.yaml"
"""The first two contacts of CENTAURO."""

FILTERED = {"estimators/ground_forces/filter": {"torque": {"cut_off_frequency": 20.0}}}

RUNS: dict[str, dict[str, Change]] = {
    **ROBOTS,
    "Top level": {
        "middleware": Change(WALK, {MAIN + "middleware": "XBOT", XBOT + "feedback/joints/source": "motor_states"}),
        "system": Change(WALK, {MAIN + "system": "HW"}),
        "layers": Change(WALK, {MAIN + "layers/NRT/file": "fast.yaml"}),
        "robot": Change(WALK, {ROBOT + "listening/feedback/list": ["joints", "foot"]}),
        "feedbacks": Change(SETS, {MAIN + "feedbacks/some": ["joints"]}),
        "controllers": Change(SETS, {MAIN + "controllers/few": []}),
        "feedback": Change(WALK, {IN + "joints/interface/effort": False}),
        "controller": Change(WALK, {OUT + "desired/interface/effort": False}),
        "calibration": Change(REAL, {MAIN + "calibration/encoders/joints/elbow/offset": 0.5}),
        "ros.source": Change(WALK, {ROS + "source/urdf/file": "bare.urdf"}),
        "ros.mapping": Change(WALK, {ROS + "mapping/OTHER/urdf/file": "smaller.urdf"}),
        "ros.feedback": Change(WALK, {ROS + "feedback/joints/source": "motor_states"}),
        "ros.controller": Change(WALK, {ROS + "controller/desired/sink": "seen"}),
        "xbot.source": Change(IN_RT, {XBOT + "source/urdf/file": "bare.urdf"}),
        "xbot.mapping": Change(IN_RT, {XBOT + "mapping/OTHER/urdf/file": "smaller.urdf"}),
        "xbot.feedback": Change(IN_RT, {XBOT + "feedback/joints/source": "motor_states"}),
        "xbot.controller": Change(IN_RT, {XBOT + "controller/desired/sink": "seen"}),
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
        **{
            f"interface.{name}": Change(WALK, {f"{IN}springs/interface/{name}": False})
            for name in ("stiffness", "damping", "acceleration")
        },
        **{
            f"limits.tolerance.{name}": Change(WALK, {IN + "joints/limits": {"tolerance": {name: 3.0}}})
            for name in ("position", "velocity", "torque")
        },
        "sensor": Change(IMU_IN_RT, {IN + "imu/sensor": "sensor"}, MEASURED),
        "initialize": Change(WALK, {ROS + "feedback/marks/initialize": True}),
        **each(WALK, IN + "motors/", timeout=0.5, strikes=4, on_timeout="keep", history=5),
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
        "message": Change(WALK, {ROS + "controller/desired/message": "solfer/JointCommand"}),
        "space": Change(WALK, {OUT + "desired/space": "SKIP"}),
        "type": Change(
            WALK,
            {
                OUT + "arm_controller/type": "reference",
                ROS + "controller/arm_controller/message": "solfer/JointCommand",
            },
        ),
        "function": Change(WALK, {OUT + "desired/function": "motor"}),
        "frame_id": Change(WALK, {OUT + "pose/frame_id": "odom"}),
        "controller": Change(
            WALK,
            {OUT + "wheel_controller/controller": "arm_controller"},
            {OUT + "arm_controller/interface/velocity": False},
        ),
        "sink": Change(WALK, {ROS + "controller/desired/sink": "seen"}),
        **{
            f"interface.{name}": Change(
                WALK, {f"{OUT}{pipe}/interface/{name}": True}, {ROS + "controller/desired": COMMAND}
            )
            for name, pipe in (
                ("stiffness", "arm_controller"),
                ("damping", "arm_controller"),
                ("acceleration", "desired"),
            )
        },
        "open_loop": Change(SETS, {OUT + "arm_controller/open_loop": True}),
        "ff_service": Change(WALK, {OUT + "arm_controller/ff_service": "/ff"}),
        "load_service": Change(
            WALK, {OUT + "arm_controller/load_service": "/load"}, {ROS + "source/controller": {"file": "gains.yaml"}}
        ),
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
        "config": Change(
            benches.named_layer,
            {XBOT + "source/config": {"file": "other_layer.yaml"}},
        ),
        "controller": Change(IN_RT, {XBOT + "source/controller": {"file": "gains.yaml"}}),
    },
    "`ros.mapping.NAME`, `xbot.mapping.NAME`": {
        "loading": Change(
            MAPPED,
            {ROS + "mapping/OUTSIDE": {"loading": "model", "urdf": {"file": "other.urdf"}}},
            {OUT + "desired/dofs/mapping": "OUTSIDE"},
        ),
        "source": Change(
            MAPPED, {ROS + "mapping/OUTSIDE/source": "joint_states"}, {OUT + "desired/dofs/mapping": "OUTSIDE"}
        ),
        "urdf": Change(WALK, {ROS + "mapping/OTHER/urdf/file": "smaller.urdf"}),
    },
    "`modules.NAME`": {
        **each(WALK, MODULES + "walk/", layer="RT", mode="idle", silent=True, robot="touching", controller=["pose"]),
        **each(WALK, MODULES + "walk/", blend=2.0, stall=0.03, kinematics=False, dynamics=False, model_change=True),
        "overload.left_out": Change(WALK, {MODULES + "walk/overload/left_out": 0.01}),
        "overload.age": Change(WALK, {MODULES + "walk/overload/age": 0.001}),
        "base_jump.distance": Change(WALK, {JUMP + "distance": 0.001}),
        "base_jump.speed": Change(WALK, {JUMP + "speed": 0.01}, {JUMP + "distance": 0.03}),
        "base_jump.angle": Change(WALK, {JUMP + "angle": 0.001}),
        "base_jump.turn_speed": Change(WALK, {JUMP + "turn_speed": 0.01}, {JUMP + "angle": 0.04}),
        "class": Change(SETS, {MODULES + "sets/class": "support.plugins.body_pipes:Watcher"}),
        "requires": Change(benches.shared, {MODULES + "sets/requires": ["joint_states"]}),
        "shared": Change(benches.shared, {MODULES + "sets/shared": {"stall": 0.03}}),
        "secondary_file": Change(WALK, {MODULES + "walk/secondary_file": {"file": "laid_over.yaml"}}),
    },
    "`modules.shared`, and every module with `plugins`": each(
        benches.shared,
        MODULES + "both/",
        layer="RT",
        mode="idle",
        plugins=["joint_states"],
        budget=0.3,
        overruns=5,
        grace=7,
    ),
    "Tags of the component `compliance_compensation`": each(SPRINGS, MODULES + "springs/", chain="wheels"),
    "Tags of the component `gravity_compensation`": {
        **{
            tag: Change(CARRYING, {MODULES + "carrying/" + tag: value})
            for tag, value in (("track", "wheels"), ("free", "wheels"), ("fade", 1.0))
        },
        **{
            f"gains.{tag}": Change(
                CARRYING,
                {MODULES + "carrying/gains": [STIFF_ARM | {tag: value}]},
                {MODULES + "carrying/gains": [STIFF_ARM], **COMMANDED_GAINS},
            )
            for tag, value in (("chain", "whole"), ("stiffness", 40.0), ("damping", 4.0))
        },
    },
    "Tags of the component `inverse_dynamics`": DYNAMICS,
    "Tags of the component `inverse_kinematics`": STACKS,
    "Tags of the component `ground_forces`": {
        **each(
            GROUND,
            "estimators/ground_forces/",
            track="front_left_leg",
            method="projection",
            torque_deviation=5.0,
            push_deviation=30.0,
            observer=5.0,
            friction=0.01,
        ),
        "contact_source": Change(GROUND, {"estimators/ground_forces/contact_source": {"file": str(FEWER)}}),
        **{
            f"filter.torque.{tag}": Change(GROUND, {f"estimators/ground_forces/filter/torque/{tag}": value}, FILTERED)
            for tag, value in (("cut_off_frequency", 30.0), ("damping", 2.0), ("unit", "Hz"))
        },
        "prefix": Change(GROUND, {"estimators/ground_forces/prefix": "other_"}),
        **{
            f"touch.{tag}": Change(
                GROUND, {f"estimators/ground_forces/touch/{tag}": value}, {"estimators/ground_forces/touch": {}}
            )
            for tag, value in (("above", 300.0), ("below", 0.0), ("delay", 0.05), ("speed", 5000.0))
        },
        **{
            f"offsets.{tag}": Change(
                GROUND,
                {f"estimators/ground_forces/offsets/{tag}": value},
                {"estimators/ground_forces/offsets": {"largest_push": largest}},
            )
            for tag, value, largest in (
                ("deviation", 3.0, 50.0),
                ("push", 5.0, 1e5),
                ("largest_push", 1e5, 50.0),
                ("interval", 1.0, 50.0),
                ("memory", 1.0, 50.0),
            )
        },
    },
    "Tags of the component `odometry3`": {
        **each(
            ODOMETRY,
            "estimators/odometry/",
            method="geometric",
            wheel_radius=0.08,
            slip=0.3,
            slip_share=2.0,
            slip_time=0.2,
            clearance=1e-4,
            forces=True,
            level=0.0,
            transform=True,
            settle=1.0,
            gyro_noise=1e-2,
            gyro_bias=1e-3,
            gyro_walk=0.5,
            rest=1e-6,
            acceleration=1.0,
            radius_share=0.01,
            tilt_deviation=1.0,
        ),
        "imu_delay": Change(STAMPED, {"estimators/odometry/imu_delay": 0.02}),
        "chain": Change(ODOMETRY, {"estimators/odometry/chain": "front_left_leg"}),
        "touch": Change(ODOMETRY, {"estimators/odometry/touch": 60.0}, {"estimators/odometry/forces": True}),
        **{
            f"{low_pass}.{tag}": Change(
                ODOMETRY,
                {f"estimators/odometry/{low_pass}/{tag}": value},
                {f"estimators/odometry/{low_pass}": {"cut_off_frequency": 20.0}},
            )
            for low_pass in ("filter", "velocity")
            for tag, value in (("cut_off_frequency", 30.0), ("damping", 2.0), ("unit", "Hz"))
        },
    },
    "Tags of the component `joint_states`": each(
        MOVING, MODULES + "joint_states/", chain="arm", wheels="arm", speed=0.7, wheel_acceleration=4.0
    ),
    "Tags of the component `support_shaping`": SHAPING,
    "Tags of the component `wheeled_motion`": WHEELS,
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
}
"""Changes by the section and the tag of docs/reference/configuration.md."""

REFUSED = {
    ("Tags of the component `inverse_dynamics`", "stack.tasks.NAME.damping"): OF_AN_INVERSE,
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
        {OUT + "desired/dofs/mapping": "OUTSIDE"},
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
    **{
        ("Tags of the component `wheeled_motion`", tag): "only `support_shaping` and `NwheelsZMPII` read it"
        for tag in ("margins", "workspaces", "margin_gain", "workspace_gain")
    },
    **{
        (f"Tags of the component `{component}`", tag): "nothing reads it, in the original neither"
        for component in ("wheeled_motion", "support_shaping")
        for tag in ("SUPPORT", "SHAPE")
    },
}
"""Tags of the original program that have no effect: a warning names the reason, and so does the page."""
