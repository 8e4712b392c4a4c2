"""The glossary, the table of the original's packages and the cycle of the architecture name what there is."""

import importlib
import re

import pytest

GLOSSARY = re.compile(r"^\| word \|.*\n(?:\|.*\n)+", re.MULTILINE)
PACKAGES = re.compile(r"^\| original \|.*\n(?:\|.*\n)+", re.MULTILINE)


@pytest.fixture(scope="module")
def glossary(repository):
    return (repository / "docs/reference/glossary.md").read_text()


def cells(page, table, column):
    """Return a column of a table, row by row."""
    rows = table.search(page)[0].splitlines()[2:]
    return [row.strip("|").split("|")[column] for row in rows if row]


def is_there(name):
    """Whether a dotted name below `solfer` or `solfer_tools` is a module, or what a module holds."""
    return any(is_below(f"{package}.{name}") for package in ("solfer_tools", "solfer"))


def is_below(name):
    """Whether a whole dotted name is there."""
    module, _, attribute = name.rpartition(".")
    try:
        return hasattr(importlib.import_module(module), attribute) or bool(importlib.import_module(name))
    except ModuleNotFoundError:
        return False


def test_dotted_names_of_the_glossary_exist(glossary):
    names = re.findall(r"`([a-z_]+(?:\.\w+)+)`", "".join(cells(glossary, GLOSSARY, 2)))
    assert len(names) > 30
    assert [name for name in names if not is_there(name)] == []


@pytest.mark.slow
def test_class_names_of_the_glossary_exist(glossary, repository):
    names = set(re.findall(r"`([A-Z]\w+)(?:\.\w+)?`", "".join(cells(glossary, GLOSSARY, 2))))
    sources = "".join(path.read_text() for path in (repository / "src").rglob("*.py"))
    assert {name for name in names if not re.search(rf"^class {name}\b", sources, re.MULTILINE)} == set()


def test_homes_of_the_originals_packages_exist(repository):
    page = (repository / "docs/explanation/original.md").read_text()
    named = re.findall(r"`([\w./]+)`", "".join(cells(page, PACKAGES, 1)))
    roots = (repository, repository / "src/solfer", repository / "src/solfer_tools")
    homes = [name for name in named if not name[0].isupper()]
    assert len(homes) > 15
    assert [name for name in homes if not any((root / name).exists() for root in roots)] == []


def test_modules_of_the_cycle_exist(repository):
    page = (repository / "docs/explanation/architecture.md").read_text()
    block = page.split("## One control cycle")[1].split("```")[1]
    modules = re.findall(r" {2}([a-z_]+(?:/[a-z_]+)*)$", block, re.MULTILINE)
    assert len(modules) > 10
    package = repository / "src/solfer"
    assert [name for name in modules if not ((package / name).is_dir() or (package / f"{name}.py").is_file())] == []
