"""The table of faults names tests that there are."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROWS = [line for line in (ROOT / "docs" / "faults.md").read_text().splitlines() if line.startswith("| ")][1:]


def named(row):
    """Files of tests that a row names, each with the beginnings of names of tests in it and their cases."""
    for part in row.rsplit("|", 2)[1].split(";"):
        file, _, tests = part.partition(":")
        file = file.strip(" `")
        for test in tests.split(",") if tests else [""]:
            name, _, case = test.strip().partition("...")
            yield file, name.partition("[")[0], case.strip("[]")


def source(file):
    """What is in a file of tests."""
    (path,) = (ROOT / "test").glob(f"*/{file}.py")
    return path.read_text()


def test_every_fault_is_there():
    assert [row.split("|")[1].strip() for row in ROWS if row.split("|")[1].strip()] == [
        *map(str, range(1, 15)), *map(str, range(14, 19))]


@pytest.mark.parametrize("row", ROWS, ids=[row.split("|")[2].strip() for row in ROWS])
def test_a_fault_is_done_by_the_tests_that_its_row_names(row):
    files = list(named(row))
    assert files
    for file, name, case in files:
        assert re.search(rf"def test_{name}", source(file)), f"{file}: {name}"
        assert not case or f'"{case}"' in source(file), f"{file}: {name}[{case}]"
