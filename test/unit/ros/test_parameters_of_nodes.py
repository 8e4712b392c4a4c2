"""What a node has set ends with the node; what others set afterwards stays."""

import logging
from xml.etree import ElementTree

import pytest
import yaml

from solfer.errors import UnknownName
from solfer.middleware.ros import middleware as module

NAME = "/robot_description"
URDF = "<robot name='cart'>\n  <link name='base'/>\n</robot>\n"


class Server:
    """Parameters of a master, and the nodes that live."""

    def __init__(self):
        self.values, self.nodes = {}, {"http://here:1"}

    def node(self):
        """Make a node."""
        return object.__new__(module.RosMiddleware)


@pytest.fixture
def server(monkeypatch):
    """Stand in for the master."""
    made = Server()
    rospy = module.rospy
    monkeypatch.setattr(rospy, "search_param", lambda name: f"/{name}" if f"/{name}" in made.values else None)
    monkeypatch.setattr(rospy, "resolve_name", lambda name: f"/{name}")
    monkeypatch.setattr(rospy, "get_param", lambda key, *default: made.values.get(key, *default))
    monkeypatch.setattr(rospy, "get_param_names", lambda: list(made.values))
    monkeypatch.setattr(rospy, "set_param", made.values.__setitem__)
    monkeypatch.setattr(rospy, "delete_param", made.values.pop)
    monkeypatch.setattr(rospy, "get_node_uri", lambda: "http://here:1")
    monkeypatch.setattr(module, "lives", lambda uri, process: uri in made.nodes)
    return made


@pytest.mark.parametrize("text", [URDF, "5", URDF.strip()])
def test_a_living_node_keeps_its_text(server, text):
    server.node().provide(NAME, text)
    assert server.node().parameter(NAME) == text
    assert list(server.values) == [NAME]


def test_other_readers_understand_the_text(server):
    server.node().provide(NAME, URDF)
    server.node().provide("/seed", "5")
    assert ElementTree.fromstring(server.values[NAME]).get("name") == "cart"
    assert yaml.safe_load(server.values["/seed"]) == 5


def test_it_ends_with_its_node(server):
    server.node().provide(NAME, URDF)
    server.nodes.clear()
    with pytest.raises(UnknownName, match="robot_description"):
        server.node().parameter(NAME)


@pytest.mark.parametrize("text", [URDF, "<robot name='other'/>"])
def test_a_launch_file_sets_it_after_a_node_was_killed(server, text):
    server.node().provide(NAME, URDF)
    server.nodes.clear()
    server.values[NAME] = text
    assert server.node().parameter(NAME) == text


def test_the_next_node_replaces_what_was_left(server, caplog):
    server.node().provide(NAME, URDF)
    server.nodes.clear()
    other = URDF.replace("cart", "other")
    server.node().provide(NAME, other)
    server.nodes.add("http://here:1")
    assert server.node().parameter(NAME) == other and not caplog.messages


def test_what_a_launch_file_has_set_stays(server, caplog):
    server.values[NAME] = f"{URDF}\n"
    with caplog.at_level(logging.WARNING):
        server.node().provide(NAME, URDF)
        assert not caplog.messages and server.values[NAME] == f"{URDF}\n"
        server.node().provide(NAME, "<robot name='floating'/>", original=URDF)
        assert not caplog.messages
        server.node().provide(NAME, "<robot name='other'/>")
    assert "differs from what this node would set" in caplog.text
    assert server.node().parameter(NAME) == f"{URDF}\n"
