#!/usr/bin/env python3
"""Cost of a recording: in the cycle of a plugin on CENTAURO, and in the process that writes the file.

Run with `./run exec python benchmark/recording.py [CYCLES]` (default 5000). The first line is of one cycle, with
nothing between two of them, in microseconds. The others compare our writer with that of `mcap-ros2-support`, on the
same rows.
"""

import tempfile
import time
from contextlib import closing
from pathlib import Path

import numpy as np
from form import Figures, parser_of
from mcap_ros2.writer import Writer
from plugin import measure, start

from solfer.recording.kinds import COLUMNS_KIND, definition, ros_name
from solfer.recording.writer import RecordingWriter
from solfer.telemetry.black_box import BlackBox
from solfer.telemetry.drain import RecordDrain

ROWS = 250


def cost(cycles: int, figures: Figures) -> None:
    """Print what a recording costs in a cycle, and write a file of it."""
    bus, plugin = start()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with closing(BlackBox(folder, [plugin])) as box:
            moment = iter(range(10**9, 2 * 10**9))
            median, late = measure(lambda: box.record(next(moment), 0, 0), cycles)
            figures.row("record a cycle", p50_us=median, p99_us=late)
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
                figures.row("a row", numbers=block.width, messages=len(block.topics))
                size = writer.size / ROWS * plugin.rate * 3600e-9
                figures.row("our writer", message_us=1e6 * took / messages, hour_gb=size)
            taken = theirs(folder / "theirs.mcap", rows, block)
            figures.row("mcap-ros2-support", message_us=1e6 * taken / messages, hour_gb=None)


def theirs(path: Path, rows: tuple[np.ndarray, np.ndarray, np.ndarray], block) -> float:
    """Return the time that the same rows take with a library, as generic columns [s]."""
    begin = time.process_time()
    with path.open("wb") as file, Writer(file) as writer:
        schema = writer.register_msgdef(ros_name(COLUMNS_KIND), definition(COLUMNS_KIND))
        width = block.width // len(block.topics)
        for number, moment, values in zip(*rows, strict=True):
            for place, topic in enumerate(block.topics):
                part = values[place * width : (place + 1) * width]
                stamp = {"sec": 0, "nanosec": 0}
                message = {"header": {"stamp": stamp, "frame_id": ""}, "values": part.tolist()}
                writer.write_message(topic.name, schema, message, int(moment), int(moment), int(number))
    return time.process_time() - begin


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("cycles", nargs="?", type=int, default=5000, help="that are timed (default: %(default)s)")
    given = parser.parse_args()
    cost(given.cycles, Figures(given.json))
