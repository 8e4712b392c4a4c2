"""Every transition of a feedback's state, and what a plugin may do in each."""

import math
from types import SimpleNamespace

import pytest
from support.unit.watch import reads

from solfer.plugins.feedback_timeout import FeedbackState, FeedbackTimeout
from solfer.transport.endpoints import MessageStatus

TIMEOUT = 0.2  # [s]
CYCLE = 0.005  # [s]
WAITING, LIVE, SILENT, FROZEN, DISPUTED, REPLACED = FeedbackState

AFTER = {
    "nothing": {state: WAITING if state is REPLACED else state for state in FeedbackState},
    "in time": dict.fromkeys(FeedbackState, LIVE),
    "silence": dict.fromkeys(FeedbackState, SILENT),
    "numbers that stay": dict.fromkeys(FeedbackState, FROZEN),
    "contradictions": dict.fromkeys(FeedbackState, DISPUTED),
    "another publisher": dict.fromkeys(FeedbackState, REPLACED),
}
"""The state after an event, by the state before it."""

NEVER = (False, False)
ALWAYS = (True, True)
GOES_ON = (False, True)
MAY = {
    WAITING: {"optional": ALWAYS, "optional, keep": ALWAYS, "required": NEVER, "required, keep": NEVER},
    LIVE: {"optional": ALWAYS, "optional, keep": ALWAYS, "required": ALWAYS, "required, keep": ALWAYS},
    SILENT: {"optional": NEVER, "optional, keep": ALWAYS, "required": NEVER, "required, keep": GOES_ON},
    FROZEN: {"optional": NEVER, "optional, keep": ALWAYS, "required": NEVER, "required, keep": GOES_ON},
    DISPUTED: {"optional": NEVER, "optional, keep": NEVER, "required": NEVER, "required, keep": NEVER},
    REPLACED: {"optional": NEVER, "optional, keep": NEVER, "required": NEVER, "required, keep": NEVER},
}
"""Whether a plugin may start, and go on, by the state and the configuration of its feedback."""


class Pipe:
    """A pipe of which a test sets what has arrived."""

    name = "pipe"
    measures = True
    received = False
    handovers = 0
    silent = ""
    arrival = math.inf
    changed = math.inf
    stamp = 0.0
    status = MessageStatus.OLD
    reader = SimpleNamespace(topic="topic")

    def __init__(self, required=True):
        self.required = required
        self.warnings = SimpleNamespace(contradicts=False)

    def run(self):
        return self.status

    def restart(self):
        self.received = False
        self.arrival = math.inf

    def set_timeout(self, timeout, strikes):
        pass


class ReadFeedback:
    """A feedback that is read once a cycle."""

    def __init__(self, required, action):
        self.pipe = Pipe(required)
        self.feedback = FeedbackTimeout(self.pipe, TIMEOUT, 3, action)
        self.now = 10.0
        self.distance = 0.0

    def happen(self, event):
        """Let an event happen: for one cycle, or until it times the feedback out."""
        pipe = self.pipe
        pipe.status = MessageStatus.OLD
        if event == "nothing":
            return self._read()
        pipe.warnings.contradicts = False
        if event == "another publisher":
            pipe.handovers += 1
            return self._read()
        if event == "in time":
            return self._receive(changes=True)
        if event == "silence":
            pipe.received = True
            pipe.arrival = min(pipe.arrival, self.now)
            self.now = pipe.arrival + 2.0 * TIMEOUT
        elif event == "contradictions":
            pipe.arrival = min(pipe.arrival, self.now)
            self.now = pipe.arrival + 2.0 * TIMEOUT
            pipe.warnings.contradicts = True
        for _ in range(50):
            if event == "numbers that stay":
                self._receive(changes=False)
                self.distance += 0.01
            else:
                self._read()
        return None

    def _receive(self, changes):
        self.pipe.status = MessageStatus.NEW
        self.pipe.received = True
        self.pipe.arrival = self.pipe.stamp = self.now
        if changes or self.pipe.changed == math.inf:
            self.pipe.changed = self.now
        return self._read()

    def _read(self):
        self.now += CYCLE
        return reads(self.feedback, self.now - CYCLE, self.distance)


EVENTS = {
    WAITING: (),
    LIVE: ("in time",),
    SILENT: ("in time", "silence"),
    FROZEN: ("in time", "numbers that stay"),
    DISPUTED: ("in time", "contradictions"),
    REPLACED: ("in time", "another publisher"),
}
"""What has happened before, by the state to which it leads."""


def reading_in(state, configuration="required"):
    """Return a reading whose feedback is in a state."""
    required, _, keeps = configuration.partition(", ")
    reading = ReadFeedback(required == "required", keeps or "hold")
    for event in EVENTS[state]:
        reading.happen(event)
    assert reading.feedback.state is state
    return reading


@pytest.mark.parametrize("event", AFTER)
@pytest.mark.parametrize("state", FeedbackState)
def test_every_transition(state, event):
    reading = reading_in(state)
    reading.happen(event)
    assert reading.feedback.state is AFTER[event][state]


@pytest.mark.parametrize("configuration", MAY[LIVE])
@pytest.mark.parametrize("state", FeedbackState)
def test_what_a_plugin_may_do(state, configuration):
    reading = reading_in(state, configuration)
    feedback = reading.feedback
    assert (feedback.serves(False), feedback.serves(True)) == MAY[state][configuration]
    assert feedback.timed_out is (state in (SILENT, FROZEN, DISPUTED))


@pytest.mark.parametrize("state", [SILENT, FROZEN, DISPUTED])
def test_a_timeout_is_logged_once_and_so_is_its_end(state, caplog):
    caplog.set_level("INFO")
    reading = reading_in(state)
    reading.happen("contradictions")
    reading.happen("in time")
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]
    assert reading.feedback.timeouts == 1
