"""The executor on shared memory: its services and those of its plugins answer."""

import time

from support.integration.xbot_system import WAIT
from support.realtime.executor_plugins import Layer

from solfer.components.move_joints import MoveJoints, Reply
from solfer.plugins import PluginState
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import Flag, NoFields


def test_services_switch_call_and_abort_a_layer(shared, tmp_path):
    """The XBOT names and the plugin's own both work, and refusals state the plugin's state or the emergency stop."""
    layer = Layer(shared, tmp_path / "estop", [("joint_states",)])
    asker = layer.node("asker")

    def ask(service, interface, request, reply=Answer):
        answer = asker.request(service, interface, request, reply, 5.0)
        end = time.monotonic() + WAIT
        while not answer.done() and time.monotonic() < end:
            shared.run(0.002)  # what a thread prepares takes real time
            asker.poll()
        return answer.result(0)

    assert ask("xbotcore/joint_states_switch", "std_srvs/SetBool", Flag(True)).success
    shared.run(1.0)
    assert ask("joint_states/state", "std_srvs/Trigger", NoFields()).message == "RUNNING"
    again = ask("joint_states/switch", "std_srvs/SetBool", Flag(True))
    assert not again.success and "cannot be started: RUNNING" in again.message
    assert ask("joint_states/trajectory", "solfer/MoveJoints", MoveJoints("mammal_wide_high"), Reply).success
    assert not ask("xbotcore/estop_clear", "std_srvs/Trigger", NoFields()).success  # it runs
    assert ask("joint_states/abort", "std_srvs/Trigger", NoFields()).success
    assert layer["joint_states"].state is PluginState.ABORTED
    assert ask("xbotcore/estop", "std_srvs/Trigger", NoFields()).success
    refused = ask("joint_states/switch", "std_srvs/SetBool", Flag(True))
    assert not refused.success and "emergency stop" in refused.message
    assert ask("xbotcore/estop_clear", "std_srvs/Trigger", NoFields()).success
