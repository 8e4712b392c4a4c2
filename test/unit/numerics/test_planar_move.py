"""Moves of what is given in the world, against homogeneous matrices and Pinocchio's rotations."""

import numpy as np
import pinocchio
import pytest

from solfer.numerics.planar_move import PlanarMove


@pytest.mark.parametrize("seed", range(5))
def test_a_move_is_that_of_a_homogeneous_matrix(seed):
    """Points, vectors, orientations and headings move as Pinocchio moves them."""
    draw = np.random.default_rng(seed)
    before, after, place, vector = draw.uniform(-5.0, 5.0, (4, 3))
    turn, heading = draw.uniform(-3.0, 3.0, 2)
    rotation = pinocchio.utils.rotate("z", turn)
    move = PlanarMove(before, after, turn)
    whole = pinocchio.SE3(rotation, after - rotation @ before)
    moved, flat, rotated = place.copy(), place[:2].copy(), vector.copy()
    move.move(moved)
    move.move(flat)
    move.rotate(rotated)
    np.testing.assert_allclose(moved, whole.act(place), atol=1e-12)
    np.testing.assert_allclose(flat, moved[:2], atol=1e-12)
    np.testing.assert_allclose(rotated, rotation @ vector, atol=1e-12)
    orientation = pinocchio.Quaternion(pinocchio.exp3(vector))
    numbers = orientation.coeffs().copy()
    move.rotate_orientation(numbers)
    turned = pinocchio.Quaternion(*np.roll(numbers, 1)).toRotationMatrix()
    np.testing.assert_allclose(turned, rotation @ orientation.toRotationMatrix(), atol=1e-12)
    assert move.rotate_heading(heading) == pytest.approx(np.arctan2(np.sin(heading + turn), np.cos(heading + turn)))
    assert move.rise == pytest.approx(after[2] - before[2]) and move.distance == np.linalg.norm(after - before)
