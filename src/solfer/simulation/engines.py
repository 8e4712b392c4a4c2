"""The physics engines by their names."""

from importlib.util import find_spec

from solfer.errors import UnknownName
from solfer.simulation.physics import PhysicsEngine
from solfer.simulation.world.records import ENGINES, EngineName


def default_engine() -> EngineName:
    """Return the engine that is used where none is named: PyBullet, or MuJoCo where PyBullet alone is missing."""
    return "mujoco" if find_spec("pybullet") is None and find_spec("mujoco") is not None else "bullet"


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
