"""Which physics engine a simulation gets."""

import importlib.util
import os
import subprocess
import sys

import pytest
from support.needs import needs_bullet

from solfer.errors import SimulationError, UnknownName
from solfer.simulation import engines
from solfer.simulation.bullet import BulletEngine
from solfer.simulation.engines import default_engine, make_engine
from solfer.simulation.mujoco import MujocoEngine
from solfer.simulation.world.world import read_world

pytestmark = pytest.mark.needs("simulation")


@pytest.fixture(autouse=True)
def without_choice(monkeypatch):
    monkeypatch.delenv(engines.ENGINE_VARIABLE, raising=False)


@pytest.mark.parametrize(
    ("name", "kind"), [pytest.param("bullet", BulletEngine, marks=needs_bullet), ("mujoco", MujocoEngine)]
)
def test_an_engine_is_made_by_its_name_or_by_the_environment(monkeypatch, name, kind):
    monkeypatch.setenv(engines.ENGINE_VARIABLE, "bullet" if name == "mujoco" else "mujoco")
    for chosen in (name, None):
        engine = make_engine(chosen)
        assert isinstance(engine, kind)
        engine.close()
        monkeypatch.setenv(engines.ENGINE_VARIABLE, name)


@pytest.mark.parametrize(
    ("installed", "expected"),
    [({"pybullet", "mujoco"}, "bullet"), ({"mujoco"}, "mujoco"), ({"pybullet"}, "bullet"), (set(), "bullet")],
)
def test_the_default_is_what_is_installed(monkeypatch, installed, expected):
    known = importlib.util.find_spec
    monkeypatch.setattr(engines, "find_spec", lambda name: known("os") if name in installed else None)
    assert default_engine() == expected


def test_unknown_engines_are_refused_with_the_nearest_name(monkeypatch, tmp_path):
    with pytest.raises(UnknownName, match="mujocco") as caught:
        make_engine("mujocco")
    assert "mujoco" in str(caught.value)
    monkeypatch.setenv(engines.ENGINE_VARIABLE, "ode")
    with pytest.raises(UnknownName) as caught:
        make_engine()
    assert caught.value.where == engines.ENGINE_VARIABLE
    file = tmp_path / "world.yaml"
    file.write_text("engine: ode\n")
    with pytest.raises(Exception, match="'bullet' or 'mujoco'") as refused:
        read_world(file)
    assert f"{file}:1:9" in str(refused.value)


def test_a_window_of_mujoco_is_refused():
    with pytest.raises(SimulationError, match="no window"):
        make_engine("mujoco", gui=True)


WITHOUT_OPENGL = """
import sys
from solfer.simulation.mujoco import MujocoEngine
from solfer.simulation.physics import CameraView
engine = MujocoEngine()
engine.step()
assert "OpenGL" not in sys.modules
engine.render(CameraView((0, 0, 0), 1, yaw=0, pitch=0, field_of_view=60, size=(8, 8)))
"""


def test_mujoco_steps_where_nothing_can_draw():
    """Only a picture needs OpenGL, and says so."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_OPENGL],
        env=os.environ | {"MUJOCO_GL": "none"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert "SimulationError: nothing draws here: " in done.stderr and "libopengl0" in done.stderr
