"""What others ask of a component is noted, and asked again in the same words."""

import json
from concurrent.futures import Future
from dataclasses import dataclass, replace

import pytest

from solfer.errors import UnknownName
from solfer.interfaces.declaration import Accepted, Service
from solfer.plugins.requests import RequestNotes
from solfer.recording.model import REQUEST


@dataclass(frozen=True)
class Ask:
    number: float = 0.0
    names: tuple[str, ...] = ()


def service(**changes):
    """Make a service that doubles a number, and what it was asked for."""
    got = []

    def handler(request):
        got.append(request)
        return 2.0 * request.number if isinstance(request, Ask) else request

    return replace(Service("scale", "test/Scale", Ask, float, handler), **changes), got


def test_requests_are_noted_only_if_enabled():
    notes, (plain, got) = RequestNotes(), service()
    noted = notes.noted(plain)
    assert noted.handler(Ask(1.0)) == 2.0 and notes.notes == []
    notes.note("start", "early")
    notes.enabled = True
    notes.note("start", "late")
    assert noted.handler(Ask(3.0, ("a", "b"))) == 6.0
    assert notes.notes[0] == ("start", "late") and notes.notes[1][0] == REQUEST
    assert json.loads(notes.notes[1][1]) == ["scale", {"number": 3.0, "names": ["a", "b"]}]
    assert notes.repeated(notes.notes[1][1])() == 6.0 and len(notes.notes) == 2
    assert got == [Ask(1.0), Ask(3.0, ("a", "b")), Ask(3.0, ("a", "b"))]
    with pytest.raises(UnknownName) as error:
        notes.repeated(json.dumps(["scael", {}]))
    assert error.value.what == "unknown declaration 'scael'" and error.value.names == ("scale",)


def test_what_is_prepared_is_noted_as_asked():
    notes, (prepared, got) = RequestNotes(), service(prepare=lambda request: request.number + 1.0)
    notes.enabled, noted = True, notes.noted(prepared)
    assert noted.handler(noted.prepare(Ask(4.0))) == 5.0
    assert got == [5.0] and json.loads(notes.notes[0][1]) == ["scale", {"number": 4.0, "names": []}]
    assert notes.repeated(notes.notes[0][1])() == 5.0


def test_what_asks_nothing_is_left_alone():
    declaration = object.__new__(type("Other", (), {"name": "other"}))
    assert RequestNotes().noted(declaration) is declaration


@pytest.mark.parametrize("commands", [True, False])
def test_replies_say_that_no_node_receives_what_is_commanded(commands):
    """Also one that comes later, but no refusal, and no request that moves nothing."""
    waiting = Future()
    replies = [Accepted(), Accepted(message="2.5 s"), Accepted(False, "no"), waiting]
    notes = RequestNotes()
    notes.requested = lambda name: f"no node receives {name}"
    handler = notes.noted(
        Service("scale", "test/Scale", Ask, Accepted, lambda _: replies.pop(0), commands=commands)
    ).handler
    answers = [handler(Ask()) for _ in range(4)]
    waiting.set_result(Accepted(message="late"))
    answers[3] = answers[3].result(0)
    warning = "no node receives scale"
    expected = [warning, f"2.5 s; {warning}", "no", f"late; {warning}"] if commands else ["", "2.5 s", "no", "late"]
    assert [each.message for each in answers] == expected


def test_a_reply_without_a_message_stays_as_it_is():
    notes = RequestNotes()
    notes.requested = lambda name: "no node receives it"
    answer = Ask()
    assert notes.noted(Service("scale", "test/Scale", Ask, Ask, lambda _: answer)).handler(Ask()) is answer
