"""Stiffness and damping that a component commands have to reach somebody."""

import json

import pytest
from support.walk import benches
from support.walk.changes import CARRYING, COMMANDED_GAINS, MODULES
from support.walk.entries import STIFF_ARM
from support.walk.files import FILES, changed

from solfer.errors import SolferErrors


def run(folder, changes):
    """Run gravity compensation with changed files."""
    benches.write_robot(folder)
    for name, content in changed(FILES, changes).items():
        (folder / f"{name}.yaml").write_text(json.dumps(content))
    return CARRYING(folder)


def test_gains_that_no_controller_carries_are_refused(tmp_path):
    gains = {MODULES + "carrying/gains": [STIFF_ARM]}
    with pytest.raises(SolferErrors) as error:
        run(tmp_path, gains)
    assert [str(each).split(",")[0].rpartition(": ")[2] for each in error.value.errors] == [
        f"plugin 'carrying' commands the {gain} of joints" for gain in ("stiffness", "damping")
    ]
    assert "interface: {damping: true}" in str(error.value)
    assert run(tmp_path, gains | COMMANDED_GAINS)
