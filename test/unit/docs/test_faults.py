"""The table of faults names tests that there are."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
FAULTS, _, _ = (ROOT / "docs/explanation/faults.md").read_text().partition("## Sensors that are wrong")
ROWS = [line for line in FAULTS.splitlines() if line.startswith("| ")][1:]


def named(row):
    """Files of tests that a row names, each with the beginnings of names of tests in it and their cases."""
    for part in row.rsplit("|", 2)[1].split(";"):
        file, _, tests = part.partition(":")
        file = file.strip(" `")
        for test in tests.split(",") if tests else [""]:
            name, _, case = test.strip().partition("...")
            yield file, name.partition("[")[0], case.strip("[]")


def source(file):
    """Read a file of tests."""
    (path,) = (ROOT / "test").rglob(f"{file}.py")
    return path.read_text()


def test_every_fault_is_there():
    assert [row.split("|")[1].strip() for row in ROWS if row.split("|")[1].strip()] == [
        *map(str, range(1, 15)),
        *map(str, range(14, 19)),
    ]


def test_a_fault_is_done_by_the_tests_that_its_row_names():
    tests = [(row.split("|")[2].strip(), *test) for row in ROWS for test in named(row)]
    assert {fault for fault, *_ in tests} == {row.split("|")[2].strip() for row in ROWS}
    assert [
        f"{fault}: {file}: {name}[{case}]"
        for fault, file, name, case in tests
        if not re.search(rf"def test_{name}", source(file)) or (case and f'"{case}"' not in source(file))
    ] == []
