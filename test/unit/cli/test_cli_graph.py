"""`solfer graph`: the arrows of a picture, its text, its DOT, and the result of Graphviz."""

import re
import shutil
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from support.plugins.fleet import tree
from support.unit.cart import URDF

from solfer.components import Component, Port, TopicIn, TopicOut
from solfer.errors import SolferErrors
from solfer.interfaces.geometry import Header, Vector
from solfer_tools.cli.diagram import Network, dot_text, network_of, plain_text
from solfer_tools.cli.diagram.network import LOWER_LEVEL_END, SENSORS, Arrow, End, Kind, PluginBox
from solfer_tools.cli.main import main

CENTAURO = Path(__file__).parents[3] / "config" / "centauro.yaml"
FIGURE_5 = Path(__file__).parents[2] / "data" / "graph_shared.yaml"
FIGURE_4 = ("upper_body", "lower_body", "whole_body")


@dataclass(frozen=True)
class Place:
    """geometry_msgs/PointStamped."""

    header: Header = field(default_factory=Header)
    point: Vector = field(default_factory=Vector)


class PlacePublisher(Component):
    """Declares a topic out."""

    def topics(self):
        """Publish."""
        return (TopicOut("place", "geometry_msgs/PointStamped", Place, Place),)


class Receiving(Component):
    """Declares the same topic in, and has an input."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.inputs["goal"] = Port("position")

    def topics(self):
        """Receive."""
        return (TopicIn("/first/place", "geometry_msgs/PointStamped", Place, print),)


def plugin(name):
    return End(Kind.PLUGIN, name)


@pytest.fixture(scope="module")
def figure_4():
    return network_of(str(CENTAURO), FIGURE_4)


def ends(network):
    return {(arrow.tail, arrow.head, arrow.pipe, arrow.reference) for arrow in network.arrows}


def test_figure_4_has_the_arrows_of_the_paper(figure_4):
    """The drawn network is compared arrow by arrow with the figure: ends, pipes, maps, contents and models."""
    whole = plugin("whole_body")
    assert ends(figure_4) == {
        (SENSORS, plugin("upper_body"), "link_side_online", "map FEEDBACK"),
        (SENSORS, plugin("lower_body"), "link_side_online", "map FEEDBACK"),
        (SENSORS, whole, "link_side_online", "map FEEDBACK"),
        (plugin("upper_body"), whole, "upper_body", "map RBDL_UPPER"),
        (plugin("lower_body"), whole, "lower_body", "map RBDL_LOWER"),
        (whole, LOWER_LEVEL_END, "position_controller", "map LOWER_LEVEL"),
        (whole, LOWER_LEVEL_END, "velocity_controller", "map LOWER_LEVEL"),
    }
    contents = {arrow.pipe: arrow.content for arrow in figure_4.arrows}
    assert contents["link_side_online"] == "measured position, velocity, effort"
    assert contents["upper_body"] == "desired position, velocity"
    models = {box.name: box.model for box in figure_4.plugins}
    assert models == {
        "upper_body": "/robot_upper_body", "lower_body": "/robot_lower_body", "whole_body": "/robot_description"
    }  # fmt: skip


def test_a_pipe_whose_other_end_is_missing_has_its_topic():
    topic = End(Kind.TOPIC, "upper_body")
    assert topic in {arrow.tail for arrow in network_of(str(CENTAURO), ["whole_body"]).arrows}
    arrows = network_of(str(CENTAURO), ["upper_body"]).arrows
    assert [arrow.head for arrow in arrows if arrow.tail == plugin("upper_body")] == [topic]


def test_the_text_names_both_ends_of_every_pipe(figure_4):
    blocks = plain_text(figure_4).split("\n\n")
    whole = next(block for block in blocks if block.startswith("whole_body"))
    assert re.search(r"receives +lower_body .* map RBDL_LOWER +from plugin lower_body ", whole)
    assert re.search(r"sends +velocity_controller +desired velocity .* to lower level ", whole)


def test_what_components_declare_is_drawn(figure_4):
    boxes = {box.name: box for box in figure_4.plugins}
    assert "upper_body/trajectory" in boxes["upper_body"].declares("service")
    assert re.search(r"declares +service +upper_body/trajectory ", plain_text(figure_4))
    assert "service upper_body/trajectory" in dot_text(figure_4)


def test_a_declared_topic_leads_to_those_that_receive_it(tmp_path):
    """One component publishes: another has a topic of the name, and a third a pipe with it as its source."""
    changed = tree()
    (tmp_path / "cart.urdf").write_text(URDF)
    changed["ros"]["source"] = {"urdf": {"file": str(tmp_path / "cart.urdf")}}
    changed["ros"]["feedback"]["goal"] = {"source": "first/place", "message": "geometry_msgs/PointStamped"}
    changed["feedback"]["goal"] = {"space": "POINT", "quantity": "position"}
    listening = changed["robot"]["deaf"] | {"feedback": {"list": ["goal"]}}
    changed["robot"]["listening"] = listening
    changed["modules"]["first"] |= {"class": f"{__name__}:PlacePublisher", "robot": "deaf"}
    changed["modules"]["second"] |= {"class": f"{__name__}:Receiving", "robot": "listening"}
    file = tmp_path / "main.yaml"
    file.write_text(yaml.safe_dump({"mwoibn": changed}))
    network = network_of(str(file), ["first", "second"])
    found = {(arrow.pipe, arrow.tail, arrow.head) for arrow in network.arrows if arrow.tail == plugin("first")}
    expected = {("goal", plugin("first"), plugin("second")), ("first/place", plugin("first"), plugin("second"))}
    assert expected <= found


def box(name, idle=False):
    return PluginBox(name, "Class<T> & Co", "robot", f"/{name}", "NRT", 200.0, idle)


def test_graphviz_draws_every_plugin_and_every_arrow(figure_4, tmp_path):
    file = tmp_path / "figure_4.svg"
    names = [word for name in FIGURE_4 for word in ("-n", name)]
    assert main(["graph", str(CENTAURO), *names, "-o", str(file)]) == 0
    root = ElementTree.parse(file).getroot()
    titles = [title.text for title in root.iter("{http://www.w3.org/2000/svg}title")]
    assert {f"plugin {name}" for name in FIGURE_4} <= set(titles)
    # what one sender sends to several receivers has one text
    texts = {(arrow.tail, arrow.pipe, arrow.content, arrow.reference) for arrow in figure_4.arrows}
    assert sum(title.startswith("text_") and "->" not in title for title in titles) == len(texts) < len(figure_4.arrows)
    assert sum("->" in title for title in titles) == len(figure_4.arrows) + len(texts)


def test_strange_names_survive_graphviz(tmp_path):
    strange = End(Kind.TOPIC, 'a "quoted" \\ <topic>')
    network = Network("SM", (box("one"),), (Arrow(strange, plugin("one"), "p<i>pe & co"),))
    from solfer_tools.cli.diagram import draw

    draw(dot_text(network), tmp_path / "strange.svg")
    texts = [text.text for text in ElementTree.parse(tmp_path / "strange.svg").getroot().iter() if text.text]
    assert "p<i>pe & co" in texts and "Class<T> & Co" in texts


def test_a_shared_plugin_is_an_area():
    arrows = [Arrow(plugin("one"), plugin(head), f"to {head}") for head in ("two", "three")]
    network = Network(
        "SM", (box("one"), box("two"), box("three")), (*arrows,), {"shared": (("one", "two"), ("three",))}
    )
    text = dot_text(network)
    assert "subgraph cluster_0 { subgraph cluster_0_0 { text_0 [" in text and "  subgraph cluster_0 { text_1 [" in text
    assert text.count("Robot /one") == 1 and "Robot /two" not in text and text.count("Robot /three") == 1
    assert text.index("shared plugin shared") < text.index("Robot /one") < text.index("plugin one")
    assert "in shared plugin shared, one Robot with two" in plain_text(network)


def test_figure_5_shares_two_robots_among_four_plugins():
    """Which plugins share a Robot decides what is computed once; only compensation commands the lower level."""
    network = network_of(str(FIGURE_5), ["shared", "manipulation"])
    assert network.shared == {
        "shared": (("estimation", "locomotion"), ("reaction_forces", "gravity_compensation"))
    }  # fmt: skip
    links = {(arrow.tail.name, arrow.head.name, arrow.pipe) for arrow in network.arrows if arrow.tail.name}
    assert links >= {
        ("estimation", "reaction_forces", "base"),
        ("estimation", "gravity_compensation", "base"),
        ("reaction_forces", "locomotion", "forces"),
        ("locomotion", "gravity_compensation", "legs"),
        ("manipulation", "gravity_compensation", "upper"),
    }
    assert [arrow.tail.name for arrow in network.arrows if arrow.head == LOWER_LEVEL_END] == ["gravity_compensation"]
    forces = next(arrow for arrow in network.arrows if arrow.pipe == "forces")
    assert (forces.content, forces.reference) == ("force of 4 points", "axes of world")


def test_a_configuration_listed_twice_is_two_plugins(tmp_path):
    """Both boxes command the same joints, so a picture that merges them would hide the conflict."""
    listed = "      plugins: [UpperBodyIK::upper_body_ik, odometry3::odometry, ground_forces,\n"
    listed += "                gravity_compensation, NwheelsZMPII::wheeled_motion]\n"
    for folder in ("support", "robots"):
        (tmp_path / folder).symlink_to(CENTAURO.parent / folder)
    text = CENTAURO.read_text()
    assert text.count(listed) == 1
    twice = "      plugins: [joint_states, 'joint_states::joint_states']\n"
    (tmp_path / "main.yaml").write_text(text.replace(listed, twice))
    network = network_of(str(tmp_path / "main.yaml"), ["shared"])
    assert [(box.name, box.component) for box in network.plugins] == [
        ("joint_states", "JointStates"),
        ("joint_states_2", "JointStates"),
    ]
    assert network.shared == {"shared": (("joint_states", "joint_states_2"),)}
    assert {arrow.tail.name for arrow in network.arrows if arrow.head == LOWER_LEVEL_END} == {
        box.name for box in network.plugins
    }


def test_two_sources_of_a_shared_robot_are_refused(tmp_path):
    received = "feedback: {list: [joints, base]}"
    text = FIGURE_5.read_text()
    assert text.count(received) == 1
    text = text.replace(received, "feedback: {list: [offline]}")
    (tmp_path / "main.yaml").write_text(text)
    (tmp_path / "graph_whole.yaml").write_text((FIGURE_5.parent / "graph_whole.yaml").read_text())
    with pytest.raises(SolferErrors) as caught:
        network_of(str(tmp_path / "main.yaml"), ["shared"])
    names = ("joints", "base", "offline")
    line = {name: 1 + text[: text.index(f"      {name}: {{source: ")].count("\n") for name in names}
    assert len(caught.value.errors) == 2
    for error, name in zip(caught.value.errors, names, strict=False):
        assert f"main.yaml:{line[name]}:" in error.where and f"main.yaml:{line['offline']}:" in error.expected
        assert f"'gravity_compensation' receives it by '{name}'" in str(error) and "'reaction_forces'" in str(error)


def test_an_idle_plugin_has_a_dashed_arrow():
    arrow = Arrow(plugin("one"), LOWER_LEVEL_END, "position_controller", idle=True)
    text = dot_text(Network("SM", (box("one", idle=True),), (arrow,)))
    assert "dashed" in text and "idle" in text
    assert "dashed" not in dot_text(Network("SM", (box("one"),), (Arrow(plugin("one"), LOWER_LEVEL_END, "p"),)))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-n", "whole_bdy"], "did you mean: whole_body"),
        (["-n", "whole_body", "-o", "figure.gif"], ".svg"),
        (["-n", "whole_body", "-o", "/none/of/these.dot"], "cannot be written"),
        (["-n", "whole_body", "-n", "nonsense"], "unknown module 'nonsense'"),
    ],
)
def test_a_mistake_is_one_block(arguments, message, capsys):
    assert main(["graph", str(CENTAURO), *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and message in err


def test_a_missing_graphviz_is_reported(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert main(["graph", str(CENTAURO), "-n", "whole_body", "-o", str(tmp_path / "figure.png")]) == 2
    assert "apt install graphviz" in capsys.readouterr().err
