"""A worker of a study: takes up runs of its folder, each in a process of its own, until none is left."""

import argparse
import gc
import json
import logging
import os
import resource
import signal
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import NoReturn

from solfer.config.yaml.nodes import YamlNode
from solfer.errors import MissingDependency, SolferError, SolferErrors, StudyError, located
from solfer.supervision import end_with_parent
from solfer_tools.study.folder import (
    COLUMNS_FILE,
    CONFIGURATION_FILE,
    HEARTBEAT_PERIOD,
    RECORDING,
    STDERR_FILE,
    Claim,
    StudyFolder,
    write_whole,
)
from solfer_tools.study.plan import PlannedRun
from solfer_tools.study.records import RunLimitsRecord, StudyRecord
from solfer_tools.study.result import FAULTS, Result

ENDING = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals that end a worker and its run from outside, which leaves no result."""

UNFINISHED = 3
"""Exit code of a run whose result could not be written."""


def work(folder: Path, follow: bool = False) -> int:
    """Take up runs until all have a result; return how many this worker has finished.

    Args:
        folder: The folder of the study.
        follow: Whether to wait for runs that a search adds, until this is ended.

    Raises:
        StudyError: The folder cannot be read or written.
    """
    study = StudyFolder(folder)
    _warm_up(study)
    count = 0
    while True:
        left = [run for run in study.runs if not study.is_done(run)]
        if not left and not follow:
            return count
        done = sum(_take_up(study, run) for run in left)
        count += done
        if not done:
            time.sleep(0.5)  # other workers have taken up all that are left
        if follow:
            study.load()


def _take_up(study: StudyFolder, run: PlannedRun) -> bool:
    """Carry out a run if no other worker does; return whether it has a result now that is this worker's."""
    claim = study.claim(run)
    if claim is None:
        return False
    attempts = 3  # of a run that is killed from outside, as by the kernel where memory is short
    for _ in range(attempts):
        child = _start(study, run)
        try:
            failure, code = _watch(study.study.record.limits, claim, child)
        except BaseException:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
            raise
        if study.is_done(run):
            return True
        if failure:
            break
    else:
        failure = f"its process was killed {attempts} times; see {STDERR_FILE}"
        if code != -signal.SIGKILL:  # which the kernel sends where memory is short; others say nothing about the run
            raise StudyError(
                f"a run was ended {attempts} times by {_name(code)}",
                where=str(claim.folder),
                expected="no signals to it",
            )
    study.finish(run, Result(failure))
    return True


def _start(study: StudyFolder, run: PlannedRun) -> int:
    """Start the process of a run, which a signal ends like any other program; return its id."""
    worker = os.getpid()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)  # in the child the handlers of this worker never run
    child = os.fork()
    if not child:
        end_with_parent()
        if os.getppid() != worker:
            os._exit(UNFINISHED)  # it had ended before
        _handle_ending(signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    if not child:
        _child(study, run)
    return child


def _handle_ending(handler: Callable[[int, FrameType | None], NoReturn] | signal.Handlers) -> None:
    """Set what the signals do that end a worker, but those that it ignores, as below `nohup`."""
    for number in ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def _watch(limits: RunLimitsRecord, claim: Claim, child: int) -> tuple[str, int]:
    """Wait for the end of a run, and end it where it takes too much.

    Returns:
        Why it failed, empty: it was ended from outside; and its exit code, of a signal the negative number.

    Raises:
        StudyError: It could not be carried out on this machine.
    """
    begin = renewed = time.monotonic()
    failure = ""
    while True:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            break
        now = time.monotonic()
        if now - renewed > HEARTBEAT_PERIOD:
            claim.renew()
            renewed = now
        excess = _excess(limits, child, now - begin)
        if excess and not failure:
            failure = excess
            os.kill(child, signal.SIGKILL)
        time.sleep(0.02)
    code = os.waitstatus_to_exitcode(status)
    if code == UNFINISHED:
        raise StudyError(
            f"a run cannot be carried out; see {STDERR_FILE}",
            where=str(claim.folder),
            expected="a folder with room, and PyBullet",
        )
    if not failure and (code >= 0 or _name(code) in FAULTS):
        ending = f"exit code {code}" if code >= 0 else f"signal {_name(code)}"
        failure = f"its process ended by {ending}; see {STDERR_FILE}"
    return failure, code


def _name(code: int) -> str:
    """Return the name of the signal of an exit code; those for real time have none."""
    return next((each.name for each in signal.Signals if each == -code), str(-code))


def _excess(limits: RunLimitsRecord, process: int, took: float) -> str:
    """Return by what a process exceeds its limits; empty: it does not."""
    if took > limits.time:
        return f"it took more than {limits.time:g} s"
    with suppress(OSError, IndexError):
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
        if pages * resource.getpagesize() > limits.memory * 1e9:
            return f"it took more than {limits.memory:g} GB of memory"
    return ""


def _child(study: StudyFolder, run: PlannedRun) -> NoReturn:
    """Carry out a run in this process, which ends with it."""
    code = UNFINISHED
    try:
        stderr = os.open(study.output(run, STDERR_FILE), os.O_CREAT | os.O_WRONLY | os.O_EXCL, 0o644)
        for stream in (1, 2):
            os.dup2(stderr, stream)
        gc.freeze()
        record, changes = study.study.settings(run.variations)
        write_whole(study.of(run) / CONFIGURATION_FILE, _texts(run, record, changes).encode())
        study.finish(run, _result(study, run, record, changes=changes))
        code = 0
    except (SolferError, SolferErrors) as error:
        print(f"error: {error}", file=sys.stderr)
    except Exception as error:
        logging.getLogger(__name__).exception("the run has failed")
        with suppress(SolferError):
            study.finish(run, Result(located(error)))
            code = 0
    except BaseException:  # code of the user ends the process, which is no result of the run
        logging.getLogger(__name__).exception("the run has ended its process")
        code = 1
    finally:
        with suppress(OSError):
            sys.stderr.flush()
        os._exit(code)


def _result(study: StudyFolder, run: PlannedRun, record: StudyRecord, changes: YamlNode | None) -> Result:
    """Carry out a run; a mistake in what varies is its failure."""
    from solfer_tools.study.run import carry_out

    recording = study.output(run, RECORDING) if study.is_recorded else None
    columns = study.output(run, COLUMNS_FILE)
    try:
        return carry_out(record, run.seed, changes, variations=run.variations, recording=recording, columns=columns)
    except (MissingDependency, StudyError):
        raise  # the machine's, and not the run's
    except (SolferError, SolferErrors) as error:
        print(f"error: {error}", file=sys.stderr)
        return Result(str(error))


def _texts(run: PlannedRun, record: StudyRecord, changes: YamlNode | None) -> str:
    """Write what ran, in YAML: the settings of the run, then each plugin's effective configuration."""
    from solfer_tools.study.simulated_run import configurations_of, listed

    settings = {"seed": run.seed, "variations": dict(run.variations), **record.model_dump(mode="json")}
    parts = [json.dumps(settings, indent=1) + "\n"]
    parts += [configuration.text(origins=False) for _, configuration in listed(configurations_of(record, changes))]
    return "---\n".join(parts)


def _warm_up(study: StudyFolder) -> None:
    """Import and load what every run needs, so that all runs of a worker are of one state of the code.

    Raises:
        MissingDependency: No physics engine is installed.
        SolferError: A configuration is wrong. SolferErrors: Several mistakes.
    """
    import solfer_tools.study.run  # noqa: F401
    from solfer.simulation.engines import make_engine
    from solfer_tools.study.simulated_run import rehearse

    make_engine().close()
    rehearse(study.study.record)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a worker of the folder that the command line names; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m solfer_tools.study.worker", description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of the study")
    parser.add_argument("--follow", action="store_true", help="wait for further runs until this is ended")
    parser.add_argument("--with-parent", action="store_true", help="end with the process that has started this one")
    options = parser.parse_args(arguments)
    if options.with_parent:
        end_with_parent()
    _handle_ending(lambda number, _: sys.exit(128 + number))
    logging.basicConfig(level=logging.WARNING)
    try:
        work(options.folder, options.follow)
    except (SolferError, SolferErrors) as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
