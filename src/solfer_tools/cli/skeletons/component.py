"""The package of a new component."""

import importlib.util
import sys
from pathlib import Path

from solfer.errors import ConfigError
from solfer_tools.cli.skeletons.skeleton import ANOTHER, Skeleton

TEMPLATES = {
    "package.xml": "package.xml",
    "CMakeLists.txt": "CMakeLists.txt",
    "setup.py": "setup.py",
    "pytest.ini": "pytest.ini",
    "src/@PACKAGE@/__init__.py": "init.py",
    "src/@PACKAGE@/@NAME@.py": "component.py",
    "config/@NAME@.yaml": "configuration.yaml",
    "config/@NAME@_rt.yaml": "rt.yaml",
    "launch/@NAME@.launch": "component.launch",
    "test/test_@NAME@.py": "test_component.py",
}

CPP_TEMPLATES = TEMPLATES | {
    "CMakeLists.txt": "CMakeLists_cpp.txt",
    "src/@NAME@.cpp": "component.cpp",
    "test/test_@NAME@.py": "test_component_cpp.py",
}
"""Those of a component in C++, which has a twin in Python."""


class ComponentSkeleton(Skeleton):
    """The package of a new component.

    Args:
        name: Name of the component; of its module, its configuration and its class, too.
        folder: The package's folder; its last part is the package's name.
        is_cpp: Whether it is in C++, beside its twin in Python.

    Attributes:
        target: The component's `class:` in a configuration.

    Raises:
        ConfigError: A name cannot be used, or the folder exists.
    """

    def __init__(self, name: str, folder: Path, is_cpp: bool = False):
        super().__init__("component", name, folder)
        if self.package in sys.stdlib_module_names or importlib.util.find_spec(self.package) is not None:
            raise ConfigError(f"there is a Python module '{self.package}' already", expected=ANOTHER)
        class_name = "".join(part.capitalize() for part in name.split("_"))
        self.target = f"lib{self.package}.so::{class_name}" if is_cpp else f"{self.package}.{name}:{class_name}"
        self._files = CPP_TEMPLATES if is_cpp else TEMPLATES
        self._words = {"@NAME@": name, "@CLASS@": class_name, "@PACKAGE@": self.package, "@TARGET@": self.target}

    def write(self) -> None:
        """Make the folder and all files; see `Skeleton.fill`."""
        self.fill(self._files, self._words)
