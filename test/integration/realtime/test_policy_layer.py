"""The example's policy in a real-time layer at 500 Hz, beside the simulator."""

import pytest
import yaml
from support.integration.world import CONFIG
from support.integration.xbot_system import REPOSITORY, WAIT, system, until

from solfer.plugins import PluginState

pytest.importorskip("onnxruntime", reason="needs pip install -r requirements-policy.txt")

EXAMPLE = CONFIG.parent / "examples/policy"


@pytest.mark.soak
def test_a_policy_runs_in_the_layer(tmp_path):
    """It starts by itself, moves the legs, and runs on."""
    tree = yaml.safe_load((EXAMPLE / "level.yaml").read_text())
    tree["mwoibn"]["modules"]["level"] |= {"layer": "RT", "file": str(EXAMPLE / "level.onnx")}
    (tmp_path / "main.yaml").write_text(yaml.safe_dump(tree))
    executor = {"rate": 500.0, "start": ["level"], "blend": 0.5}
    main = {"config_file": str(tmp_path / "main.yaml")}
    layer = tmp_path / "layer.yaml"
    layer.write_text(yaml.safe_dump({"XBotRTPlugins": {"plugins": ["level"]}, "mwoibn": main, "executor": executor}))
    with system() as layers:
        layers.simulate()
        layers.start(REPOSITORY / "nodes/xbot", str(layer), "--namespace", layers.name)
        until(lambda: layers.state() is PluginState.RUNNING, "a policy that runs", WAIT)
        knee = layers.joints.index("knee_pitch_1")
        start = layers.samples[-1]
        until(lambda: layers.look() and layers.samples[-1][0] > start[0] + 3.0, "three seconds", WAIT)
        assert layers.state() is PluginState.RUNNING
        assert abs(layers.samples[-1][1][knee] - start[1][knee]) < 0.5
