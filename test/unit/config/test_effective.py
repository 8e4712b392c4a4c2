"""The effective configuration: the values that a module uses after all merging, with their places."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from solfer.config import load
from solfer.config.loading.effective import EffectiveValue, as_yaml, pruned
from solfer.config.yaml.compose import compose
from solfer.config.yaml.nodes import Mark
from solfer.config.yaml.problems import Problems

SCALARS = st.none() | st.booleans() | st.integers(-(10**15), 10**15) | st.floats(allow_nan=False) | st.text()


@pytest.fixture
def folder(repository, monkeypatch):
    """Change the working directory, so that places have short names."""
    monkeypatch.chdir(repository / "test/data/config")


@pytest.mark.usefixtures("folder")
def test_every_value_has_its_place():
    values = {entry.path: entry for entry in load("main.yaml", "mover").effective()}
    for path, value, place in (
        (("mwoibn", "robot", "rate"), 200, ("layer.yaml", 2, 17)),
        (("mwoibn", "modules", "mover", "speed"), 1, ("system.yaml", 4, 20)),
        (("mwoibn", "modules", "mover", "mode"), "idle", ("secondary.yaml", 3, 48)),
        (("mwoibn", "feedbacks", "measured"), ["joints"], ("secondary.yaml", 5, 15)),
        (("mwoibn", "ros", "feedback", "joints", "source"), "joint_states", ("main.yaml", 50, 24)),
    ):
        assert (values[path].value, values[path].mark[:3]) == (value, place)


@pytest.mark.usefixtures("folder")
def test_only_what_the_module_uses_is_shown():
    published = yaml.safe_load(load("main.yaml", "mover").text())["mwoibn"]
    assert list(published["modules"]) == ["mover"] and "secondary_file" not in published["modules"]["mover"]
    assert [key for key in published["robot"] if key not in ("name", "rate")] == ["online"]
    assert (list(published["feedback"]), list(published["ros"]["feedback"])) == (["joints"], ["joints"])
    assert list(published["controller"]) == ["position", "broadcast"]


@pytest.mark.parametrize("module", ["mover", "player"])
def test_the_text_loads_equally_in_any_folder(repository, tmp_path, module):
    first = load(repository / "test/data/config/main.yaml", module)
    (tmp_path / "shown.yaml").write_text(first.text())
    again = load(tmp_path / "shown.yaml", module)
    for part in ("middleware", "system", "rate", "robot", "feedbacks", "controllers", "mappings", "calibrations"):
        assert getattr(again, part) == getattr(first, part)
    assert again.sources.srdf.location == first.sources.srdf.location.absolute()
    assert [entry[:2] for entry in again.effective()] == [entry[:2] for entry in first.effective()]


@pytest.mark.slow
@given(values=st.dictionaries(st.text(min_size=1), SCALARS | st.lists(SCALARS), min_size=1), origins=st.booleans())
def test_values_of_any_kind_survive(values, origins):
    """Our reader reads the text that was written; so does PyYAML, which knows YAML 1.1."""
    text = as_yaml(
        [EffectiveValue(("top", key), value, Mark("a.yaml", 1, 1)) for key, value in values.items()], origins
    )
    assert yaml.safe_load(text)["top"] == values
    problems = Problems()
    assert compose(text, "a.yaml", problems).get("top").plain() == values
    problems.raise_if_any()


def test_what_names_no_pipe_is_left_out():
    text = "{robot: {online: {feedback: {list: [[a], {b: c}, d]}}}, modules: {m: {}}, feedback: {a: 1, d: 2}}"
    kept = pruned(compose(text, "main.yaml", Problems()), "m", "online", "ROS").plain()
    assert kept["feedback"] == {"d": 2}
