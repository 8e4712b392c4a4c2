"""Stiffness and damping that a component commands have to reach somebody."""

import pytest
from support.walk import benches
from support.walk.files import write

from solfer.errors import SolferErrors


def run(folder, changes):
    """Run gravity compensation with changed files."""
    write(folder, changes)
    return benches.module("carrying")(folder)


def test_gains_that_no_controller_carries_are_refused(tmp_path):
    gains = {"modules/carrying/gains": [{"chain": "arm", "stiffness": 30.0, "damping": 3.0}]}
    with pytest.raises(SolferErrors) as error:
        run(tmp_path, gains)
    assert [str(each).split(",")[0].rpartition(": ")[2] for each in error.value.errors] == [
        f"plugin 'carrying' commands the {gain} of joints" for gain in ("stiffness", "damping")
    ]
    assert "interface: {damping: true}" in str(error.value)
    interface = "controller/arm_controller/interface/"
    assert run(tmp_path, gains | {interface + "stiffness": True, interface + "damping": True})
