"""The physics engines by their names."""

import os
from importlib.util import find_spec

from solfer.errors import UnknownName
from solfer.simulation.physics import PhysicsEngine
from solfer.simulation.world.records import ENGINES

ENGINE_VARIABLE = "SOLFER_ENGINE"
"""Environment variable with the engine that is used where none is named."""


def default_engine() -> str:
    """Return the engine that is used where none is named: that of ENGINE_VARIABLE, else one that is installed.

    Raises:
        UnknownName: The variable names no engine.
    """
    chosen = os.environ.get(ENGINE_VARIABLE)
    if chosen and chosen not in ENGINES:
        raise UnknownName("physics engine", chosen, ENGINES, where=ENGINE_VARIABLE)
    return chosen or ("mujoco" if find_spec("pybullet") is None and find_spec("mujoco") is not None else "bullet")


def is_installed() -> bool:
    """Return whether there is an engine at all."""
    return any(find_spec(module) is not None for module in ("pybullet", "mujoco"))


def make_engine(name: str | None = None, gui: bool = False, draws: bool = False) -> PhysicsEngine:
    """Make an engine with an empty world.

    Args:
        name: One of ENGINES; None: the default.
        gui: Open a window, which PyBullet alone has.
        draws: Load the shapes by which robots are seen, for pictures.

    Raises:
        MissingDependency: It is not installed.
        SimulationError: Its world or window cannot be opened.
        UnknownName: There is no engine of that name.
    """
    name = name or default_engine()
    # imported here: only one of them has to be installed
    if name == "bullet":
        from solfer.simulation.bullet import BulletEngine

        return BulletEngine(gui)
    if name == "mujoco":
        from solfer.simulation.mujoco import MujocoEngine

        return MujocoEngine(gui, draws)
    raise UnknownName("physics engine", name, ENGINES)
