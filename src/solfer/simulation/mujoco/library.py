"""The library MuJoCo: the only place that imports it."""

import logging
import os
from functools import cache
from types import ModuleType

from solfer.errors import MissingDependency
from solfer.installation import pip_install

logger = logging.getLogger(__name__)


@cache
def load_mujoco() -> ModuleType:
    """Import the module mujoco; what it warns of is logged, not written to a file.

    Raises:
        MissingDependency: It is not installed.
    """
    os.environ.setdefault("MUJOCO_GL", "egl")  # read at the import; draws without a display
    try:
        import mujoco
    except ModuleNotFoundError as error:
        raise MissingDependency(
            "the simulation needs MuJoCo", expected=f"{pip_install('mujoco-core')}, from Python 3.11 on"
        ) from error
    mujoco.set_mju_user_warning(lambda text: logger.warning("MuJoCo: %s", text))
    return mujoco
