"""A test that ends its process has failed, and those that are left run in another one."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2]

CONFTEST = """
def pytest_xdist_make_scheduler(config, log):
    from support.suite.scheduling import Scheduling
    return Scheduling(config, log)
"""

ENDS = """
import os

def test_first(): pass
def test_that_ends_its_process(): os._exit(1)
def test_last(): pass
"""


@pytest.mark.slow
def test_the_tests_behind_one_that_ends_its_process_run(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "conftest.py").write_text(CONFTEST)
    (tmp_path / "test_ends.py").write_text(ENDS)
    (tmp_path / "test_others.py").write_text("def test_other(): pass\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-n", "2"]
    environment = os.environ | {"PYTHONPATH": str(TESTS)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=60.0)
    assert "1 failed, 3 passed" in done.stdout, done.stdout + done.stderr
