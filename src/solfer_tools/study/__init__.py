"""Studies: many simulated runs of one configuration, on one machine or on many ([studies.md](docs/how-to/studies.md)).

`read_study` reads the file of a study, `run` makes one simulated run, and `SimulatedRun` is a run for a loop of one's
own.
"""

from solfer_tools.study.plan import Plan, PlannedRun, Study, read_study
from solfer_tools.study.records import StudyRecord
from solfer_tools.study.result import Result
from solfer_tools.study.run import run
from solfer_tools.study.simulated_run import SimulatedRun

__all__ = ["Plan", "PlannedRun", "Result", "SimulatedRun", "Study", "StudyRecord", "read_study", "run"]
