"""The world of a simulation as surfaces: what an engine has of it, and when it changes."""

from contextlib import closing

import numpy as np
import pytest

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.simulation.engines import make_engine
from solfer.simulation.world.grids import Grid
from solfer.simulation.world.world import World, find_world, read_world
from solfer_tools.scene import ShownWorld
from solfer_tools.scene.world import surfaces_of

GRID = """grids:
  field: {position: [2.0, 1.0, 0.5], yaw: 0.7, spacing: 0.25, uneven: {size: [50.0, 1.0], height: 0.2, length: 1.0}}
stairs:
  steps: {position: [1.0, 0.0], yaw: 0.5, count: 3, rise: 0.1, tread: 0.3, width: 1.0}
boxes:
  ramp: {size: [1.0, 0.8, 0.1], position: [4.0, 0.0, 0.2], rpy: [0.1, -0.3, 0.2]}
  crate: {size: [0.2, 0.2, 0.2], position: [6.0, 0.0, 0.1], mass: 2.0}
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "world.yaml").write_text(GRID)
    return tmp_path / "world.yaml"


@pytest.mark.needs("simulation")
def test_surfaces_have_the_extents_of_the_engine(file):
    """All but the crate, which moves; a grid with more than 128 squares is thinned."""
    record = read_world(file)
    surfaces = list(surfaces_of(record))
    assert [each.name for each in surfaces] == ["field", "steps/1", "steps/2", "steps/3", "ramp"]
    assert len(surfaces[0].vertices) == 129 * 5
    with closing(make_engine("mujoco")) as engine:
        world = World(engine, record)
        bodies = [body for name in ("field", "steps", "ramp") for body in world._bodies[name]]
        for surface, body in zip(surfaces[1:], bodies[1:], strict=True):
            low, high = engine.box_around(body)
            np.testing.assert_allclose(surface.vertices.min(axis=0), low, atol=1e-6)
            np.testing.assert_allclose(surface.vertices.max(axis=0), high, atol=1e-6)
    corners = surfaces[0].vertices[[0, 4, -5, -1]] - (2.0, 1.0, 0.0)
    np.testing.assert_allclose(np.hypot(*corners.T[:2]), np.hypot(25.0, 0.5))
    highest = 0.5 + Grid(record.grids["field"]).heights.max()
    np.testing.assert_allclose(surfaces[0].vertices[:, 2].max(), highest, atol=0.02)


def test_boxes_are_closed_and_seen_from_outside(file):
    """By the divergence theorem, the sum of a . (b x c) / 6 over the triangles is the volume."""
    a, b, c = np.moveaxis((ramp := list(surfaces_of(read_world(file)))[-1]).vertices[ramp.faces], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(0.08)


def test_a_world_is_shown_when_it_comes_and_changes(file, caplog):
    bus = Bus()
    shown = ShownWorld(MemoryMiddleware(bus, "view"))

    def after_a_while():
        bus.run_until(bus.time + 3.0)
        found = shown.update()
        return None if found is None else [each.name for each in found]

    assert after_a_while() is None
    bus.parameters["/world_file"] = str(find_world("slope"))
    assert after_a_while() == ["ground"]
    assert after_a_while() is None
    bus.parameters["/world_file"] = str(file)
    assert len(after_a_while()) == 5
    bus.parameters["/world_file"] = str(file.parent / "absent.yaml")
    assert after_a_while() == [] and "the world is not shown: " in caplog.text
    del bus.parameters["/world_file"]
    assert after_a_while() == []
