"""A real-time layer reports its pipes, and a wrong topic, beside its loop; its parameters change by command."""

import signal

import pytest
from support.integration.xbot_system import REPOSITORY, WAIT, until
from support.integration.xbot_system import system as made

from solfer_tools.cli.main import main

CONFIG = REPOSITORY / "config" / "centauro.yaml"
SINK = "velocity_controller:\n        sink: /command"


@pytest.fixture
def system():
    with made() as system:
        yield system


@pytest.mark.soak
def test_a_command_without_a_controller_is_reported(system, tmp_path):
    """A misspelt topic moves nothing and looks like a broken robot: the report gives file, line and nearest names."""
    file, layer = tmp_path / "centauro.yaml", tmp_path / "layer.yaml"
    shipped = CONFIG.read_text().replace("{file: ", f"{{file: {CONFIG.parent}/")
    text = shipped.replace(SINK, SINK.replace("command", "comand"))
    file.write_text(text)
    layer.write_text(f"""
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {file}}}
executor: {{start: [joint_states], blend: 0.2, overruns: 1000000, schedule: {{priority: 0}}}}
""")
    line = text[: text.index("/comand")].count("\n") + 1
    system.simulate()
    process = system.start(REPOSITORY / "nodes" / "xbot", str(layer), "--namespace", system.name)
    until(lambda: "joint_states pipes" in system.middleware.reports(), "a report of its pipes", 3.0 * WAIT)
    report = system.middleware.reports()["joint_states pipes"]
    summary = "no subscriber on velocity_controller/comand (controller 'velocity_controller', "
    assert report.level == 1 and report.summary.startswith(summary)
    assert f"{file}:{line}:" in report.summary
    assert report.summary.endswith("did you mean velocity_controller/command, position_controller/command?")
    process.send_signal(signal.SIGINT)
    assert process.wait(WAIT) == 0
    lines = [line for line in process.stdout.read().splitlines() if "no subscriber" in line]
    assert lines and all(line.endswith(f"joint_states: {report.summary}") for line in lines)


@pytest.mark.soak
def test_commands_show_each_pipe_of_a_layer_and_change_a_parameter(system, tmp_path, capsys):
    """`solfer top` and `solfer params` reach the plugins of a real-time layer as they reach those of nodes."""
    layer = tmp_path / "layer.yaml"
    layer.write_text(f"""
XBotRTPlugins: {{plugins: [joint_states]}}
mwoibn: {{config_file: {CONFIG}}}
executor: {{start: [joint_states], blend: 0.2, overruns: 1000000, schedule: {{priority: 0}}}}
""")
    system.simulate()
    system.start(REPOSITORY / "nodes" / "xbot", str(layer), "--namespace", system.name)
    part = "joint_states controller velocity_controller"
    until(lambda: part in system.middleware.reports(), "a report of a pipe", 3.0 * WAIT)
    until(lambda: system.middleware.reports()[part].summary == "sent", "commands")
    assert main(["top", "--once", "--namespace", system.name]) == 0
    lines = [line.split(maxsplit=4) for line in capsys.readouterr().out.splitlines()]
    assert ["joint_states", "controller", "velocity_controller", "GOOD", "sent"] in lines
    assert [line[3:] for line in lines if line[1:2] == ["feedback"]] == [["GOOD", "received"]]
    assert any(line[:1] == ["lower_level"] for line in lines)
    assert main(["params", "set", "joint_states", "speed=0.7", "--namespace", system.name]) == 0
    assert main(["params", "get", "joint_states", "speed", "--namespace", system.name]) == 0
    assert capsys.readouterr().out == "speed=0.7\n"
