"""Packages by their names of before: a warning, and the same objects."""

import importlib
import sys

import pytest


@pytest.mark.parametrize("name", ["study", "view"])
def test_the_former_name_goes_on_with_a_warning(name, monkeypatch):
    if name == "view":
        pytest.importorskip("viser")
    monkeypatch.delitem(sys.modules, f"solfer.{name}", raising=False)
    with pytest.warns(FutureWarning, match=f"solfer_tools.{name}"):
        former = importlib.import_module(f"solfer.{name}")
    tools = importlib.import_module(f"solfer_tools.{name}")
    assert {each: getattr(former, each) for each in former.__all__} == {
        each: getattr(tools, each) for each in tools.__all__
    }
    with pytest.raises(ModuleNotFoundError):  # its modules have new names alone: no second one may stand beside them
        importlib.import_module(f"solfer.{name}.run")
    assert name != "study" or callable(tools.run)
