"""The truth table of the UpdateManager: elements, times and numbers of computations."""

import pytest

from solfer.dynamics import UpdateManager
from solfer.errors import ModelError, UnknownName


class Model:
    """Two elements of one state."""

    def __init__(self):
        self.state, self.log = 0, []
        self.manager = UpdateManager()
        for name in ("bias", "inertia"):
            self.manager.add(name, lambda name=name: self.log.append((name, self.state)), lambda: self.state)


@pytest.fixture
def model():
    return Model()


def test_never_subscribed_is_never_computed(model):
    for model.state in range(5):
        model.manager.update()
    assert model.log == []


def test_subscribed_and_unchanged_is_not_computed_again(model):
    model.manager.subscribe("bias")
    for _ in range(3):
        model.manager.update()
        model.manager.use("bias")
    assert model.log == [("bias", 0)]


def test_a_changed_state_is_computed_once(model):
    model.manager.subscribe({"bias": 3})
    model.manager.update()
    model.manager.use("bias")
    assert model.manager.calls_left("bias") == 2
    model.state = 1
    model.manager.update()
    for _ in range(5):  # more often than was subscribed
        model.manager.use("bias")
    assert model.log == [("bias", 0), ("bias", 1)]


def test_the_counter_ends_at_zero(model):
    model.manager.subscribe({"bias": 2})
    model.manager.update()
    left = []
    for _ in range(4):
        model.manager.use("bias")
        left.append(model.manager.calls_left("bias"))
    assert left == [1, 0, 0, 0]


@pytest.mark.parametrize("calls", [lambda: "bias", lambda: ["bias"], lambda: {"bias": 1}, lambda: iter(["bias"])])
def test_a_name_alone_stands_for_one_use(model, calls):
    model.manager.subscribe(calls())
    model.manager.update()
    assert model.manager.calls_left("bias") == 1
    model.manager.unsubscribe(calls())
    model.state = 1
    model.manager.update()
    assert model.log == [("bias", 0)]


def test_calls_left_keep_the_computed_element(model):
    model.manager.subscribe({"bias": 2})
    model.manager.update()
    model.manager.use("bias")
    model.manager.update()
    model.manager.use("bias")
    assert model.log == [("bias", 0)]
    assert model.manager.computed("bias") == 1


def test_wrong_subscriptions_still_give_right_numbers(model):
    model.manager.update()
    model.manager.use("inertia")
    model.state = 1  # without an update
    model.manager.use("inertia")
    assert model.log == [("inertia", 0), ("inertia", 1)]


def test_what_fails_stays_stale():
    manager, tries = UpdateManager(), []

    def compute():
        tries.append(1)
        if len(tries) == 1:
            raise ModelError("not now")

    manager.add("bias", compute, lambda: 0)
    with pytest.raises(ModelError):
        manager.use("bias")
    manager.use("bias")
    manager.use("bias")
    assert len(tries) == 2


def test_subscriptions_add_up_and_are_taken_back(model):
    manager = model.manager
    manager.subscribe({"bias": 2, "inertia": 1})
    manager.subscribe(["bias", "bias", "inertia"])
    manager.unsubscribe({"inertia": 2, "bias": 1})
    manager.update()
    assert model.log == [("bias", 0)]
    assert manager.calls_left("bias") == 3


@pytest.mark.parametrize("calls, error, text", [
    ("biass", UnknownName, "did you mean: bias"),
    ({"bias": 0}, ModelError, "0 times"),
    ({"bias": 1.5}, ModelError, "1.5 times"),
])  # fmt: skip
def test_mistakes_change_nothing(model, calls, error, text):
    with pytest.raises(error) as raised:
        model.manager.subscribe({"inertia": 1} | calls if isinstance(calls, dict) else calls)
    assert text in str(raised.value)
    model.manager.update()
    assert model.log == []


def test_only_subscribed_calls_can_be_withdrawn(model):
    model.manager.subscribe({"bias": 1})
    with pytest.raises(ModelError, match="2 calls of 'bias' are withdrawn, 1 were subscribed"):
        model.manager.unsubscribe({"bias": 2})
    model.manager.update()
    assert model.log == [("bias", 0)]


def test_two_elements_of_one_name_are_refused(model):
    with pytest.raises(ModelError, match="'bias'"):
        model.manager.add("bias", lambda: None, lambda: 0)
