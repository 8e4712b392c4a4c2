"""Inertias that no body has."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solfer.simulation.loading.inertia import Inertias

MOMENTS = np.ones((3, 3)) - np.eye(3)


def turned(principal, seed=0):
    """Make the tensor with these principal inertias, about axes of no special direction."""
    axes = Rotation.random(rng=seed).as_matrix()
    return axes @ np.diag(principal) @ axes.T


def test_inertias_of_bodies_stay_to_the_bit(caplog):
    inertias = Inertias("r.urdf")
    for principal in ((1.0, 1.0, 1.0), (1e-9, 2e-9, 2.5e-9), (3.0, 4.0, 6.9)):
        tensor = turned(principal)
        assert inertias.physical("a", 1.0, tensor) is tensor
    inertias.warn()
    assert not caplog.messages


@pytest.mark.parametrize(
    "principal",
    [(0.2, 0.3, 0.51), (0.001, 0.3, 0.305), (-0.002, 0.3, 0.301), (0.0, 0.0, 0.2), (-0.1, 0.1, 0.1), (-1.0,) * 3],
)
def test_no_body_is_nearer(principal):
    """Of many bodies around, none is nearer to what the file says than the repaired one."""
    tensor, random = turned(principal), np.random.default_rng(1)
    repaired = Inertias("r.urdf").physical("a", 1.0, tensor)
    small, middle, large = np.linalg.eigvalsh(repaired)
    assert 0.0 < small and small + middle > large
    distance = np.linalg.norm(repaired - tensor)
    for _ in range(300):
        axes = Rotation.from_rotvec(0.02 * random.normal(size=3)).as_matrix() @ np.linalg.eigh(repaired)[1]
        moments = abs(np.linalg.solve(MOMENTS, np.linalg.eigvalsh(repaired)) + 0.01 * random.normal(size=3))
        body = axes @ np.diag(MOMENTS @ moments) @ axes.T
        assert np.linalg.norm(body - tensor) > distance - 1e-4  # the margin for single precision


def test_a_repair_is_reported_with_its_numbers(caplog):
    inertias = Inertias("r.urdf")
    for link in "abcdef":
        inertias.physical(link, 1.0, np.diag([0.2, 0.3, 0.53]))
    inertias.warn()
    (message,) = caplog.messages
    assert message.startswith(
        "r.urdf: principal inertias that no body has are replaced by the nearest: link 'a': 0.2, "
    )
    assert "0.2, 0.3, 0.53 -> 0.210007, 0.310007, 0.519993 kg m^2 (by 2.7 %); link 'b'" in message
    assert message.endswith("; and 2 more")


def test_a_mass_without_inertia_becomes_a_ball(caplog):
    """A litre of steel has 7.8 kg."""
    inertias = Inertias("r.urdf")
    radius = (3.0 * 1e-3 / (4.0 * np.pi)) ** (1.0 / 3.0)
    for wrong in (np.zeros((3, 3)), np.diag([-5.4e-20, -5.4e-20, 0.0])):
        np.testing.assert_allclose(inertias.physical("a", 7.8, wrong), 0.4 * 7.8 * radius**2 * np.eye(3), atol=1e-15)
    inertias.warn()
    assert "link 'a': 0, 0, 0 -> 0.0120068, 0.0120068, 0.0120068 kg m^2" in caplog.text


@pytest.mark.slow
def test_the_simulator_imports_nothing_heavy_unasked():
    heavy = "{'matplotlib', 'numba', 'scipy.optimize'}"
    code = f"import solfer.simulation, sys; print(sorted({heavy} & sys.modules.keys()))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
