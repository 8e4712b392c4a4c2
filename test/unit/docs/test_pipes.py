"""The examples of docs/reference/pipes.md are pipes."""

import re

import pytest
import yaml

from solfer.config.kinds.table import record_of
from solfer.config.records.conventions import ConventionRecord
from solfer.config.records.pipes import ControllerRecord, FeedbackRecord, FilterRecord

RECORDS = {"feedback": FeedbackRecord, "controller": ControllerRecord}


@pytest.fixture(scope="module")
def blocks(repository):
    text = (repository / "docs/reference/pipes.md").read_text()
    return [yaml.safe_load(block) for block in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)]


def test_every_whole_pipe_is_accepted(blocks):
    """Readers copy these blocks: each must pass validation, and the list shows that none was skipped."""
    accepted = []
    for block in blocks:
        for direction, record in RECORDS.items():
            for name, generic in block.get(direction, {}).items():
                special = block.get("ros", {}).get(direction, {}).get(name)
                if special is not None:
                    pipe = {"name": name, **generic, **special}
                    accepted.append(record_of(record, pipe.get("space")).model_validate(pipe, strict=False).name)
    assert accepted == [
        "upper_body",
        "floating_base",
        "imu_base",
        "hand",
        "goal",
        "wheels",
        "left_arm",
        "ground_forces",
        "contact_forces",
    ]


def test_the_table_of_rows_names_tests(repository):
    page = (repository / "docs/reference/pipes.md").read_text()
    rows = re.findall(r"^\| (\d) .*`(test_table_1_row_\d_\w+)` \|$", page, re.MULTILINE)
    tests = re.findall(r"def (test_table_1_row_\d_\w+)", (repository / "test/support/table_1.py").read_text())
    assert [test for _, test in rows] == tests and [int(row) for row, _ in rows] == list(range(1, 8))


def test_parts_of_pipes_are_accepted(blocks):
    parts = {key: block[key] for block in blocks for key in ("convention", "filter") if key in block}
    assert ConventionRecord.model_validate(parts["convention"]).twist.frame == "body"
    assert FilterRecord.model_validate(parts["filter"]).frequency == 20.0
    offsets = next(pipe for block in blocks for pipe in block.get("feedback", {}).values() if "offset_position" in pipe)
    whole = {"name": "imu", "space": "OPERATIONAL", "interface": {"position": True}}
    dofs = {"chain": "all", "type": "body", "name": "imu_link", "mapping": "RBDL"}
    record = record_of(FeedbackRecord, whole["space"]).model_validate(whole | {"dofs": dofs} | offsets, strict=False)
    assert record.offset_orientation.matrix()[1, 0] == 1.0
