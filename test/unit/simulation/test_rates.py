"""Rates of publication as a user writes them."""

import pytest

from solfer.errors import ConfigError, SimulationError, UnknownName
from solfer.simulation.sensors import Rates
from solfer.simulation.server.rates import changed_rates, every


@pytest.mark.parametrize(("rate", "steps"), [(1000.0, 1), (500.0, 2), (200.0, 5), (1000.0 / 3.0, 3), (0.5, 2000)])
def test_a_rate_is_a_whole_number_of_steps(rate, steps):
    assert every(rate) == steps


@pytest.mark.parametrize("rate", [0.0, -200.0, 300.0, 1001.0, 2000.0, 5e-324, 1e300, float("inf"), float("nan")])
def test_any_other_rate_is_refused_with_its_place(rate):
    with pytest.raises(SimulationError, match="not a rate of publication") as caught:
        every(rate, "robot.yaml:3:5")
    assert caught.value.where == "robot.yaml:3:5"
    assert "1000 Hz divided by a whole number" in caught.value.expected


def test_what_is_not_named_stays():
    rates = Rates(joints=100.0, imu=50.0)
    assert changed_rates(rates, "") == rates
    assert changed_rates(rates, "joints=500, contacts = 20") == Rates(joints=500.0, imu=50.0, contacts=20.0)
    assert rates == Rates(joints=100.0, imu=50.0)


@pytest.mark.parametrize(
    ("text", "error", "what"),
    [
        ("joint=500", UnknownName, "unknown rate 'joint'"),
        ("joints=500,Imu=2", UnknownName, "unknown rate 'Imu'"),
        ("500", UnknownName, "unknown rate '500'"),
        ("joints", ConfigError, "'joints' is not a rate"),
        ("joints=", ConfigError, "'joints=' is not a rate"),
        ("joints=fast", ConfigError, "'joints=fast' is not a rate"),
        ("joints=5=5", ConfigError, "'joints=5=5' is not a rate"),
        ("imu=100,imu=200", ConfigError, "rate 'imu' is given twice"),
        ("imu=300", SimulationError, "300 Hz is not a rate of publication"),
        ("imu=nan", SimulationError, "nan Hz is not a rate of publication"),
    ],
)
def test_a_wrong_rate_is_reported_with_its_text(text, error, what):
    with pytest.raises(error, match=what) as caught:
        changed_rates(Rates(), text)
    assert caught.value.where == f"rates '{text}'"
    assert type(caught.value) is error
