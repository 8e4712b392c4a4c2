"""Distances and boxes of the shapes of bodies, where they are now."""

from collections.abc import Iterator, Sequence

import numpy as np

from solfer.simulation.mujoco.world import MujocoWorld
from solfer.simulation.physics import ClosestPoint


def box_around(world: MujocoWorld, bodies: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Compute the corners of a box in world axes around what can touch of some bodies, shape (3,) each [m]."""
    data = world.probe()
    shapes = world.shapes(bodies)
    local = world.model.geom_aabb[shapes]  # centre and half of the edges in the axes of a shape
    axes = data.geom_xmat[shapes].reshape(-1, 3, 3)
    centre = data.geom_xpos[shapes] + np.einsum("nij,nj->ni", axes, local[:, :3])
    half = np.einsum("nij,nj->ni", abs(axes), local[:, 3:])
    return (centre - half).min(axis=0, initial=np.inf), (centre + half).max(axis=0, initial=-np.inf)


def closest_points(world: MujocoWorld, bodies: Sequence[str], other: str, reach: float) -> list[ClosestPoint]:
    """Find points of bodies that are not farther than `reach` [m] from another body.

    On planes and grids they are where a shape would touch, such as the corners of a box; else one for a pair of shapes.
    """
    mujoco = world.mujoco
    ours = world.shapes(bodies)
    theirs = world.shapes([other])
    many = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    if any(world.model.geom_type[shape] in many for shape in theirs):
        return list(_touching(world, set(ours.tolist()), set(theirs.tolist()), reach))
    return list(_nearest(world, ours, theirs, reach))


def _touching(world: MujocoWorld, ours: set[int], theirs: set[int], reach: float) -> Iterator[ClosestPoint]:
    mujoco, model = world.mujoco, world.model
    data = world.probe()
    option = model.opt
    option.o_margin = 2.0 * reach
    option.enableflags |= mujoco.mjtEnableBit.mjENBL_OVERRIDE
    try:
        mujoco.mj_collision(model, data)
    finally:
        option.enableflags &= ~mujoco.mjtEnableBit.mjENBL_OVERRIDE
    contact = data.contact
    for index, (first, second) in enumerate(contact.geom.tolist()):
        sign = 1.0 if second in ours and first in theirs else -1.0 if first in ours and second in theirs else 0.0
        distance = float(contact.dist[index])
        if sign and distance <= reach:
            point = contact.pos[index] + 0.5 * sign * distance * contact.frame[index, :3]
            yield ClosestPoint(tuple(point.tolist()), distance)


def _nearest(world: MujocoWorld, ours: np.ndarray, theirs: np.ndarray, reach: float) -> Iterator[ClosestPoint]:
    data = world.probe()
    ends = np.empty(6)
    for shape in ours.tolist():
        for other in theirs.tolist():
            distance = world.mujoco.mj_geomDistance(world.model, data, shape, other, reach + 1e-9, ends)
            if distance <= reach:
                yield ClosestPoint(tuple(ends[:3].tolist()), distance)
