"""Tests on aarch64, which qemu emulates: what `test/aarch64` runs without arguments.

Run it once before a soak: the first run takes longer than the soak waits.
"""

import os
import shutil
import subprocess

import pytest

pytestmark = [
    pytest.mark.soak,
    pytest.mark.skipif(
        os.geteuid() != 0 or None in map(shutil.which, ("debootstrap", "qemu-aarch64-static")),
        reason="emulation needs root, debootstrap and qemu-user-static",
    ),
]


def test_tests_pass_on_aarch64(repository):
    done = subprocess.run(
        [repository / "test" / "aarch64"], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-8000:]
