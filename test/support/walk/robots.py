"""Changes of tags in the files of a robot, its hardware and its world, by section and tag."""

from support.walk import benches
from support.walk.changes import (
    BUNDLE,
    CONTACT,
    MOCK,
    SETS,
    STIFFER,
    TIP,
    TOUCHING,
    WALK,
    WORLD,
    Change,
    each,
    position,
    rotation,
)
from support.walk.files import FILES, ROWS, TURNS

ROBOTS: dict[str, dict[str, Change]] = {
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
        "sensors.delay": Change(benches.simulation, {BUNDLE + "sensors/delay": 0.002}),
        **each(
            benches.simulation,
            BUNDLE,
            **{f"sensors__rates__{name}": 250 for name in ("joints", "base", "imu", "motors", "contacts")},
            **{
                f"sensors__joint_noise__{name}": 0.3
                for name in ("position", "velocity", "effort", "effort_offset", "resolution")
            },
            sensors__joint_noise__exact=True,
            sensors__imu__exact=True,
            sensors__imu__attitude__time_constant=0.5,
            sensors__imu__attitude__bias_time=0.5,
            **{
                f"sensors__imu__{sensor}__{name}": 0.3
                for sensor in ("gyroscope", "accelerometer")
                for name in ("density", "bias", "walk")
            },
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
        **each(
            benches.hardware,
            MOCK,
            **{
                f"joint_noise__{name}": 0.3
                for name in ("position", "velocity", "effort", "effort_offset", "resolution")
            },
            joint_noise__exact=True,
        ),
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
