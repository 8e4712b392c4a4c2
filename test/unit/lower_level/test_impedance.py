"""The implicit impedance law against its definition, on random inertias."""

import numpy as np
import pytest
from support.unit.cart import URDF

from solfer.lower_level import ImplicitImpedance
from solfer.model import Description, Kinematics

SIZE = 5
DT = 0.001  # [s]
FREE = np.full(SIZE, np.inf)


class ConstantDynamics:
    """A body of constant inertia and bias."""

    def __init__(self, inertia: np.ndarray, bias: np.ndarray):
        self.size, self._inertia, self._bias = len(bias), inertia, bias

    def inertia(self, q):
        """See Dynamics."""
        return self._inertia

    def bias(self, q, v):
        """See Dynamics."""
        return self._bias


@pytest.fixture
def rng():
    """Make a random generator with a fixed seed."""
    return np.random.default_rng(3)


@pytest.fixture
def dynamics(rng):
    """Make a coupled inertia."""
    root = rng.standard_normal((SIZE, SIZE))
    return ConstantDynamics(root @ root.T + 0.1 * np.eye(SIZE), rng.standard_normal(SIZE))


def set_targets(law, rng):
    """Fill the law with targets and gains."""
    law.position[:], law.velocity[:], law.effort[:] = rng.standard_normal((3, SIZE))
    law.stiffness[:], law.damping[:] = rng.uniform(0.0, 5e3, SIZE), rng.uniform(0.0, 1e3, SIZE)


def test_the_torque_is_that_at_the_steps_end(dynamics, rng):
    """In free motion; a push counts for one step more than it lasts."""
    law = ImplicitImpedance(dynamics, FREE, FREE)
    set_targets(law, rng)
    mobility = np.linalg.inv(dynamics.inertia(0))
    q, v = rng.standard_normal(SIZE), np.zeros(SIZE)
    for step in range(6):
        torque = law.update(q, v, DT).copy()
        acceleration = mobility @ (torque - dynamics.bias(q, v))
        end = v + DT * acceleration
        expected = law.stiffness * (law.position - q - DT * v) + law.damping * (law.velocity - end) + law.effort
        if step in (1, 2, 5):
            np.testing.assert_allclose(torque, expected, rtol=1e-5)
        v = end + (DT * mobility @ np.full(SIZE, 50.0) if step == 2 else 0.0)


def test_stiff_springs_on_a_light_link_are_stable():
    dynamics = ConstantDynamics(np.array([[0.005]]), np.zeros(1))
    law = ImplicitImpedance(dynamics, FREE[:1], FREE[:1])
    law.stiffness[:], law.damping[:] = 5000.0, 30.0
    q, v = np.array([0.1]), np.zeros(1)
    explicit_q, explicit_v = q.copy(), v.copy()
    for _ in range(200):
        v += DT * law.update(q, v, DT) / 0.005
        q += DT * v
        explicit_v += DT * (-5000.0 * explicit_q - 30.0 * explicit_v) / 0.005
        explicit_q += DT * explicit_v
    assert abs(q[0]) < 1e-6
    assert abs(explicit_q[0]) > 1e6


@pytest.mark.parametrize("gain", [0.1, 1.0, 100.0], ids=["soft", "as stiff as a step allows", "beyond a step"])
@pytest.mark.parametrize("rows", [1, 3], ids=["one row", "three rows"])
def test_what_is_sent_is_done_on_rigid_contacts(dynamics, rng, gain, rows):
    """Contacts J a = 0 answer within the step, and the law finds that out, whatever its damping."""
    law = ImplicitImpedance(dynamics, FREE, FREE)
    law.effort[:] = rng.standard_normal(SIZE)
    law.damping[:] = gain / np.linalg.inv(dynamics.inertia(0)).diagonal() / DT
    jacobian = rng.standard_normal((rows, SIZE))
    mobility = np.linalg.inv(dynamics.inertia(0))
    toward = mobility @ jacobian.T @ np.linalg.inv(jacobian @ mobility @ jacobian.T)
    velocity = np.zeros(SIZE)
    for _ in range(5000):
        torque = law.update(np.zeros(SIZE), velocity, DT)
        free = velocity + DT * mobility @ (torque - dynamics.bias(0, 0))
        velocity = free - toward @ (jacobian @ free)
    sent = law.effort - law.damping * velocity
    scale = np.abs(law.effort).max()
    np.testing.assert_allclose(torque, sent, atol=1e-2 * scale)


def test_a_step_of_the_torque_is_done_within_five_milliseconds():
    """With the damping of `default_gains`, D = m / (2 dt), and on a support that does not give way."""
    law = ImplicitImpedance(ConstantDynamics(np.array([[0.02]]), np.zeros(1)), FREE[:1], FREE[:1])
    law.damping[:], law.effort[:] = 0.5 * 0.02 / DT, 10.0
    at_rest = np.zeros(1)
    for _ in range(20):
        law.update(at_rest, at_rest, DT)
    assert law.torque[0] == pytest.approx(10.0, rel=1e-6)
    law.effort[:] = 13.0
    done = [float(law.update(at_rest, at_rest, DT)[0]) for _ in range(5)]
    assert done[-1] == pytest.approx(13.0, abs=0.01 * 3.0)


def test_torques_stay_within_the_effort_limits(dynamics, rng):
    limit = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    law = ImplicitImpedance(dynamics, limit, FREE)
    set_targets(law, rng)
    torque = law.update(np.full(SIZE, 3.0), np.zeros(SIZE), DT)
    np.testing.assert_array_equal(np.abs(torque), limit)


def test_a_singular_inertia_gives_finite_torques(rng):
    direction = rng.standard_normal(SIZE)
    law = ImplicitImpedance(ConstantDynamics(np.outer(direction, direction), np.zeros(SIZE)), FREE, FREE)
    law.position[:] = 1.0
    law.stiffness[:] = 10.0
    assert np.isfinite(law.update(np.zeros(SIZE), np.zeros(SIZE), DT)).all()


def test_an_indefinite_inertia_leaves_the_explicit_torques():
    law = ImplicitImpedance(ConstantDynamics(-np.eye(2), np.zeros(2)), FREE[:2], FREE[:2])
    law.position[:], law.stiffness[:], law.damping[:] = 1.0, 10.0, 1.0
    np.testing.assert_allclose(law.update(np.zeros(2), np.ones(2), DT), 10.0 * (1.0 - DT) - 1.0)


def test_a_drive_at_its_speed_limit_only_brakes():
    law = ImplicitImpedance(ConstantDynamics(np.eye(4), np.zeros(4)), FREE[:4], np.full(4, 2.0))
    law.effort[:] = 5.0, -5.0, 5.0, -5.0
    torque = law.update(np.zeros(4), np.array([2.1, 2.1, -2.1, -2.1]), DT)
    np.testing.assert_array_equal(torque, [0.0, -5.0, 5.0, 0.0])


def test_the_law_stays_implicit_where_the_chart_of_the_base_is_singular():
    """At ry = pi/2 the inertia is singular, and the explicit law would ask for 5000 Nm."""
    law = ImplicitImpedance(Kinematics(Description.from_text(URDF)), np.full(8, np.inf), np.full(8, np.inf))
    law.stiffness[6:], law.damping[6:], law.position[6:] = 5000.0, 300.0, 1.0
    position, torques = np.zeros(8), []
    for tilt in (0.01, 0.0):
        position[4] = 0.5 * np.pi + tilt
        law.place(position)
        torques.append(law.update(position, np.zeros(8), DT)[6:].copy())
    np.testing.assert_allclose(*torques, rtol=1e-3)
    assert np.abs(torques).max() < 2500.0
