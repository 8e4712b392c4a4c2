"""Contracts in the files that exporters write beside a network, as tags of the component that keep their places.

`deploy.yaml` of unitree_rl_lab, IO descriptors of Isaac Lab, and `config.yaml` of rl_sar with its `base.yaml`. Tags of
Python, as `!!python/tuple`, are read as the lists that they stand before; nothing of them is run.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from solfer.components.policy.tags import TERMS, PolicyTags
from solfer.config.records.record import parse
from solfer.config.yaml.compose import compose
from solfer.config.yaml.files import check_file, is_file, located, read_text
from solfer.config.yaml.nodes import Key, Mark, YamlNode, dotted
from solfer.config.yaml.problems import Problems
from solfer.errors import ComponentError, SizeMismatch, UnknownName, raise_all

EXPORTED = {
    "base_ang_vel": "angular_velocity",
    "ang_vel": "angular_velocity",
    "base_lin_vel": "linear_velocity",
    "lin_vel": "linear_velocity",
    "gravity_vec": "projected_gravity",
    "command": "commands",
    "velocity_commands": "commands",
    "generated_commands": "commands",
    "joint_pos": "joint_position",
    "joint_pos_rel": "joint_position",
    "dof_pos": "joint_position",
    "joint_vel": "joint_velocity",
    "joint_vel_rel": "joint_velocity",
    "dof_vel": "joint_velocity",
    "actions": "last_action",
    "gait_phase": "phase",
}
"""Terms by their names in files of mjlab, unitree_rl_lab, Isaac Lab and rl_sar."""

RANGES = {"x": ("lin_vel_x",), "y": ("lin_vel_y",), "yaw": ("ang_vel_z", "ang_vel_yaw")}
"""Names of the ranges of commands."""

KINDS = {"JointPositionAction": "position", "JointVelocityAction": "velocity", "JointEffortAction": "torque"}
"""What actions are, by their names in Isaac Lab."""

UNBOUNDED = 1e9
"""Bound of numbers that have none."""

_PYTHON = "unknown tag 'tag:yaml.org,2002:python/"


def exported_tags(tags: PolicyTags) -> PolicyTags | None:
    """Read the contract that the tag `contract` names; None: there is none.

    Raises:
        SolferError: The file cannot be read, or is none of those that are known, or does not fit.
    """
    if tags.contract is None:
        return None
    where = tags.where("contract")
    path = located(tags.contract, tags.folder("contract"), where)
    check_file(path, where)
    tree = _tree(path, where)
    if "joint_ids_map" in tree.entries():
        made = _unitree(tree, tags)
    elif "articulations" in tree.entries():
        made = _isaac(tree)
    else:
        made = _rl_sar(path, tree)
    problems = Problems()
    parsed = parse(YamlNode(made, tree.mark), PolicyTags, problems, file=tags.file)
    problems.raise_if_any()
    return parsed


def term_of(name: str, where: str) -> str:
    """Return the term that an exporter calls `name`.

    Raises:
        UnknownName: There is none.
    """
    term = EXPORTED.get(name, name)
    if term not in TERMS:
        raise UnknownName("term", name, (*TERMS, *EXPORTED), where=where)
    return term


def _tree(path: Path, where: str) -> YamlNode:
    problems = Problems()
    tree = compose(read_text(os.fspath(path), where), os.fspath(path), problems)
    raise_all([error for error in problems.errors if not error.what.startswith(_PYTHON)])
    return tree


def _need(node: YamlNode, *path: Key) -> YamlNode:
    found = node.get(*path)
    if found is None:
        what = f"there is no '{dotted(path)}'"
        raise ComponentError(what, where=str(node.nearest(path).head), expected="a file as its exporter writes it")
    return found


def _list(node: YamlNode, kind: type = float) -> list[YamlNode]:
    """Return the items of a list, all of which are of a kind."""
    expected = {float: "numbers", int: "whole numbers", str: "texts", dict: "maps", tuple: "lists"}[kind]
    if not isinstance(node.value, tuple):
        raise ComponentError(f"{node.kind} instead of a list", where=str(node.head), expected=f"a list of {expected}")
    for item in node.value:
        if not isinstance(item.value, (int, float) if kind is float else kind) or isinstance(item.value, bool):
            raise ComponentError(f"{item.kind} in a list of {expected}", where=str(item.mark), expected=expected)
    return list(node.value)


def _floats(node: YamlNode) -> list[float]:
    return [cast(float, item.value) for item in _list(node)]


def _integers(node: YamlNode) -> list[int]:
    return [cast(int, item.value) for item in _list(node, int)]


def _texts(node: YamlNode) -> list[str]:
    return [cast(str, item.value) for item in _list(node, str)]


def _node(value: Any, mark: Mark) -> YamlNode:
    """Return a Node of a plain value, of which all parts are at one place; Nodes in it keep theirs."""
    if isinstance(value, YamlNode):
        return value
    if isinstance(value, Mapping):
        value = {key: _node(each, mark) for key, each in value.items()}
    elif isinstance(value, Sequence) and not isinstance(value, str):
        value = tuple(_node(each, mark) for each in value)
    return YamlNode(value, mark)


def _picked(numbers: YamlNode, ids: Sequence[int]) -> YamlNode:
    items = _list(numbers)
    if max(ids, default=-1) >= len(items):
        expected = f"{max(ids) + 1} or more"
        raise SizeMismatch(f"there are {len(items)} numbers", where=str(numbers.head), expected=expected)
    return replace(numbers, value=tuple(items[each] for each in ids))


def _ids(node: YamlNode, count: int, what: str) -> list[int]:
    """Return numbers of a list of `count` things, each once."""
    found = _integers(node)
    for place, (number, item) in enumerate(zip(found, _list(node, int), strict=True)):
        if not 0 <= number < count:
            expected = f"numbers from 0 to {count - 1}"
            raise SizeMismatch(f"number {number} of {count} {what}", where=str(item.mark), expected=expected)
        if number in found[:place]:
            raise ComponentError(f"number {number} stands twice", where=str(item.mark), expected="each once")
    return found


def _clip(node: YamlNode | None, scales: Sequence[float]) -> float:
    """Return the bound behind a scale of numbers that are bounded before it."""
    if node is None:
        return UNBOUNDED
    bounds = _floats(node)
    sizes = {abs(scale) for scale in scales}
    if len(bounds) != 2 or bounds[0] != -bounds[1] or len(sizes) != 1:
        what = f"bounds {bounds} before a scale"
        raise ComponentError(what, where=str(node.head), expected="bounds [-a, a], and one scale of the term")
    return bounds[1] * sizes.pop()


def _observation(name: str, node: YamlNode, overloads: YamlNode) -> dict[str, Any]:
    """Return the tags of a term of Isaac Lab, whose numbers are bounded before they are scaled."""
    made: dict[str, Any] = {"term": _node(term_of(name, str(node.head)), node.head)}
    scale = overloads.get("scale")
    scales = [1.0]
    if scale is not None:
        scales = _floats(scale if isinstance(scale.value, tuple) else _node([scale], scale.mark))
        made["scale"] = scale if len({*scales}) > 1 else _node(scales[0], scale.mark)
    made["clip"] = _node(_clip(overloads.get("clip"), scales), node.head)
    history = overloads.get("history_length")
    if history is not None and history.value != 0:
        made["history"] = history
    return made


def _unitree(tree: YamlNode, tags: PolicyTags) -> dict[str, YamlNode]:
    """Return the tags of a `deploy.yaml`, whose gains are in the order of the motors, the rest in the network's."""
    numbers = _need(tree, "joint_ids_map")
    ids = _integers(numbers)
    made: dict[str, YamlNode] = {"default": _need(tree, "default_joint_pos")}
    if tags.motors is not None:
        ids = _ids(numbers, len(tags.motors), "motors")
        joints = [_node(tags.motors[each], item.mark) for each, item in zip(ids, _list(numbers), strict=True)]
        made["joints"] = _node(joints, numbers.mark)
    gains = {}
    for gain in ("stiffness", "damping"):
        listed = tree.get(gain)
        if listed is not None:
            # a file for fewer joints than motors has the gains of these alone
            order = [sorted(ids).index(each) for each in ids] if len(_list(listed)) == len(ids) else ids
            gains[gain] = _picked(listed, order)
    made["gains"] = _node(gains, tree.mark)
    step = _need(tree, "step_dt")
    made["rate"] = _node(1.0 / _positive(step), step.mark)
    if ranges := tree.get("commands", "base_velocity", "ranges"):
        made["command_range"] = _ranges(ranges)
    actions = _need(tree, "actions")
    name, action = _only(actions, "action")
    made["action"] = _action(action, name, made["default"])
    chosen = action.get("joint_ids")
    if chosen is not None and not _is_slice_of_all(chosen):
        if _integers(chosen) != [*range(len(ids))]:
            raise ComponentError("actions of some of the joints", where=str(chosen.head), expected="those of all")
    terms = []
    for term, node in _need(tree, "observations").items():
        found = _observation(term, node, node)
        if found["term"].value == "phase":
            period = _need(node, "params", "period")
            ahead = _positive(step) / _positive(period)  # its first step is one step behind the start
            found |= {"period": period, "offsets": _node([ahead], period.mark)}
        elif picked := node.get("params", "asset_cfg", "joint_ids"):
            if picked.value:
                found["pick"] = picked
        terms.append(_node(found, node.head))
    made["observations"] = _node(terms, _need(tree, "observations").head)
    return made


def _action(node: YamlNode, name: str, default: YamlNode) -> YamlNode:
    """Return the tags of an action of Isaac Lab: scaled, then its offset is added, then it is bounded."""
    if name not in KINDS:
        raise UnknownName("action", name, KINDS, where=str(node.head))
    made: dict[str, Any] = {"kind": _node(KINDS[name], node.head)}
    if (scale := node.get("scale")) is not None:
        made["scale"] = scale
    made["clip"] = _node(UNBOUNDED, node.head)
    if (offset := node.get("offset")) is not None:
        added = _floats(offset) if isinstance(offset.value, tuple) else [offset.value]
        poses = _floats(default)
        expected = poses if name == "JointPositionAction" else [0.0] * len(poses)
        if len(added) == 1:
            added = added * len(expected)
        if added != expected:
            what = "the offset of the actions is not that of the observed positions"
            raise ComponentError(what, where=str(offset.head), expected=f"{expected}")
    if (clip := node.get("clip")) is not None:
        pairs = [_list(pair) for pair in _list(clip, tuple)]
        if any(len(pair) != 2 for pair in pairs):
            raise SizeMismatch("bounds that are no pairs", where=str(clip.head), expected="[lower, upper] a joint")
        made["lower"], made["upper"] = (_node([pair[each] for pair in pairs], clip.mark) for each in (0, 1))
    return _node(made, node.head)


def _is_slice_of_all(node: YamlNode) -> bool:
    """Return whether a list is a slice of Python without bounds: three nulls."""
    return isinstance(node.value, tuple) and all(item.value is None for item in node.value)


def _only(node: YamlNode, what: str) -> tuple[str, YamlNode]:
    found = list(node.items())
    if len(found) != 1:
        names = ", ".join(name for name, _ in found) or "none"
        raise ComponentError(f"{len(found)} {what}s: {names}", where=str(node.head), expected=f"one {what}")
    return found[0]


def _positive(node: YamlNode) -> float:
    if not isinstance(node.value, (int, float)) or isinstance(node.value, bool) or not node.value > 0.0:
        raise ComponentError(f"{node.kind} instead of a number", where=str(node.head), expected="a number above zero")
    return node.value


def _ranges(node: YamlNode) -> YamlNode:
    found = {key: node.get(name) for key, names in RANGES.items() for name in names if node.get(name) is not None}
    return _node(found, node.head)


def _isaac(tree: YamlNode) -> dict[str, YamlNode]:
    """Return the tags of the IO descriptors of Isaac Lab, in which joints have names."""
    actions = _list(_need(tree, "actions"), dict)
    if len(actions) != 1:
        what = f"{len(actions)} actions"
        raise ComponentError(what, where=str(_need(tree, "actions").head), expected="one of all joints")
    action = actions[0]
    joints = _need(action, "joint_names")
    names = _texts(joints)
    _, robot = _only(_need(tree, "articulations"), "articulation")
    known = _texts(_need(robot, "joint_names"))
    order = [_index(item, known) for item in _list(joints, str)]
    made = {"joints": joints, "default": _picked(_need(robot, "default_joint_pos"), order)}
    gains = {}
    for gain in ("stiffness", "damping"):
        listed = robot.get(f"default_joint_{gain}")
        if listed is not None and any(item.value for item in _list(listed)):  # zeros are of a model of the drives
            gains[gain] = _picked(listed, order)
    made["gains"] = _node(gains, robot.mark)
    step = _need(tree, "scene", "dt")
    made["rate"] = _node(1.0 / _positive(step), step.mark)
    path = _need(action, "full_path")
    made["action"] = _action(action, str(path.value).rpartition(".")[2], made["default"])
    terms = []
    group = _need(tree, "observations", "policy")
    for node in _list(group, dict):
        found = _observation(str(_need(node, "name").value), _need(node, "name"), node.get("overloads") or node)
        if (own := node.get("joint_names")) is not None:
            pick = [_index(item, names) for item in _list(own, str)]
            if pick != [*range(len(names))]:
                found["pick"] = _node(pick, own.mark)
        terms.append(_node(found, node.mark))
    made["observations"] = _node(terms, group.head)
    return made


def _index(item: YamlNode, names: Sequence[str]) -> int:
    if item.value not in names:
        raise UnknownName("joint", str(item.value), names, where=str(item.mark))
    return names.index(str(item.value))


def _rl_sar(path: Path, tree: YamlNode) -> dict[str, YamlNode]:
    """Return the tags of a `config.yaml` over the `base.yaml` of its robot."""
    _, config = _only(tree, "policy")
    base = path.parent.parent / "base.yaml"
    entries = _only(_tree(base, str(tree.mark)), "robot")[1].entries() if is_file(base) else {}
    whole = replace(config, value={**entries, **config.entries()})
    names = _list(_need(whole, "joint_names"), str)
    mapping = _need(whole, "joint_mapping")
    order = _ids(mapping, len(names), "joints")
    step = _need(whole, "dt")
    made: dict[str, YamlNode] = {
        "joints": _node([names[each] for each in order], mapping.mark),
        "default": _need(whole, "default_dof_pos"),
        "gains": _node({"stiffness": _need(whole, "rl_kp"), "damping": _need(whole, "rl_kd")}, whole.mark),
        "rate": _node(1.0 / (_positive(step) * _positive(_need(whole, "decimation"))), step.mark),
    }
    if (wheels := whole.get("wheel_indices")) is not None and wheels.value:
        what = "wheels are moved by velocities, and other joints by positions"
        raise ComponentError(what, where=str(wheels.head), expected="actions of one kind: `wheel_indices: []`")
    bounds = {abs(each) for end in ("lower", "upper") for each in _floats(_need(whole, f"clip_actions_{end}"))}
    if len(bounds) != 1:
        where = str(_need(whole, "clip_actions_lower").head)
        raise ComponentError("different bounds of actions", where=where, expected="one amount for all")
    made["action"] = _node({"scale": _need(whole, "action_scale"), "clip": bounds.pop()}, whole.mark)
    listed = _need(whole, "observations")
    scales = ("ang_vel", "lin_vel", "dof_pos", "dof_vel", "commands")
    history = _history(whole, made)
    terms = []
    for item in _list(listed, str):
        name = str(item.value)
        found = {"term": term_of(name, str(item.mark)), "clip": _need(whole, "clip_obs"), "history": history}
        terms.append(_node(found | ({"scale": _need(whole, f"{name}_scale")} if name in scales else {}), item.mark))
    made["observations"] = _node(terms, listed.head)
    return made


def _history(whole: YamlNode, made: dict[str, YamlNode]) -> int:
    """Return how many steps are observed, of which 0 is the newest; writes in which order."""
    steps = whole.get("observations_history")
    ids = _integers(steps) if steps is not None else []
    if len(ids) < 2:
        return 1
    assert steps is not None
    priority = _need(whole, "observations_history_priority")
    orders = {
        ("term", True): "terms",
        ("time", True): "oldest_step_first",
        ("time", False): "newest_step_first",
    }
    falls = ids == [*range(len(ids) - 1, -1, -1)]
    order = orders.get((str(priority.value), falls))
    if order is None or not falls and ids != [*range(len(ids))]:
        what = f"a history of the steps {ids} by {priority.value}"
        expected = "all steps, by time, or by term with the oldest first"
        raise ComponentError(what, where=str(steps.head), expected=expected)
    made["history_order"] = _node(order, priority.mark)
    return len(ids)
