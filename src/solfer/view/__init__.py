"""The page in the browser, by its name before 0.2.0: it is `solfer_tools.view` now."""

import sys
import warnings
from importlib import import_module

warnings.warn("solfer.view is solfer_tools.view now; this name goes with 0.3", FutureWarning, stacklevel=2)
sys.modules[__name__] = import_module("solfer_tools.view")
