"""Files of studies, written for a test."""

import json
from pathlib import Path

from solfer_tools.study import Study, read_study

CONFIG = Path(__file__).parents[3] / "config"

STUDY = {
    "configuration": {"file": str(CONFIG / "centauro.yaml")},
    "plugins": ["odometry3::odometry", "wheeled_motion"],
    "duration": 0.1,
    "settle": 0.1,
    "measure": {"tilt": {"columns": "simulation/base/tilt", "reduce": "max"}},
}
"""The shortest study of CENTAURO."""


def written(folder: Path, **tags) -> Path:
    """Write a study, in JSON, which is YAML; return its file. A tag that is None is left out."""
    file = folder / "study.yaml"
    file.write_text(json.dumps({key: value for key, value in {**STUDY, **tags}.items() if value is not None}, indent=1))
    return file


def made(folder: Path, **tags) -> Study:
    """Return the study of a file."""
    return read_study(written(folder, **tags))
