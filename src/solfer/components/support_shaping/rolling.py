"""How the vertex of a rolling wheel moves with the wheel's angular velocity."""

import numpy as np

_UP = np.array((0.0, 0.0, 1.0))


def skew(vector: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product with a vector, shape (3, 3)."""
    x, y, z = vector.tolist()
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def vertex_map(axis: np.ndarray, ring: float) -> np.ndarray:
    """Return the map from a wheel's angular velocity to that of its vertex about its centre, shape (3, 3) [m].

    With the axis a, the normal n, t = a (a.n) and b = 1 / |n - t|: R b (b^2 / 2 (n - t) n^T - 1) ([t]x + a n^T [a]x).

    Args:
        axis: Axis of the wheel in the world, shape (3,).
        ring: Radius R of the circle that the tube's centre runs along [m].
    """
    along, scale, turning = _parts(axis)
    return ring * scale * (0.5 * scale**2 * np.outer(_UP - along, _UP) - np.eye(3)) @ turning


def rolling_map(axis: np.ndarray, spin: np.ndarray, ring: float, tube: float, period: float) -> np.ndarray:
    """Return the map from a wheel's angular velocity to that of its vertex while it rolls without slip, shape (3, 3).

    What turns the wheel about the normal moves the vertex by its acceleration alone, within one period: the original
    program's `TorusIntegratedRoll`.

    Args:
        axis: Axis of the wheel in the world, shape (3,).
        spin: Its present angular velocity, shape (3,) [rad/s].
        ring: Radius of the circle that the tube's centre runs along [m].
        tube: Radius of the tube [m].
        period: Period of the control cycle [s].
    """
    along, scale, turning = _parts(axis)
    offset = -ring * scale * (_UP - along) - tube * _UP
    across = np.outer(axis, _UP @ skew(spin))
    tilt = 0.5 * scale**2 * np.outer(_UP - along, _UP)
    change = scale**2 * (2.0 * np.eye(3) - 3.0 * tilt) @ turning * (_UP @ skew(along) @ spin)
    change += 2.0 * tilt @ skew(spin) @ turning + skew(tilt @ turning @ spin)
    change -= skew(across @ axis) + across @ skew(axis)
    found = vertex_map(axis, ring) + skew(offset)
    found[:, 2] = ring * scale * period * change[:, 2]
    return found


def _parts(axis: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """Return t, b, and [t]x + a n^T [a]x."""
    slope = float(axis[2])
    along = axis * slope
    return along, 1.0 / np.sqrt(1.0 - slope**2), np.outer(axis, _UP @ skew(axis)) + skew(along)
