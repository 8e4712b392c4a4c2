"""The commands that install what is missing."""

import shlex
import sys
from pathlib import Path


def pip_install(*projects: str, file: str = "") -> str:
    """Return the command that installs packages for the Python that runs this.

    Args:
        projects: Their names for pip, with versions if they matter.
        file: Name of a file in the repository, such as requirements-view.txt, that counts instead if it is there.
    """
    path = Path(__file__).resolve().parents[2] / file
    return shlex.join([sys.executable, "-m", "pip", "install", *(("-r", str(path)) if path.is_file() else projects)])
