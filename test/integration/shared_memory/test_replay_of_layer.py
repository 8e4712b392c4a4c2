"""What a real-time layer recorded of CENTAURO in shared memory is replayed to the same commands."""

import json
from contextlib import closing

import numpy as np
from support.integration.world import CONFIG

from solfer.config import load
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import Registry, generate
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules, ExecutorTelemetry
from solfer.recording.reader import read
from solfer.recording.writer import RecordingWriter
from solfer.telemetry.black_box import BlackBox
from solfer.telemetry.drain import RecordDrain
from solfer.transport.middleware import SEED
from solfer_tools.cli.main import main

PLUGIN = "joint_states"


def test_recording_of_layer_is_replayed(shared, tmp_path, capsys):
    """The MCAP file has the configuration, the seed and versions, all that `solfer replay` needs to repeat the run."""
    shared.bus.parameters[SEED] = "3"
    node = shared.node(PLUGIN)
    plugin = generate(load(CONFIG / "centauro.yaml", PLUGIN, middleware="XBOT"), node, Registry().find(PLUGIN))
    shared.offers(plugin)
    box, file = BlackBox(tmp_path, [plugin]), tmp_path / "run.mcap"
    executor = Executor(
        [plugin],
        MemoryMiddleware(shared.bus, "xbot"),
        EmergencyStopLatch(tmp_path),
        rules=ExecutorRules(blend=0.2),
        telemetry=ExecutorTelemetry(nanoseconds=lambda: round(1e9 * shared.bus.time), black_box=box),
    )
    shared.bus.every(1.0 / executor.rate, node.poll)
    shared.bus.every(1.0 / executor.rate, executor.cycle)
    shared.run(0.05)
    executor.switchboard.commit(executor.switchboard.plan(start=[PLUGIN]))
    shared.run(0.5)
    assert shared.ask(state="mammal_wide_high").success
    shared.run(1.0)
    drain = RecordDrain(tmp_path)
    files = {name: text.encode() for name, text in drain.layout.attachments.items()}
    with closing(RecordingWriter(file, files, drain.layout.metadata)) as writer:
        drain.into(writer).fill()
        writer.finish(drain.lost)
    recording = read(file)
    tags = json.loads(recording.metadata[f"{PLUGIN}/tags"])
    assert tags["chain"] == "all" and recording.metadata["seed"] == "3"
    assert recording.metadata["numpy"] == np.__version__ and recording.metadata["solfer"].count(".") == 2
    assert [event.kind for event in recording.events if event.kind == "claim"]
    moved = recording[f"{PLUGIN}/command/position_controller/position"].values
    assert np.ptp(moved[-200:], axis=0).max() > 0.2
    code = main(["replay", str(file), "-n", PLUGIN])
    assert code == 0, capsys.readouterr()
