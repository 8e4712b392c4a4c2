#!/usr/bin/env python3
"""Cost of a recording: in the cycle of a plugin on CENTAURO, and in the process that writes the file.

Run with `./run exec python benchmark/recording.py [CYCLES]` (default 5000). The first line is of one cycle, with
nothing between two of them, in microseconds. The others compare our writer with that of `mcap-ros2-support`, on the
same rows.
"""

import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np
from mcap_ros2.writer import Writer
from plugin import measure, start

from solfer.realtime.telemetry.black_box import BlackBox
from solfer.realtime.telemetry.drain import RecordDrain
from solfer.recording.kinds import COLUMNS, definition, ros_name
from solfer.recording.writer import RecordingWriter

ROWS = 250


def cost(cycles: int) -> None:
    """Print what a recording costs in a cycle, and write a file of it."""
    bus, plugin = start()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with closing(BlackBox(folder, [plugin])) as box:
            moment = iter(range(10**9, 2 * 10**9))
            median, late = measure(lambda: box.record(next(moment), 0, 0), cycles)
            print(f"{'record a cycle':<28} {median:6.2f} us p50 {late:6.2f} us p99")
            for _ in range(ROWS):
                bus.run_until(bus.time + 1.0 / plugin.rate)
                plugin.cycle()
                box.record(round(1e9 * bus.time), 0, 0)
            drain = RecordDrain(folder)
            drain.skip()
            for _ in range(ROWS):
                bus.run_until(bus.time + 1.0 / plugin.rate)
                plugin.cycle()
                box.record(round(1e9 * bus.time), 0, 0)
            (rows,) = drain.batches()
            with closing(RecordingWriter(folder / "ours.mcap")) as writer:
                block, begin = writer.block(drain.layout.channels), time.process_time()
                writer.write(block, *rows)
                took = time.process_time() - begin
                messages = ROWS * len(block.topics)
                print(f"{'row of':<28} {block.width} numbers in {len(block.topics)} messages")
                size = writer.size / ROWS * plugin.rate * 3600e-9
                print(f"{'our writer':<28} {1e6 * took / messages:6.2f} us a message, {size:.2f} GB an hour")
            theirs(folder / "theirs.mcap", rows, block)


def theirs(path: Path, rows: tuple[np.ndarray, np.ndarray, np.ndarray], block) -> None:
    """Print what the same rows take with a library, as generic columns."""
    begin = time.process_time()
    with path.open("wb") as file, Writer(file) as writer:
        schema = writer.register_msgdef(ros_name(COLUMNS), definition(COLUMNS))
        width = block.width // len(block.topics)
        for number, moment, values in zip(*rows, strict=True):
            for place, topic in enumerate(block.topics):
                part = values[place * width : (place + 1) * width]
                stamp = {"sec": 0, "nanosec": 0}
                message = {"header": {"stamp": stamp, "frame_id": ""}, "values": part.tolist()}
                writer.write_message(topic.name, schema, message, int(moment), int(moment), int(number))
    took = time.process_time() - begin
    print(f"{'mcap-ros2-support':<28} {1e6 * took / (len(rows[0]) * len(block.topics)):6.2f} us a message")


if __name__ == "__main__":
    cost(int(sys.argv[1]) if len(sys.argv) > 1 else 5000)
