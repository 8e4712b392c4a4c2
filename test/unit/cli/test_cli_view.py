"""`solfer view` says what is wrong with its source before there is an address."""

import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from solfer.recording.writer import RecordingWriter  # noqa: E402
from solfer_tools.cli.main import main  # noqa: E402


@pytest.fixture
def files(tmp_path):
    """Write sources that cannot be shown."""
    (tmp_path / "junk").write_text("x")
    RecordingWriter(tmp_path / "empty", {"hands/robot.urdf": b"<robot/>"}).finish()
    return tmp_path


@pytest.mark.parametrize(
    "words",
    [
        ["--run", "{}/absent"],
        ["--run", "{}/junk"],
        ["{}/absent"],
        ["{}/junk"],
        ["{}/empty"],
        ["{}"],
        ["--namespace", "absent"],
        ["--run", "config/studies/robustness.yaml", "--robot", "absent"],
    ],
    ids=" ".join,
)
def test_a_source_that_cannot_be_shown_is_an_error_alone(files, capsys, words):
    assert main(["view", "--port", "0", *(each.format(files) for each in words)]) == 2
    out, err = capsys.readouterr()
    assert not out and err.startswith("error: ") and err.count("error: ") == 1 and "Traceback" not in err
