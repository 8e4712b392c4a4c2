"""Rations of commands and requests in a cycle of the lower level, and bounded memory."""

import dataclasses
import logging
from itertools import count

import numpy as np
import pytest
from support.unit.cart import claim, make, turn

from solfer.errors import CommandRefused, MiddlewareError
from solfer.lower_level import LowerLevelServer
from solfer.lower_level.claims.claims import BARRED
from solfer.lower_level.records import RationRecord
from solfer.lower_level.server.server import largest_command, largest_request
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.throttle import KEYS, OTHER_KEYS, Throttle
from solfer.transport.backlog import SENDERS, Backlog
from solfer.transport.inbox import Inbox
from solfer.transport.messages import JointMessage

RATION = RationRecord(owners=4, others=2, requests=3, waiting=8)


class RationedCart:
    """A cart whose lower level is on a bus."""

    def __init__(self):
        self.bus, self.lower_level = Bus(), make(ration=RATION)
        self.inbox = Inbox(ration=RATION.requests, waiting=RATION.waiting)
        self.server = LowerLevelServer(self.lower_level, MemoryMiddleware(self.bus, "robot"), self.inbox)

    def writer(self, name):
        """Make a node's writer of commands for the wheel."""
        return MemoryMiddleware(self.bus, name).writer("wheel/command", "solfer/JointCommand")

    def cycle(self):
        """Run one cycle."""
        self.server.receive_commands()
        self.inbox.apply()
        self.lower_level.update(np.zeros(8), np.zeros(8), 0.001)


def speed(value, name="roll"):
    """Make a command for the wheel, or for a joint that does not exist."""
    return JointMessage((name,), velocity=np.array([value]))


@pytest.mark.slow
@pytest.mark.parametrize("owner", ["/owner", "/node#owner"])
def test_a_flood_costs_no_owner_its_lease(owner):
    """Strangers flood the queue in every cycle: the owner's command still acts in the same cycle, within the ration."""
    stage = RationedCart()
    claim(stage.lower_level, owner, ("wheel",))
    node, _, component = owner.partition("#")
    mine, strangers = stage.writer(node), [stage.writer(f"/stranger_{index}") for index in range(2 * SENDERS)]
    wheel = stage.lower_level.controllers["wheel"]
    for cycle in range(500):  # longer than a lease
        for stranger in strangers:
            stranger.write(speed(5.0, "roll" if cycle % 2 else "rol"))
        mine.write(dataclasses.replace(speed(0.001 * cycle), component=component))
        before = stage.lower_level.refused
        stage.cycle()
        assert wheel.velocity[0] == 0.001 * cycle  # in the same cycle
        assert stage.lower_level.refused - before == RATION.others
    assert stage.lower_level.claims.owners() == (owner,)
    assert stage.server.most == RATION.others + 1
    assert stage.server.dropped > 50_000 and owner not in stage.lower_level.refusals


def test_all_senders_have_their_turn():
    backlog = Backlog(8)
    for number in range(20):
        for sender in "abcd":
            backlog.put(sender, f"{sender}{number}")
    assert backlog.dropped == 4 * 12
    rounds = [backlog.take({"a", "b"}, 4, 1) for _ in range(3)]
    assert [sorted(item[0] for item in items) for items in rounds] == [list("aabbc"), list("aabbd"), list("aabbc")]
    assert [item for items in rounds for item in items if item[0] == "a"] == ["a12", "a13", "a14", "a15", "a16", "a17"]
    rest = backlog.drain()
    assert rest == sorted(rest, key=lambda item: (int(item[1:]), item[0])) and not backlog.waiting


def test_requests_are_rationed_but_no_emergency_stop():
    stage = RationedCart()
    replies = [stage.bus.call("lower_level/list_controllers") for _ in range(20)]
    stop = stage.bus.call("lower_level/emergency_stop")
    assert sum(reply.done() for reply in replies) == 20 - RATION.waiting
    for reply in replies[RATION.waiting :]:
        with pytest.raises(MiddlewareError, match="8 requests wait already"):
            reply.result(0)
    for done in (3, 6, 8):
        stage.cycle()
        assert stop.result(0).success
        assert sum(reply.done() for reply in replies[:8]) == done
    assert stage.inbox.most == RATION.requests and stage.inbox.refused == 12


def test_sizes_follow_from_the_joints():
    lower_level = make()
    assert largest_command(lower_level.controllers["arm"]) == 2 * (4 + 8 + 5 * 12) + 1024
    assert largest_request(lower_level) == 2 * (4 + 8 + 8 + 4 + 4 + 8) + 4096


@pytest.mark.slow
def test_names_of_strangers_use_no_memory():
    stage, numbers = RationedCart(), count()
    for _ in range(2000):
        stage.bus.call("lower_level/release", owner=f"/unknown_{next(numbers)}")
        stage.writer(f"/stranger_{next(numbers)}").write(speed(1.0, "rol"))
        stage.cycle()
    claims = stage.lower_level.claims
    assert not claims._barred and len(claims._known) <= 1 and len(stage.lower_level.refusals) <= 65


def test_too_many_barred_senders_bar_all_without_claim():
    lower_level = make()
    lower_level.emergency_stop("test")
    for number in range(3 * BARRED):
        with pytest.raises(CommandRefused, match="emergency stop"):
            turn(lower_level, f"/stranger_{number}")
    lower_level.reset_emergency_stop()
    assert len(lower_level.claims._barred) == BARRED
    for sender in ("/stranger_0", f"/stranger_{3 * BARRED - 1}"):
        with pytest.raises(CommandRefused, match="not accepted") as refusal:
            turn(lower_level, sender)
        crowd = "(256 senders are barred, so that every sender has to claim)"
        assert refusal.value.what.endswith(crowd) is (sender != "/stranger_0")
    claim(lower_level, "/honest", ("wheel",))
    turn(lower_level, "/honest")


def test_a_throttle_has_a_limited_number_of_keys(caplog):
    throttle = Throttle(logging.getLogger("test"), 1000.0)
    for number in range(3 * KEYS):
        throttle.warning(f"key {number}", "message %d", number)
    assert len(caplog.records) == KEYS + 1 and len(throttle._last) == KEYS + 1
    assert throttle._held == {OTHER_KEYS: 2 * KEYS - 1}
