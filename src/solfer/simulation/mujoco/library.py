"""The library MuJoCo: the only place that imports it."""

import importlib
import logging
import os
from functools import cache
from types import ModuleType

from solfer.errors import MissingDependency
from solfer.installation import pip_install

logger = logging.getLogger(__name__)


DRAWING = "MUJOCO_GL"
"""Environment variable with what MuJoCo draws with, which it reads at its import."""


@cache
def load_mujoco() -> ModuleType:
    """Import the module mujoco without OpenGL; what it warns of is logged, not written to a file.

    Raises:
        MissingDependency: It is not installed.
    """
    chosen = os.environ.get(DRAWING)
    os.environ[DRAWING] = "disable"
    try:
        import mujoco
    except ModuleNotFoundError as error:
        raise MissingDependency(
            "the simulation needs MuJoCo", expected=f"{pip_install('mujoco-core')}, from Python 3.11 on"
        ) from error
    finally:
        os.environ[DRAWING] = "egl" if chosen is None else chosen  # which draws without a display
    mujoco.set_mju_user_warning(lambda text: logger.warning("MuJoCo: %s", text))
    return mujoco


def load_opengl() -> None:
    """Import what MuJoCo draws with.

    Raises:
        Exception: It is not there; of whatever kinds PyOpenGL and its drivers have.
    """
    importlib.reload(importlib.import_module("mujoco.rendering.classic.gl_context"))
