"""What `solfer study` does, one function for each form of the command."""

import argparse
import os
import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from solfer.cli.columns import aligned
from solfer.errors import SolferError, StudyError
from solfer_tools.study import Plan, Study, read_study
from solfer_tools.study.drive import carry_out_all, find_run
from solfer_tools.study.folder import RECORDING, StudyFolder
from solfer_tools.study.plan import shown
from solfer_tools.study.report import write_map, write_report
from solfer_tools.study.run import carry_out as carry_out_one
from solfer_tools.study.search import search


def carry_out(options: argparse.Namespace) -> int:
    """Carry out a study, and write its table; the exit code is 1 where a run failed."""
    if options.out is None:
        raise StudyError("no folder", where="--out", expected="--out DIR")
    study = read_study(options.file)
    plan = _plan(study, options)
    folder = StudyFolder.create(options.out, study, plan, record=options.record, force=options.force)
    work = search if study.record.search is not None else carry_out_all
    workers = options.workers or len(os.sched_getaffinity(0))
    files = work(folder, options.engine, workers, _engine_options(options), partial(print, file=sys.stderr, flush=True))
    for file in files:
        print(file)
    return 0 if all(not row["failed"] for row in folder.rows()) else 1


def dry(options: argparse.Namespace) -> int:
    """List the runs, and estimate how long they take."""
    study = read_study(options.file)
    plan = _plan(study, options)
    record = study.record
    count = len(plan.runs) if record.search is None else record.search.trials
    rows = [("run", "seed", *study.names)]
    most = 20
    rows += [(str(run.index), str(run.seed), *map(shown, run.variations.values())) for run in plan.runs[:most]]
    for line in aligned(rows):
        print(line)
    if len(plan.runs) > most:
        print(f"... and {len(plan.runs) - most} more")
    factor = 1.5  # real-time factor of one processor, roughly
    hours = count * (record.duration + record.settle) / factor / 3600.0
    print(f"{count} runs of {record.duration + record.settle:g} s at most, about {hours:.2g} processor hours")
    return 0


def rerun(options: argparse.Namespace) -> int:
    """Repeat one run in this process, and compare its result with the folder's."""
    if options.out is None:
        raise StudyError("no folder", where="--out", expected="--out DIR")
    folder = StudyFolder(options.out)
    chosen = find_run(folder, options.rerun)
    record, changes = folder.study.settings(chosen.variations)
    recording = folder.output(chosen, RECORDING) if options.record else None
    begin = time.monotonic()
    result = carry_out_one(
        record, chosen.seed, changes, variations=chosen.variations, recording=recording, gui=options.gui
    )
    for line in aligned([(name, f"{value:.9g}") for name, value in result.measures.items()]):
        print(line)
    print(f"{'failed: ' + result.failure if result.failure else 'done'}, in {time.monotonic() - begin:.1f} s")
    before = folder.result(chosen)
    if before is not None and before.as_json() != result.as_json():
        print(f"it differs from {folder.of(chosen)}: other code, or another machine", file=sys.stderr)
        return 1
    return 0


def report(path: Path | None, drawn: Sequence[str] | None) -> int:
    """Write the page of a study, or draw a map: names of both variables and of the measure, and the file."""
    if path is None:
        raise StudyError("no folder", where="report", expected="solfer study report DIR")
    folder = StudyFolder(path)
    if drawn is None:
        print(write_report(folder))
        return 0
    first, second, measure, out = drawn
    write_map(folder, first, second, measure=measure, out=Path(out))
    print(out)
    return 0


def _plan(study: Study, options: argparse.Namespace) -> Plan:
    if options.runs is not None and options.runs < 1:
        raise StudyError(f"{options.runs} runs", where="--runs", expected="1 or more")
    if options.workers is not None and options.workers < 1:
        raise StudyError(f"{options.workers} workers", where="--workers", expected="1 or more")
    if study.record.search is not None:
        study.check_values()
        return study.empty_plan()
    return study.plan(options.runs)


def _engine_options(options: argparse.Namespace) -> dict[str, Any]:
    found: dict[str, Any] = {"scheduler": options.scheduler}
    for each in options.slurm:
        key, equals, value = each.partition("=")
        if not equals:
            raise SolferError(f"'{each}'", where="--slurm", expected="KEY=VALUE")
        found[key] = int(value) if value.isdigit() else value
    return found
