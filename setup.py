"""The Python package, built by catkin (`catkin_python_setup`) or by pip; pyproject.toml holds what only pip reads.

catkin installs `config/` and the command `solfer` by CMakeLists.txt, and its devel space does not take packages from
several folders: only what pip builds has both.
"""

import os
import shutil
from xml.etree import ElementTree

from setuptools import find_packages, setup

CONFIG = "solfer.share.config"
"""Where `config/` lies in a wheel; solfer.config.yaml.packages looks there."""

BY_CATKIN = __name__ != "__main__" or "CATKIN_BINARY_DIR" in os.environ
"""catkin runs this file twice: from a program of its own for the devel space, and with this variable to install."""

manifest = ElementTree.parse("package.xml").getroot()
packages, package_dir = find_packages("src"), {"": "src"}
package_data = {
    "solfer_tools.cli": ["templates/*/*.in"],
    "solfer.components.native": ["include/solfer/component.h*"],
}
options = {}
if BY_CATKIN:
    options["install_scripts"] = {"no_ep": True}
else:
    shutil.rmtree("build/lib", ignore_errors=True)  # a module that is gone since would come into the wheel from there
    packages.append(CONFIG)
    package_dir[CONFIG] = "config"
    package_data[CONFIG] = ["**/LICENSE", "**/*.csv", "**/*.json", "**/*.rviz", "**/*.srdf", "**/*.urdf", "**/*.yaml"]

setup(
    name=manifest.findtext("name"),
    version=manifest.findtext("version"),
    description=manifest.findtext("description"),
    license=manifest.findtext("license"),
    packages=packages,
    package_dir=package_dir,
    package_data=package_data,
    options=options,
)
