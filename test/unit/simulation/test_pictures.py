"""Pictures are written to a folder that is the user's own."""

import pytest

from solfer.errors import SimulationError
from solfer.simulation.rendering.pictures import write_picture


@pytest.mark.parametrize(("mode", "is_own"), [(0o700, True), (0o755, True), (0o720, False), (0o702, False)])
def test_no_other_user_may_write_the_folder(tmp_path, mode, is_own):
    tmp_path.chmod(mode)
    try:
        write_picture(tmp_path / "robot.png", lambda file: file.write(b"PNG"))
    except SimulationError as error:
        assert not is_own and "not the user's own" in error.what
    assert (tmp_path / "robot.png").exists() is is_own
