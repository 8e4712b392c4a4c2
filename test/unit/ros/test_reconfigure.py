"""Live parameters for clients of dynamic_reconfigure, without a master: the test calls what rospy would call."""

from types import SimpleNamespace

import pytest
from dynamic_reconfigure.encoding import decode_config, decode_description, encode_config
from dynamic_reconfigure.srv import ReconfigureRequest
from support.plugins.fleet import Fleet, still
from support.recording.sine import tree

from solfer.middleware.ros import RosMiddleware, reconfigure, services
from solfer.plugins.generation.config_service import answer_at_once
from solfer.srv import SetParametersRequest

TAGS = {"gain": 0.3, "parts": {"hand": {"weight": 2.0}}}


class Ros:
    """What a plugin publishes and offers.

    Attributes:
        topics: Messages by the topic.
        services: What rospy calls with a request, by the service.
        kept: What is on the parameter server.
    """

    def __init__(self, monkeypatch):
        self.topics, self.services, self.kept = {}, {}, {"first/parameters": {"least": 1.5, "most": 4.0}}
        monkeypatch.setattr(reconfigure.rospy, "get_param", self.kept.get)
        monkeypatch.setattr(reconfigure.rospy, "set_param", self.kept.__setitem__)
        for module in (services, reconfigure):
            monkeypatch.setattr(module.rospy, "Service", self._offer)
            monkeypatch.setattr(module, "bound_requests", lambda *limits, **named: None)
        monkeypatch.setattr(services, "provider", lambda name: None)
        monkeypatch.setattr(reconfigure.rospy, "Publisher", self._topic)

    def _offer(self, name, interface, handler):
        self.services[name] = handler
        return SimpleNamespace(protocol=None, shutdown=lambda: None)

    def _topic(self, name, message, latch=False, queue_size=None):
        messages = self.topics[name] = []
        return SimpleNamespace(publish=messages.append, unregister=lambda: None)

    def put(self, **values):
        """Change parameters as a client does; return all values."""
        reply = self.services["first/parameters/set_parameters"](ReconfigureRequest(encode_config(values)))
        return decode_config(reply.config)

    @property
    def newest(self):
        """The values that were published last."""
        return decode_config(self.topics["first/parameters/parameter_updates"][-1])


@pytest.fixture
def fleet(tmp_path):
    changed = tree("support.plugins.tuned:Tuned")
    changed["modules"]["first"] |= TAGS
    made = Fleet(tmp_path, changed, ("first",), together=False)
    made.cycle(**still())
    return made


@pytest.fixture
def ros(fleet, monkeypatch):
    """Offer the parameters of a plugin, whose loop makes a cycle for each change."""
    made = Ros(monkeypatch)
    tuning, node = fleet.plugins[0].tuning, SimpleNamespace(name="/first", clock=None, running=lambda: True)

    def submit(call):
        answer = fleet.plugins[0].inbox.submit_one_by_one(call)
        fleet.cycle(**still())
        return answer

    middleware = RosMiddleware(node)
    middleware.serve("first", (tuning.setting(),), submit)
    middleware.serve("first", (tuning.getting(),), answer_at_once)
    middleware._services[-1]._thread.join()
    return made


def test_parameters_are_described(ros):
    (message,) = ros.topics["first/parameters/parameter_descriptions"]
    found = {each["name"]: each for each in decode_description(message)["parameters"]}
    assert list(found) == ["gain", "limit", "least", "most", "law", "parts.hand.weight"]
    gain = found["gain"]
    assert (gain["type"], gain["min"], gain["max"], gain["default"]) == ("double", 0.0, 2.0, 0.3)
    assert gain["description"] == "gain of what joints miss [1/s]"
    assert (found["most"]["min"], found["most"]["max"]) == (float("-inf"), float("inf"))
    choices = eval(found["law"]["edit_method"])["enum"]  # as clients read it
    assert [each["value"] for each in choices] == ["sine", "line"] and found["law"]["default"] == "sine"
    assert (found["limit"]["type"], found["parts.hand.weight"]["type"]) == ("str", "str")
    assert ros.newest == {"gain": 0.3, "limit": "", "least": 0.0, "most": 5.0, "law": "sine", "parts.hand.weight": "2"}


def test_a_change_counts_and_is_published(ros, fleet):
    values = ros.put(gain=1.5, law="line", limit="2.5", **{"parts.hand.weight": "[1, 2]"})
    tags = fleet.plugins[0].component.tags
    assert (tags.gain, tags.law, tags.limit, tags.parts["hand"].weight) == (1.5, "line", 2.5, (1.0, 2.0))
    assert values == ros.newest and values["gain"] == 1.5 and values["parts.hand.weight"] == "[1.0, 2.0]"


def test_numbers_beyond_their_range_become_its_end(ros, fleet):
    assert ros.put(gain=5.0)["gain"] == fleet.plugins[0].component.tags.gain == 2.0


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"gain": -1.0}, "above 0"),
        ({"gain": float("nan")}, "gain"),
        ({"law": "circle"}, "'sine' or 'line'"),
        ({"least": 6.0, "gain": 1.0}, "above 'most'"),
        ({"size": 3}, "unknown parameter 'size'"),
        ({"limit": "much"}, "limit"),
        ({"gain": "1.0"}, "expected a number"),
        ({"gain": True}, "expected a number"),
        ({"law": 1.0}, "'sine' or 'line'"),
        ({"law": 10**6 * "x"}, "'sine' or 'line'"),
    ],
)
def test_what_is_refused_changes_nothing(ros, fleet, caplog, values, word):
    before = fleet.plugins[0].component.tags
    assert ros.put(**values) == ros.newest
    assert fleet.plugins[0].component.tags is before
    assert word in caplog.text and "first/parameters: refused" in caplog.text


def test_a_change_by_the_plugins_own_service_is_published(ros):
    reply = ros.services["first/set_parameters"](SetParametersRequest(["gain"], ["0.9"]))
    assert reply.success and ros.newest["gain"] == 0.9


def test_the_parameter_server_has_what_counts(ros):
    """Values that are in it are made true at the start; others come in when they change."""
    assert ros.kept.pop("first/parameters/least") == 0.0 and ros.kept.pop("first/parameters/most") == 5.0
    ros.put(gain=1.5, limit="2.5", **{"parts.hand.weight": "[1, 2]"})
    ros.put(gain=float("nan"))
    ros.kept.pop("first/parameters")
    assert ros.kept == {
        "first/parameters/gain": 1.5,
        "first/parameters/limit": 2.5,
        "first/parameters/parts.hand.weight": [1.0, 2.0],
    }


def test_a_client_may_send_all_values(ros, fleet):
    """As rqt does: those that are as they were are no change."""
    before = fleet.plugins[0].component.tags
    assert ros.put(**ros.newest) == ros.newest
    assert fleet.plugins[0].component.tags == before


def test_a_request_that_is_refused_undecoded_returns_the_values(ros):
    reply = ros.services["first/parameters/set_parameters"](object())
    assert decode_config(reply.config) == ros.newest
