"""Table 1 of the paper on the memory middleware; the truth is that of PyBullet."""

import pytest
import yaml
from support.integration.world import World
from support.paper.table_1 import MemorySystem
from support.plugins.plugin import configuration
from support.table_1 import Table1

from solfer.errors import PipeError


class TestTable1(Table1):
    """The rows in memory."""

    @classmethod
    def setup_class(cls):
        cls.system = MemorySystem(World())

    @classmethod
    def teardown_class(cls):
        cls.system.world.close()


def test_motors_alone_do_not_give_joint_positions(tmp_path):
    path = configuration(tmp_path, robot="motors")
    tree = yaml.safe_load(path.read_text())
    received = {"list": ["motor_side_online"]}
    tree["mwoibn"]["robot"]["motors"] = {
        "feedback": received,
        "actuators": {"read": False},
        "contacts": {"read": False},
    }
    tree["mwoibn"]["feedback"]["motor_side_online"]["dofs"]["mapping"] = "RBDL"
    path.write_text(yaml.safe_dump(tree))
    world = World()
    with pytest.raises(PipeError, match="commands a robot but receives no state of it"):
        world.plugin("test", path, "solfer.components:Component")
    world.close()
