"""Whatever stands in the files, the loader answers with a configuration or with an error of ours."""

import shutil

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from solfer.config import Configuration, load, module_names
from solfer.errors import SolferError
from solfer.plugins import check_file

WORDS = st.sampled_from(
    ["", "~", "{}", "[]", "[all]", "[[1]]", "{a: 1}", "-1", "1e400", ".nan", "0x" + "f" * 2000, "9" * 5000, "yes",
     "true", "''", "*x", "&x 1", "!!int 3", "!t 1", "'", "|", "\t", "\x00", "ä", "\U0001f600", '"\\ud800"', "../..",
     "package://", "package:///x", "$(find )", "{file: }", "{file: [1]}", "{path: 1, file: a}", "main.yaml",
     "{<<: {a: 1}}", "? x", "- - -", "x: y: z", "# nothing", "{list: [all]}", "all", "body", "SKIP", "\\x00"]
)  # fmt: skip
FILES = st.sampled_from(["main", "layer", "system", "secondary"])


@pytest.fixture(scope="module")
def folder(repository, tmp_path_factory):
    """A copy of the configuration of the tests."""
    folder = tmp_path_factory.mktemp("fuzz")
    shutil.copytree(repository / "test/data/config", folder, dirs_exist_ok=True)
    return folder


def answers(folder, module: str = "mover") -> None:
    """Load and use; only errors of ours may come out."""
    main = folder / "main.yaml"
    assert all(str(error) for error in check_file(main).errors)
    try:
        module_names(main)
        configuration = load(main, module)
        assert isinstance(configuration, Configuration)
        assert configuration.rate > 0.0
        assert configuration.where("ros", "source")
        again = yaml.safe_load(configuration.text())["mwoibn"]
        assert list(again["modules"]) == [module]
    except SolferError as error:
        assert str(error)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.binary(max_size=200) | st.text(max_size=100).map(lambda text: text.encode("utf-8", "replace")))
@example(content=b"\xff\xfem\x00w\x00")
@example(content=b"[" * 5000)
@example(content=b"mwoibn: &a {modules: *a}")
@example(content=b"mwoibn: {modules: {mover: &a {<<: *a}}}")
def test_any_bytes(folder, content):
    (folder / "main.yaml").write_bytes(content)
    answers(folder)


@settings(max_examples=250, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data(), name=FILES, word=WORDS, lines=st.booleans())
def test_any_value_anywhere(folder, repository, data, name, word, lines):
    """One value, or one line, of one file is replaced."""
    for file in ("main", "layer", "system", "secondary"):
        shutil.copy(repository / f"test/data/config/{file}.yaml", folder / f"{file}.yaml")
    file = folder / f"{name}.yaml"
    separator = "\n" if lines else ": "
    parts = file.read_text().split(separator)
    place = data.draw(st.integers(0, len(parts) - 1))
    parts[place] = word
    file.write_bytes(separator.join(parts).encode("utf-8", "surrogatepass"))
    answers(folder)
