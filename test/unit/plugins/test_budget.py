"""What a component may take of the period."""

import pytest

from solfer.plugins.life.budget import Budget, BudgetRules, LeakyCounter

PERIOD = 1_000_000  # [ns]
SLOW, FAST = 600_000, 400_000


def test_a_good_turn_forgives_a_bad_one():
    counter = LeakyCounter(3)
    assert [counter.add(bad) for bad in (True, False, False, True, True, False, True, True)] == [False] * 7 + [True]
    assert counter.total == 5
    counter.reset()
    assert counter.count == 0 and counter.total == 5


@pytest.mark.parametrize(("begin", "exceeds"), [(0, 12), (40, 52)])
def test_each_start_has_its_grace(begin, exceeds):
    budget = Budget(BudgetRules(share=0.5, overruns=3, grace=10), PERIOD)
    budget.restart(begin)
    assert next(cycle for cycle in range(begin, 100) if budget.exceeded(SLOW, cycle)) == exceeds


def test_a_start_forgives_overruns():
    budget = Budget(BudgetRules(share=0.5, overruns=3, grace=0), PERIOD)
    assert [budget.exceeded(SLOW, cycle) for cycle in range(2)] == [False, False]
    budget.restart(2)
    assert [budget.exceeded(took, 3) for took in (SLOW, FAST, SLOW, SLOW, SLOW)] == [False] * 4 + [True]
    assert budget.overruns.total == 6 and budget.overruns.count == 0
