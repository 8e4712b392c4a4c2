"""Fig. 5 on the mock of the hardware, with `system: HW`: it drives while the hands wave."""

from contextlib import closing

import numpy as np
import pytest
from support.paper.full_control import HardwareNodes, course

from solfer.plugins import PluginState
from solfer_tools.scenarios import read_scenario

COURSE = course(0.3, 0.0, 0.15, 0.25)


@pytest.mark.soak
def test_it_drives_while_the_hands_wave(tmp_path):
    """The base stays within 1 cm and the hands within 3 cm of their references, as PyBullet has them, not the mock."""
    file, rows = tmp_path / "course.yaml", []
    file.write_text(COURSE)
    with closing(HardwareNodes(tmp_path)) as world:
        world.run(2.5)
        references = world.plugins["locomotion"].component.references
        begin, reference = world.center_of_legs(), references.position.copy()

        def look(waving):
            base = (world.center_of_legs() - begin) - (references.position - reference)
            hands = [place - waving.desired[name] for name, place in world.hands().items()]
            rows.append((base[:2], hands, waving.desired["left"].copy()))

        world.play(read_scenario(file), look)
        base, hands, desired = (np.array(each) for each in zip(*rows, strict=True))
        assert np.ptp(desired, axis=0)[2] > 0.25  # they wave
        assert world.center_of_legs()[0] - begin[0] == pytest.approx(0.3, abs=0.01)
        assert np.linalg.norm(base, axis=1).max() < 0.01 and np.linalg.norm(hands, axis=2).max() < 0.03  # soft springs
        assert {plugin.life for plugin in world.plugins.values()} == {PluginState.RUNNING}
        assert not any(count for plugin in world.plugins.values() for count in plugin.outputs.counts().values())
