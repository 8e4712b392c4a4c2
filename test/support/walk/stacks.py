"""Changes of the tags of `inverse_kinematics` and `inverse_dynamics`: stacks, how references move, limits, contacts."""

import re
from collections.abc import Callable
from pathlib import Path

from support.walk.changes import BALANCING, COMMANDED_GAINS, HANDS, MODULES, REACHING, Change, each

COMPONENT = MODULES + "reaching/"
STACK = COMPONENT + "stack/"
TORQUES = {STACK + "limits/torques": {"weight": 10.0}}
APART = {STACK + "limits/collisions": {"pairs": [["base", "hand"]], "weight": 10.0}}
MOTION = {"speed": 0.5, "acceleration": 2.0, "turn_speed": 1.0, "turn_acceleration": 3.0, "feed_forward": False}
CIRCLE, LINE = {"radius": 0.1, "period": 1.0, "plane": "xz", "turns": 2.0}, {"to": [0.0, 0.0, 0.2], "speed": 0.5}
FIRST = {"time": 2.0, "position": [0.1, 0.0, 0.1], "orientation": [0.0, 0.0, 0.0, 1.0]}
REFERENCES = {
    "circle.radius": ("high", {"circle": CIRCLE}, 0.05),
    "circle.period": ("high", {"circle": CIRCLE}, 1.5),
    "circle.plane": ("high", {"circle": CIRCLE}, "yz"),
    "circle.normal": ("high", {"circle": {"radius": 0.1, "period": 1.0, "normal": [0.0, 1.0, 0.0]}}, [1.0, 0.0, 0.0]),
    "circle.turns": ("high", {"circle": CIRCLE}, 0.01),
    "line.to": ("high", {"line": LINE}, [0.2, 0.0, 0.1]),
    "line.speed": ("high", {"line": LINE}, 0.3),
    "line.duration": ("high", {"line": {"to": [0.0, 0.0, 0.2], "duration": 1.0}}, 0.8),
    "line.back": ("high", {"line": LINE}, True),
    "sine.amplitude": ("rest", {"sine": {"amplitude": {"elbow": 0.1}, "period": 1.0}}, {"elbow": 0.2}),
    "sine.period": ("rest", {"sine": {"amplitude": {"elbow": 0.1}, "period": 1.0}}, 1.5),
    "sine.turns": ("rest", {"sine": {"amplitude": {"elbow": 0.1}, "period": 1.0}}, 0.01),
    "waypoints.time": ("high", {"waypoints": [FIRST]}, [FIRST | {"time": 3.0}]),
    "waypoints.position": ("high", {"waypoints": [FIRST]}, [FIRST | {"position": [0.0, 0.0, 0.2]}]),
    "waypoints.orientation": ("high", {"waypoints": [FIRST]}, [FIRST | {"orientation": [0.0, 0.6, 0.0, 0.8]}]),
    "waypoints.joints": (
        "rest",
        {"waypoints": [{"time": 1.0, "joints": {"elbow": 0.1}}]},
        [{"time": 1.0, "joints": {"elbow": 0.05}}],
    ),
    "file": ("high", {"file": "way.csv"}, "other_way.csv"),
    "absolute": ("high", {"line": LINE}, True),
}
"""By the tag of a reference: the task that has it, the reference, and another value; of way-points all of them."""

TASKS = {
    "point": ("tilt", "pose"),
    "link": ("tilt", "arm"),
    "offset": ("hand", [0.0, 0.0, 0.1]),
    "relative": ("hand", "wheel"),
    "axes": ("hand", "world"),
    "axis": ("eye", [0.0, 0.0, 1.0]),
    "target": ("eye", [1.0, 0.0, 2.0]),
    "reference": ("rest", "folded"),
    "gain": ("hand", 3.0),
    "velocity": ("rest", 0.1),
    "weight": ("rest", 0.2),
    "damping": ("hand", 0.01),
    "correction": ("hand", 0.01),
    "rows": ("tilt", ["rx"]),
    "dofs": ("hand", ["arm"]),
    "without": ("hand", ["wheels"]),
}
FRAMES = {
    "type": ("floor", "link"),
    "link": ("floor", "arm"),
    "offset": ("pad", [0.2, 0.0, 0.0]),
    "orientation": ("pad", [0.0, 0.0, 1.0, 0.0]),
    "height": ("floor", 0.1),
    "axis": ("floor", [0.0, 1.0, 0.0]),
}


def _of_stack(bench: Callable[[Path], str], stack: str) -> dict[str, Change]:
    """Return changes of the tasks and frames of a stack, and of a task's reference."""
    tasks = {
        f"stack.tasks.NAME.{tag}": Change(bench, {f"{stack}tasks/{task}/{tag}": v}) for tag, (task, v) in TASKS.items()
    }
    references = {
        f"stack.tasks.NAME.reference.{tag}": Change(
            bench,
            {f"{stack}tasks/{task}/reference/{re.sub('(?<=waypoints).*', '', tag).replace('.', '/')}": value},
            {f"{stack}tasks/{task}/reference": before},
        )
        for tag, (task, before, value) in REFERENCES.items()
    }
    frames = {
        f"stack.frames.NAME.{tag}": Change(bench, {f"{stack}frames/{name}/{tag}": v})
        for tag, (name, v) in FRAMES.items()
    }
    return tasks | references | frames


def _of_motion(bench: Callable[[Path], str], component: str) -> dict[str, Change]:
    """Return changes of how references move."""
    return {
        f"{tag}.{part}": Change(
            bench, {f"{component}{path}/{part}": value}, {f"{component}{tag.split('.')[0]}": before}
        )
        for tag, path, before in (
            ("motion", "motion", {"speed": 0.7}),
            ("motions.NAME", "motions/hand", {"hand": {"speed": 0.7}}),
        )
        for part, value in MOTION.items()
    }


STACKS = {
    **each(REACHING, COMPONENT, chain="arm", closed_on="measurement", reach=0.3, tolerance=0.01, turn_tolerance=0.05),
    "deflection.time_constant": Change(REACHING, {COMPONENT + "deflection": {"time_constant": 0.1}}),
    "deflection.most": Change(
        REACHING, {COMPONENT + "deflection/most": 0.001}, {COMPONENT + "deflection": {"time_constant": 0.1}}
    ),
    "lead": Change(REACHING, {COMPONENT + "lead": 0.5}, {COMPONENT + "closed_on": "measurement"}),
    **each(HANDS, MODULES + "hands/", track="arm", reference="world", IK=["ns::ARMS"], tunning="fast"),
    "workspace_init": Change(HANDS, {MODULES + "hands/workspace_init": "wheels"}),
    "tunnings": Change(HANDS, {MODULES + "hands/tunnings/slow/ARMS": 0.7}),
    "stack.solver": Change(REACHING, {STACK + "solver": "null_spaces"}, {STACK + "limits": {}}),
    "stack.policy": Change(REACHING, {STACK + "policy": "stop"}),
    "stack.relax": Change(
        REACHING, {STACK + "relax": ["near"]}, {STACK + "policy": "relax", STACK + "limits/torques": {"scale": 1.0}}
    ),
    "stack.levels": Change(REACHING, {STACK + "levels": [["hand"], ["tilt", "high", "eye", "rest"]]}),
    **_of_stack(REACHING, STACK),
    **{
        f"stack.limits.{tag}": Change(REACHING, {f"{STACK}limits/{tag}": value})
        for tag, value in (("joints", False), ("speeds", False), ("speed_scale", 0.5), ("horizon", 1.0))
    },
    **{
        f"stack.limits.torques.{tag}": Change(REACHING, {f"{STACK}limits/torques/{tag}": value}, TORQUES)
        for tag, value in (("scale", 0.5), ("weight", 20.0))
    },
    **{
        f"stack.limits.workspace.NAME.{tag}": Change(REACHING, {f"{STACK}limits/workspace/near/{tag}": value})
        for tag, value in (("link", "arm"), ("relative", "wheel"), ("nearest", 0.1), ("farthest", 1.4), ("weight", 5.0))
    },
    **{
        f"stack.limits.collisions.{tag}": Change(REACHING, {f"{STACK}limits/collisions/{tag}": value}, APART)
        for tag, value in (("distance", 0.05), ("influence", 0.2), ("pairs", [["wheel", "hand"]]), ("weight", 20.0))
    },
    **_of_motion(REACHING, COMPONENT),
}
"""Changes by the tags of the component."""

BALANCED = MODULES + "balancing/"
DYNAMICS = {
    **{
        tag: change
        for tag, change in _of_stack(BALANCING, BALANCED + "stack/").items()
        if tag != "stack.tasks.NAME.damping"
    },
    **each(BALANCING, BALANCED, track="wheels", friction=0.01, settle=5.0, follow=0.1, fade=0.5),
    **each(BALANCING, BALANCED, tolerance=0.01, turn_tolerance=0.05),
    **_of_motion(BALANCING, BALANCED),
    "stack.tasks.NAME.velocity_gain": Change(BALANCING, {BALANCED + "stack/tasks/hand/velocity_gain": 3.0}),
    "stack.levels": Change(BALANCING, {BALANCED + "stack/levels": [["hand", "tilt", "high", "eye", "rest"]]}),
    "sole": Change(BALANCING, {BALANCED + "sole": [0.2, 0.1]}),
    "torsion": Change(BALANCING, {BALANCED + "torsion": 0.0}),
    "speed_driven": Change(BALANCING, {BALANCED + "speed_driven": "whole"}),
    **{
        f"gains.{gain}": Change(
            BALANCING,
            {BALANCED + "gains": [{"chain": "all", "stiffness": 1.0, "damping": 1.0} | {gain: value}]},
            COMMANDED_GAINS | {BALANCED + "gains": [{"chain": "all", "stiffness": 1.0, "damping": 1.0}]},
        )
        for gain, value in (("chain", "arm"), ("stiffness", 2.0), ("damping", 2.0))
    },
    **{
        f"stack.limits.{tag}": Change(BALANCING, {f"{BALANCED}stack/limits/{tag}": value})
        for tag, value in (
            ("joints", False),
            ("speeds", False),
            ("speed_scale", 0.01),
            ("torque_scale", 0.01),
            ("braking", 0.1),
            ("horizon", 1.0),
        )
    },
}
"""Changes by the tags of `inverse_dynamics`."""

OF_AN_INVERSE = Change(BALANCING, {BALANCED + "stack/tasks/hand/damping": 0.01})
"""What `inverse_dynamics` refuses."""
