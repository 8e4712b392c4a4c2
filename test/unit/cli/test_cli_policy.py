"""`solfer policy check`: a network beside a robot, by its metadata or by the tags of a module."""

import numpy as np
import pytest
from support.plugins.plugin import configuration
from support.unit import onnx_files

from solfer_tools.cli.main import main

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

JOINTS = ("torso_yaw", "neck_yaw")


def network(folder, **metadata):
    return onnx_files.linear(folder / "network.onnx", np.zeros((7, 2)), np.zeros(2), metadata=metadata)


def test_metadata_alone_are_enough(tmp_path, capsys):
    file = network(
        tmp_path,
        joint_names=",".join(JOINTS),
        default_joint_pos="0.1,0.2",
        joint_stiffness="[20, 30]",
        observation_names="base_ang_vel,joint_pos,actions",
    )
    assert main(["policy", "check", str(file), "--robot", "centauro", "--rollout", "2"]) == 2
    assert main(["policy", "check", str(file), "--robot", "centauro"]) == 0
    printed = capsys.readouterr().out
    assert "7 observations, 2 actions, states: none" in printed
    rows = {line.split()[0]: line.split()[1:] for line in printed.splitlines() if line}
    assert rows["angular_velocity"] == ["3", "1"] and rows["last_action"] == ["2", "1"]
    assert rows["torso_yaw"] == ["0.1", "1", "20", "lower", "level's"]


def test_tags_of_a_module_and_what_does_not_fit(tmp_path, capsys):
    network(tmp_path)
    tags = {"class": "solfer.components.policy:Policy", "file": "network.onnx", "default": 0.0, "joints": list(JOINTS)}
    terms = [{"term": term} for term in ("angular_velocity", "joint_position", "last_action")]
    command = ["policy", "check", str(configuration(tmp_path, **tags, observations=terms)), "-n", "test"]
    assert main([*command, "--robot", "centauro"]) == 0
    assert main([*command, "--robot", "centaur"]) == 2
    configuration(tmp_path, **tags, observations=terms[1:])
    assert main([*command, "--robot", "centauro"]) == 2
    printed = capsys.readouterr().err
    assert "4 numbers, and the network observes 7" in printed and "joint_position 2, last_action 2" in printed
