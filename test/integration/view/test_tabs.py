"""Tabs of the shipped components on CENTAURO, in memory."""

import re
from contextlib import closing

import pytest

pytest.importorskip("viser", reason="needs pip install -r requirements-view.txt")

from support.page import opened_page  # noqa: E402

from solfer.config.records.live import live_fields  # noqa: E402
from solfer.middleware.memory import MemoryMiddleware  # noqa: E402
from solfer_tools.view import Page, PageServer  # noqa: E402

COMPONENTS = {
    "joint_states": None,
    "soft_compensation": None,
    "inverse_kinematics": None,
    "inverse_dynamics": None,
    "odometry": "solfer.components.odometry:Odometry",
    "ground_forces": None,
    "wheeled_motion": None,
    "support_shaping": None,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", COMPONENTS)
def test_the_tab_of_each_component_has_its_parameters(world, name):
    """All that a component offers as live is there, with its unit."""
    plugin = world.plugin(name, target=COMPONENTS[name])
    node = MemoryMiddleware(world.bus, name)
    with closing(PageServer(0)) as server:
        page = Page(server, plugin.robot.description, MemoryMiddleware(world.bus, "view"), control=True)
        reply = world.ask(f"{name}/get_parameters")
        assert {re.split(r"[.\[]", each)[0] for each in reply.names} <= {
            path[0] for path, _ in live_fields(plugin.component.tags)
        }
        labels = {
            f"{parameter} [{unit}]" if unit else parameter
            for parameter, unit in zip(reply.names, reply.units, strict=True)
        }
        with opened_page(server.address) as client:
            for _ in range(40):
                node.report(name, *plugin.health(), {})
                world.run(0.05)
                page.update(None)
                client.receive(0.02)
                if labels <= client.labels:
                    break
            assert client.tabs == [name]
            assert labels and labels <= client.labels
