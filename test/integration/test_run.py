"""The script `run`: its usage; everything else it does is done whenever these tests run by it."""

import subprocess

import pytest


@pytest.mark.parametrize(("arguments", "code"), [([], 2), (["dmeo"], 2), (["exec"], 2), (["--help"], 0)])
def test_usage(repository, arguments, code):
    done = subprocess.run([repository / "run", *arguments], capture_output=True, text=True, timeout=30.0, check=False)
    assert done.returncode == code
    assert "usage: ./run COMMAND" in (done.stderr if code else done.stdout)
