"""Live parameters: requests that fit, requests that do not, and what they cost a cycle."""

import logging
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from support.plugins.fleet import RATE, Fleet, still
from support.recording.sine import recorded, tree

from solfer.components import Component, LiveParameter
from solfer.errors import ComponentError, MiddlewareError, Overtaken
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins.tuning import MOVING_PARAMETERS, RAMP, WAITING_CHANGES, Tuning
from solfer.recording.reader import read
from solfer.transport.parameters import SetParameters
from solfer_tools.cli.main import main

TUNED = "support.plugins.tuned:Tuned"
TAGS = {"gain": 0.3, "parts": {"hand": {"weight": 2.0}, "foot": {}}}


@pytest.fixture
def fleet(tmp_path):
    """Let the component run in memory."""
    changed = tree(TUNED)
    changed["modules"]["first"] |= TAGS
    made = Fleet(tmp_path, changed, ("first",), together=False)
    made.cycle(**still())
    assert made.plugins[0].running
    return made


def count_calls(work):
    """Count the Python functions that a call enters."""
    entered = []
    sys.setprofile(lambda _, event, __: entered.append(event) if event == "call" else None)
    try:
        work()
    finally:
        sys.setprofile(None)
    return len(entered)


def ask(fleet, service="set_parameters", **fields):
    """Ask a service, and return the reply of the next cycle."""
    future = fleet.bus.call(f"first/{service}", None, **fields)
    fleet.cycle(**still())
    return future.result(0)


def put(fleet, **values):
    """Change parameters by their names."""
    return ask(fleet, names=tuple(values), values=tuple(map(str, values.values())))


def test_a_number_moves_to_its_new_value(fleet, caplog):
    component = fleet.plugins[0].component
    with caplog.at_level(logging.INFO):
        assert put(fleet, gain=1.3).success
        gains = [component.gain]
        for _ in range(round(RAMP * RATE) + 2):
            fleet.cycle(**still())
            gains.append(component.gain)
        fleet.plugins[0].tuning.log()
    np.testing.assert_allclose(np.diff(gains)[:-4], 1.0 / (RAMP * RATE), rtol=1e-9)
    assert gains[-1] == pytest.approx(1.3, abs=1e-12) and component.tags.gain == 1.3
    assert not fleet.plugins[0].tuning.moves
    assert [record.message for record in caplog.records if "->" in record.message] == ["first: gain 0.3 -> 1.3"]


def test_a_change_on_the_way_takes_over_smoothly(fleet):
    component = fleet.plugins[0].component
    put(fleet, gain=1.3)
    for _ in range(20):
        fleet.cycle(**still())
    before = component.gain
    put(fleet, gain=0.3)
    assert abs(component.gain - before) < 0.02
    for _ in range(120):
        fleet.cycle(**still())
    assert component.gain == pytest.approx(0.3, abs=1e-12)


def test_rows_move_and_a_list_has_one_number_each(fleet):
    component = fleet.plugins[0].component
    assert put(fleet, **{"parts.hand.weight": [4.0, 0.0]}).success
    for _ in range(49):
        fleet.cycle(**still())
    np.testing.assert_allclose(component.weights["hand"], (3.0, 1.0), atol=1e-9)
    reply = put(fleet, **{"parts.hand.weight": [1.0, 2.0, 3.0]})
    assert not reply.success and "parts.hand.weight: 3 weights" in reply.message
    assert component.tags.parts["hand"].weight == (4.0, 0.0) and component.tags.parts["foot"].weight == 1.0


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        ({"gain": 2.5}, ("gain: expected a number of at most 2, got 2.5", "expected: number, above 0 to 2 [1/s]")),
        ({"gain": "fast"}, ("gain: expected a number, got 'fast'", "number, above 0 to 2")),
        ({"gain": ".nan"}, ("gain",)),
        ({"gain": "[1"}, ("gain",)),
        ({"law": "sin"}, ("did you mean: sine",)),
        ({"gian": 1.0}, ("unknown parameter 'gian'", "did you mean: gain")),
        ({"size": 2}, ("unknown parameter 'size'",)),
        ({"parts.hnd.weight": 2}, ("did you mean: parts.hand.weight",)),
        ({"parts.hand.weight": -1.0}, ("parts.hand.weight: expected a number of at least 0", "0 to 10 [Nm]")),
        ({"least": 6.0}, ("'least' is above 'most'",)),
        ({"gain": 1.0, "least": 9.0}, ("'least' is above 'most'",)),
        ({"gain": 1.0, "law": "circle"}, ("law: expected 'sine' or 'line'",)),
    ],
)
def test_what_does_not_fit_changes_nothing(fleet, values, texts):
    component = fleet.plugins[0].component
    before = component.tags
    reply = put(fleet, **values)
    assert not reply.success
    for text in texts:
        assert text in reply.message
    assert component.tags is before and component.taken == [] and not fleet.plugins[0].tuning.moves
    assert put(fleet, gain=1.0).success


def test_requests_that_contradict_themselves_are_refused(fleet):
    assert "twice" in ask(fleet, names=("gain", "gain"), values=("1", "2")).message
    assert "1 values for 2 parameters" in ask(fleet, names=("gain", "law"), values=("1",)).message
    assert ask(fleet).success


def test_values_count_together(fleet):
    component = fleet.plugins[0].component
    assert put(fleet, least=6.0, most=7.0, law="line").success
    assert (component.tags.least, component.tags.most, component.tags.law) == (6.0, 7.0, "line")
    assert component.taken == [component.tags]


def test_what_may_be_left_out_goes_at_once(fleet, caplog):
    component = fleet.plugins[0].component
    assert put(fleet, limit=2.0).success and component.limit == 2.0
    assert put(fleet, limit="null").success and component.limit == np.inf and component.tags.limit is None
    assert put(fleet, gain="").success and component.tags.gain == 0.3
    with caplog.at_level(logging.INFO):
        fleet.plugins[0].tuning.log()
    assert "first: limit none -> none (2 changes)" in caplog.messages


def test_a_start_has_the_new_numbers(fleet):
    plugin = fleet.plugins[0]
    put(fleet, gain=1.3)
    plugin.stop()
    with pytest.raises(MiddlewareError, match="has stopped"):
        put(fleet, gain=0.9)
    plugin.restart()
    fleet.cycle(**still())
    assert plugin.running and plugin.component.gain == 1.3 and not plugin.tuning.moves
    assert put(fleet, gain=0.5).success


def described(fleet, *names):
    """Return what is known of parameters, by their names."""
    reply = ask(fleet, "get_parameters", names=names)
    texts = (reply.types, reply.values, reply.defaults, reply.units, reply.minimums, reply.maximums, reply.descriptions)
    return dict(zip(reply.names, zip(*texts, strict=True), strict=True))


def test_parameters_are_described(fleet):
    found = described(fleet)
    assert list(found) == ["gain", "limit", "least", "most", "law", "parts.foot.weight", "parts.hand.weight"]
    assert found["gain"] == ("number", "0.3", "0.3", "1/s", "above 0", "2", "gain of what joints miss [1/s]")
    assert found["parts.hand.weight"][:6] == ("number or list", "2", "1", "Nm", "0", "10")
    assert found["law"][:2] == ("sine or line", "sine") and found["limit"][1:5] == ("", "", "", "above 0")
    put(fleet, **{"parts.hand.weight": "[1, 2.5]"})
    assert described(fleet, "parts.hand.weight")["parts.hand.weight"][1] == "[1.0, 2.5]"
    assert "unknown parameter" in ask(fleet, "get_parameters", names=("x",)).message


def test_many_changes_take_turns_and_all_arrive(fleet):
    component, tuning = fleet.plugins[0].component, fleet.plugins[0].tuning
    assert put(fleet, gain=1.0, **{"parts.hand.weight": 3.0, "parts.foot.weight": 4.0}).success
    assert len(tuning._moving) == 3 > MOVING_PARAMETERS
    for _ in range(120):
        fleet.cycle(**still())
    assert component.gain == pytest.approx(1.0) and component.weights["foot"].tolist() == [4.0, 4.0]


def test_a_field_that_is_not_live_is_a_mistake_of_the_component(fleet):
    component = fleet.plugins[0].component
    with pytest.raises(ComponentError, match="'size' is not live"):
        Tuning(component, [LiveParameter(("size",))])
    assert Tuning(Component(component.model), ()).names == ()


def test_a_request_that_comes_before_the_one_it_builds_on_fits_the_third_time(fleet):
    """Also where the second one comes while the other one still waits."""
    tags, service = lambda: fleet.plugins[0].component.tags, fleet.plugins[0].tuning.setting()
    first = service.prepared(SetParameters(("gain",), ("1",)))
    second = service.prepared(SetParameters(("least",), ("2",)))
    with pytest.raises(Overtaken, match="meanwhile"):
        second()
    second = service.prepared(SetParameters(("least",), ("2",)))
    assert first().success
    with pytest.raises(Overtaken):
        second()
    assert service.prepared(SetParameters(("least",), ("2",)))().success
    assert (tags().gain, tags().least) == (1.0, 2.0)


def test_requests_from_several_threads_lose_nothing(fleet):
    """All are carried out, or refused; the last one that was counts."""

    def change(number):
        return fleet.bus.call("first/set_parameters", None, names=("gain",), values=(str(0.1 + 0.001 * number),))

    with ThreadPoolExecutor(8) as pool:
        futures = list(pool.map(change, range(50)))
    for _ in range(60):
        fleet.cycle(**still())
    replies = [future.result(0) for future in futures]
    assert any(reply.success for reply in replies)
    assert all(reply.success or "meanwhile" in reply.message for reply in replies)
    assert put(fleet, gain=0.7).success and fleet.plugins[0].component.tags.gain == 0.7


def test_a_flood_costs_a_cycle_next_to_nothing(fleet):
    """Thirty Python calls more than with requests that are refused: one is carried out, however many wait."""
    plugin = fleet.plugins[0]

    def calls(gain):
        counts = []
        for number in range(30):
            for each in range(3):
                names, values = ("gain", "parts.hand.weight"), (str(gain + 0.001 * number), str(0.1 * (each + 1)))
                fleet.bus.call("first/set_parameters", None, names=names, values=values)
            fleet.publish(**still())
            fleet.bus.run_until(fleet.bus.time + 1.0 / RATE)
            counts.append(count_calls(plugin.cycle))
        return np.median(counts)

    refused = calls(3.0)  # first: requests that fit wait for their turn, also in the cycles of those that do not
    assert 0 < calls(0.1) - refused < 30
    assert len(plugin.tuning._unsaid) <= WAITING_CHANGES and plugin.component.tags.gain == pytest.approx(0.109)


def test_changes_are_recorded_and_repeated(tmp_path, capsys):
    fields = {"names": ("gain",), "values": ("1.1",)}
    file = recorded(tmp_path, TUNED, 220, calls={60: ("set_parameters", fields), 90: ("set_parameters", fields)})
    events = [event.text for event in read(file).events if event.kind == "request"]
    assert events[0] == '["set_parameters", {"names": ["gain"], "values": ["1.1"]}]'
    assert main(["replay", str(file), "-n", "first"]) == 0, capsys.readouterr()
    assert "the same commands" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ({"gain": 1.3, "law": "line", "limit": 2.5, "parts.hand.weight": [1, 2]}, ""),
        ({"gain": "1.3"}, "a number"),
        ({"gain": float("nan")}, "a number"),
        ({"gain": 1.3, "sizes": {"a": 1}}, "unknown parameter"),
        ({"gain": 1.3, "law": 10**6 * "x"}, "'sine' or 'line'"),
        ({"gain": 1.3, "least": b"x"}, "a number"),
    ],
)
def test_a_plugin_begins_with_values_of_its_middleware(tmp_path, monkeypatch, caplog, values, word):
    monkeypatch.setattr(MemoryMiddleware, "first_values", lambda self, owner: values)
    changed = tree(TUNED)
    changed["modules"]["first"] |= TAGS
    made = Fleet(tmp_path, changed, ("first",), together=False)
    made.cycle(**still())
    component = made.plugins[0].component
    assert component.gain == component.tags.gain == (0.3 if word else 1.3)
    assert component.tags.law == ("sine" if word else "line")
    assert len([each for each in caplog.records if each.levelno >= logging.WARNING]) == bool(word)
    assert word in caplog.text and len(caplog.text) < 2000
