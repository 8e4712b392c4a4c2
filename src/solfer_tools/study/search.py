"""A search for values, by Optuna, which keeps what it knows in the folder of the study."""

import json
import logging
import math
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from solfer.errors import StudyError
from solfer_tools.study.drive import POLL_PERIOD, StudyProgress
from solfer_tools.study.engines import engine_of, needs
from solfer_tools.study.folder import StudyFolder
from solfer_tools.study.plan import PlannedRun
from solfer_tools.study.records import SearchRecord, VariationRecord
from solfer_tools.study.result import Result

LOG = "search.log"
"""File of what Optuna knows, in the folder of the study."""


def search(
    folder: StudyFolder,
    engine: str,
    workers: int,
    options: dict[str, Any],
    log: Callable[[str], None],
) -> list[Path]:
    """Try values until there are as many trials as the file requests; return the files of the table.

    Raises:
        SolferError: Workers cannot work, or the folder cannot be written; the search goes on later.
    """
    record = folder.study.record.search
    assert record is not None  # the caller's condition
    with needs("optuna", "optuna"):
        import optuna
        from optuna.storages import JournalStorage
        from optuna.storages.journal import JournalFileBackend
    optuna.logging.set_verbosity(logging.WARNING)
    # a journal works on file systems of a network, too
    storage = JournalStorage(JournalFileBackend(str(folder.path / LOG)))
    study = optuna.create_study(
        storage=storage,
        study_name="search",
        load_if_exists=True,
        direction="minimize" if record.minimize else "maximize",
    )
    finished = {trial.number for trial in study.trials if trial.state.is_finished()}
    waiting = {run.index: run for run in folder.runs if run.index not in finished}  # trials may be equal
    progress = StudyProgress(folder, record.trials, log)
    with closing(engine_of(engine, folder.path, workers, follow=True, options=options)) as started:
        while True:
            for trial, run in list(waiting.items()):
                if (result := folder.result(run)) is not None:
                    del waiting[trial]
                    _report(study, trial, record, result=result)
            while len(waiting) < workers and len(folder.runs) < record.trials:
                run = _search(study, folder, record)
                waiting[run.index] = run
            progress.look()
            progress.show()
            if not waiting:
                break
            started.check()
            time.sleep(POLL_PERIOD)
    progress.show(is_last=True)
    if any(trial.value is not None for trial in study.trials):
        best = study.best_trial
        run = folder.runs[best.number]
        log(f"best of {len(study.trials)}: {best.value:.5g} with {run.text}, run {run.id}")
    return folder.write_table()


def _search(study: Any, folder: StudyFolder, record: SearchRecord) -> PlannedRun:
    """Add the run of a new trial to the plan; a trial that a killed search has left without a run is used first.

    Each trial has a seed of its own, so that a search that was ended goes on as it would have without that.
    """
    import optuna

    number = len(folder.runs)
    study.sampler = optuna.samplers.TPESampler(seed=folder.study.record.seed + number)
    if len(study.trials) <= number:
        trial = study.ask()
    else:
        trial = optuna.trial.Trial(study, study.trials[number]._trial_id)
    try:
        values = {name: _suggested(trial, name, each) for name, each in record.parameters.items()}
    except ValueError as error:  # what is searched has changed
        raise StudyError(
            f"the search cannot go on: {error}", where=str(folder.path / LOG), expected="another folder"
        ) from None
    run = folder.study.planned(number, folder.study.record.seed, values)
    folder.add(run)
    return run


def _suggested(trial: Any, name: str, record: VariationRecord) -> Any:
    if record.choice is not None:
        texts = {json.dumps(value): value for value in record.choice}  # Optuna keeps no lists
        return texts[trial.suggest_categorical(name, list(texts))]
    low, high = record.uniform or record.log_uniform or (0.0, 1.0)
    return trial.suggest_float(name, low, high, log=record.log_uniform is not None)


def _report(study: Any, number: int, record: SearchRecord, result: Result) -> None:
    """Report the result of a trial; one that failed has none."""
    import optuna

    value = result.measures.get(str(record.minimize or record.maximize), math.nan)
    if result.done and math.isfinite(value):
        study.tell(number, value)
    else:
        study.tell(number, state=optuna.trial.TrialState.FAIL)
