"""The file of an RT layer."""

from pathlib import Path

import pytest

from solfer.config.loading.rt_layer import read_layer
from solfer.errors import ConfigError, SolferError

CONFIG = Path(__file__).resolve().parents[3] / "config"


@pytest.mark.parametrize(("file", "rate"), [("xbot.yaml", 500.0), ("xbot_1kHz.yaml", 1000.0)])
def test_the_shipped_layers_run_joint_states_on_xbot(file, rate):
    layer = read_layer(CONFIG / file)
    (listed,) = layer.load()
    configuration = listed.configuration
    assert (listed.plugin, configuration.name, configuration.rate) == ("joint_states", "joint_states", rate)
    assert (configuration.middleware, configuration.module.layer) == ("XBOT", "RT")
    assert layer.executor.overruns == 20 and layer.executor.grace == 100


def written(folder, text):
    """Write a layer's file that names the shipped main configuration."""
    path = folder / "layer.yaml"
    path.write_text(text.replace("CENTAURO", str(CONFIG / "centauro.yaml")))
    return path


def test_the_blocks_of_the_original_are_enough(tmp_path):
    """Files of the original program stay valid: without any block of ours, with their plugins and renamed ones."""
    layer = read_layer(
        written(
            tmp_path,
            """
XBotRTPlugins: {plugins: [joint_states, other::joint_lower], io_plugins: []}
GazeboXBotPlugin: {control_rate: 0.001}
mwoibn: {config_file: CENTAURO}
""",
        )
    )
    found = layer.load(system="HW")
    assert [(each.plugin, each.configuration.name) for each in found] == [
        ("joint_states", "joint_states"),
        ("other", "joint_lower"),
    ]
    assert {each.configuration.system for each in found} == {"HW"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("XBotRTPlugins: {plugins: []}\nmwoibn: {config_file: CENTAURO}", "plugins"),
        ("XBotRTPlugins: {plugin: [joint_states]}\nmwoibn: {config_file: CENTAURO}", "did you mean: plugins"),
        ("XBotRTPlugins: {plugins: [joint_states]}\nmwoibn: {config_file: nowhere.yaml}", "nowhere.yaml"),
        ("mwoibn: {config_file: CENTAURO}", "XBotRTPlugins"),
        (
            "XBotRTPlugins: {plugins: [joint_states]}\nmwoibn: {config_file: CENTAURO}\nexecutor: {budgt: 0.1}",
            "did you mean: budget",
        ),
        (
            "XBotRTPlugins: {plugins: [joint_states]}\nmwoibn: {config_file: CENTAURO}\n"
            "executor: {start: [joint_lower]}",
            "not among the plugins",
        ),
    ],
)
def test_mistakes_have_their_places(tmp_path, text, words):
    with pytest.raises(SolferError) as error:
        read_layer(written(tmp_path, text))
    assert words in str(error.value) and "layer.yaml" in str(error.value)


def test_a_plugin_without_a_configuration_is_named(tmp_path):
    layer = read_layer(written(tmp_path, "XBotRTPlugins: {plugins: [joint_state]}\nmwoibn: {config_file: CENTAURO}"))
    with pytest.raises(SolferError, match="joint_state") as error:
        layer.load()
    assert not isinstance(error.value, ConfigError) and "joint_states" in str(error.value)


def test_a_main_configuration_names_its_layer(tmp_path):
    text = (CONFIG / "centauro.yaml").read_text().replace("support/", f"{CONFIG}/support/")
    main = tmp_path / "main.yaml"
    main.write_text(
        text.replace("  xbot: *ends", "  xbot: {<<: *ends, source: {config: {file: layer.yaml}, urdf: /robot}}")
    )
    (tmp_path / "layer.yaml").write_text(
        "XBotRTPlugins: {plugins: [joint_states]}\nmwoibn: {config_file: main.yaml}\nexecutor: {rate: 250}\n"
    )
    layer = read_layer(main)
    assert (layer.main, layer.executor.rate) == (str(main), 250.0)
    (tmp_path / "layer.yaml").unlink()
    with pytest.raises(ConfigError, match="there is no file") as error:
        read_layer(main)
    assert "main.yaml:" in error.value.where
