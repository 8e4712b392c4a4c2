"""What the nodes of a namespace offer each other: topics, services and reports of their health."""

from contextlib import closing
from dataclasses import dataclass, fields

import pytest

from solfer.interfaces.declaration import Service
from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.middleware.shared_memory.discovery import published_topics, services
from solfer.middleware.shared_memory.health_reports import REPORT_SIZE, Reports
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport


@dataclass(frozen=True)
class Asked:
    number: float = 0.0


@dataclass(frozen=True)
class ScaleReply:
    success: bool = True
    message: str = ""


@pytest.fixture
def space(tmp_path):
    return Namespace("test", tmp_path)


def test_living_nodes_offer_topics_and_services(space):
    with closing(XbotMiddleware(space, "arm")) as node:
        node.writer("pose", "geometry_msgs/PoseStamped")
        node.writer("wheel/command", "solfer/JointCommand")
        node.serve("arm", (Service("scale", "test/Scale", Asked, ScaleReply, lambda _: ScaleReply()),), lambda *_: None)
        assert [(one.topic, one.message) for one in published_topics(space)] == [("pose", "geometry_msgs/PoseStamped")]
        assert published_topics(space, {"pose"}) == []
        (offer,) = [one for one in services(space) if one.interface == "test/Scale"]
        assert offer.name == "arm/scale"
        assert [field.name for field in fields(offer.request)] == ["number"]
        assert [field.name for field in fields(offer.reply)] == ["message", "success"]
        assert offer.request.__name__ == "Request" and offer.reply.__name__ == "Reply"
        assert "arm/scale" not in [one.name for one in services(space, {"arm/scale"})]
    assert published_topics(space) == [] and services(space) == []


def test_reports_are_those_of_the_living(space):
    mine, others = Reports(space), Reports(space)
    mine.write("arm", HealthReport(Health.WARNING, "slow", {"late": 3, "why": "load"}), 1.0)
    assert others.read() == {"arm": HealthReport(Health.WARNING, "slow", {"late": 3.0, "why": "load"})}
    mine.write("arm", HealthReport(Health.GOOD, "running", {}), 2.0)
    assert others.read()["arm"] == HealthReport(Health.GOOD, "running", {})
    mine.close()
    late = Reports(space)
    assert late.read() == {}
    anew = Reports(space)
    anew.write("arm", HealthReport(Health.ERROR, "hot", {}), 3.0)
    assert others.read()["arm"].summary == late.read()["arm"].summary == "hot"
    anew.close()


@pytest.mark.parametrize(
    ("summary", "values", "kept"),
    [("hot", {"first": 1.0, "long": "x" * REPORT_SIZE}, {"first": 1.0}), ("é" * REPORT_SIZE, {"first": 1.0}, {})],
)
def test_a_long_report_is_cut_at_its_end(space, summary, values, kept):
    mine, others = Reports(space), Reports(space)
    mine.write("arm", HealthReport(Health.ERROR, summary, values), 1.0)
    report = others.read()["arm"]
    assert report == HealthReport(Health.ERROR, summary if kept else summary[: REPORT_SIZE // 8], kept)
    mine.close()
