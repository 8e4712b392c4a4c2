"""One run: from its settings to its result."""

import os
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from solfer.config.yaml.nodes import YamlNode
from solfer.telemetry.black_box import TRUTH_MESSAGE, BlackBox
from solfer.telemetry.drain import RecordDrain, writer_of
from solfer_tools.study.measures import Columns, evaluated, measured
from solfer_tools.study.plan import record_of
from solfer_tools.study.records import StudyRecord
from solfer_tools.study.result import Result
from solfer_tools.study.simulated_run import SimulatedRun


def run(
    configuration: str | os.PathLike,
    plugins: list[str],
    duration: float,
    *,
    seed: int = 0,
    changes: Mapping[str, Any] | None = None,
    recording: Path | None = None,
    **tags: Any,
) -> Result:
    """Make one simulated run, in this process.

    Args:
        configuration: Main configuration of the plugins.
        plugins: Those that run: `plugin::configuration`, `plugin`, or a shared plugin.
        duration: Time of the motion [s].
        seed: Of noise and transport.
        changes: Values by their paths in the configuration, such as `{"modules/locomotion/rest": False}`.
        recording: File of a recording, MCAP; None: none.
        **tags: Further tags of a study: `simulation`, `motion`, `measure`, `fails`, `settle`.

    Raises:
        SolferError: Something of this is wrong. SolferErrors: Several mistakes.
    """
    tree = {"configuration": os.fspath(configuration), "plugins": plugins, "duration": duration, **tags}
    record, over = record_of(tree, changes or {})
    return carry_out(record, seed, over, variations={}, recording=recording)


def carry_out(
    record: StudyRecord,
    seed: int,
    changes: YamlNode | None,
    variations: Mapping[str, Any],
    recording: Path | None = None,
    *,
    columns: Path | None = None,
    gui: bool = False,
) -> Result:
    """Carry out a run of a study, and measure it.

    Args:
        record: What runs.
        seed: Of noise and transport.
        changes: What is laid over the configuration; None: nothing.
        variations: What varies, by name, for expressions.
        recording: File of a recording, MCAP; None: none.
        columns: File for the columns that are measured, NPZ, 400 rows at most; None: none.
        gui: Open PyBullet's window.

    Raises:
        SolferError: Something of this is wrong, or the file cannot be written. SolferErrors: Several mistakes.
    """
    with SimulatedRun(record, seed, changes, gui=gui) as simulated:
        with nullcontext() if recording is None else recorded(simulated, recording):
            simulated.run_to_end()
        measures = measured(record.measure, simulated.columns, variations)
        if columns is not None:
            _keep_columns(simulated.columns, columns)
        failure = simulated.failure
        values = {**{name: value for name, value in variations.items() if name.isidentifier()}, **measures}
        for name, expression in record.fails.items():
            if not failure and evaluated(expression, values, record.where("fails", name)):
                failure = name
        return Result(failure, measures, simulated.time)


def _keep_columns(columns: Columns, file: Path) -> None:
    """Write every n-th row of the columns."""
    step = max(1, -(-columns.count // 400))  # enough for pictures
    values = np.array([columns[name][::step] for name in columns.names], dtype=np.float32)
    np.savez_compressed(file, names=np.array(columns.names), times=columns.times[::step], values=values)


@contextmanager
def recorded(simulated: SimulatedRun, file: Path) -> Iterator[None]:
    """Record the plugins of a run meanwhile.

    Raises:
        RecordingError: The file cannot be written.
    """
    drain_period = 1.0  # [s]
    plugins = list(simulated.plugins.values())
    truth = simulated.node("recorder").reader("floating_base", TRUTH_MESSAGE) if simulated.simulation.floating else None
    with (
        TemporaryDirectory() as folder,
        closing(BlackBox(Path(folder), plugins, 2.0 * drain_period, truth=truth)) as box,
    ):
        drain = RecordDrain(Path(folder))
        with closing(writer_of(file, [drain])) as writer:
            simulated.every(1.0 / plugins[0].rate, lambda: box.record(simulated.nanoseconds(), 0, 0))

            def fill() -> None:
                drain.fill()

            simulated.every(drain_period, fill)
            yield
            fill()
            writer.finish(drain.lost)
