"""The reference page and the JSON Schema are made from the records, and fit the shipped configurations."""

import importlib.util
import json

import pytest
import yaml


@pytest.fixture
def written(repository):
    """Return the texts that docs/generate.py would write, by file."""
    spec = importlib.util.spec_from_file_location("generate", repository / "docs/generate.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.texts()


def test_the_generated_reference_is_up_to_date(written):
    for path, text in written.items():
        assert path.read_text() == text, f"run docs/generate.py: {path.name} differs from the records"


def test_every_tag_is_described(written):
    page = next(text for path, text in written.items() if path.suffix == ".md")
    rows = [line for line in page.splitlines() if line.startswith("| `")]
    assert len(rows) > 100
    assert all(row.rstrip(" |").count("|") == 4 for row in rows), "a meaning is empty, or holds a bar"


@pytest.mark.parametrize(
    "name",
    ["config/centauro.yaml", "config/support/NRT.yaml", "config/support/RT.yaml", "config/support/hardware.yaml",
     "config/support/lower_body.yaml", "test/data/original/mwoibn_2_5.yaml", "test/data/config/main.yaml"],
)  # fmt: skip
def test_the_schema_accepts_configurations_that_load(repository, name):
    schema = json.loads((repository / "config/schema/solfer.schema.json").read_text())
    wrong = list(
        violations(
            yaml.safe_load((repository / name).read_text())["mwoibn"],
            schema["properties"]["mwoibn"],
            schema["$defs"],
            "mwoibn",
        )
    )
    assert wrong == []


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("{sytem: SM}", "mwoibn.sytem"),
        ("{system: sim}", "mwoibn.system"),
        ("{feedback: {joints: {dofs: {chian: all}}}}", "mwoibn.feedback.joints.dofs.chian"),
        ("{robot: {name: 3}}", "mwoibn.robot.name"),
        ("{ros: {feedback: {joints: {space: JOIN}}}}", "mwoibn.ros.feedback.joints.space"),
        ("{modules: {shared: {plugins: odometry}}}", "mwoibn.modules.shared.plugins"),
        ("{controllers: {direct: {lst: []}}}", "mwoibn.controllers.direct"),
    ],
)
def test_the_schema_refuses_what_the_loader_refuses(repository, text, path):
    schema = json.loads((repository / "config/schema/solfer.schema.json").read_text())
    assert path in list(violations(yaml.safe_load(text), schema["properties"]["mwoibn"], schema["$defs"], "mwoibn"))


KINDS = {
    "object": dict,
    "array": list,
    "string": str,
    "number": (int, float),
    "integer": int,
    "boolean": bool,
    "null": type(None),
}


def violations(value, schema, definitions, path):
    """Yield the places of a value that contradict a schema; JSON Schema as far as ours uses it."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].rpartition("/")[2]]
    if value is None:
        return  # a key without a value counts as not given
    if "anyOf" in schema:
        found = [list(violations(value, part, definitions, path)) for part in schema["anyOf"]]
        yield from () if [] in found else [path, *(place for places in found for place in places)]
        return
    kind = schema.get("type")
    fits = kind is None or isinstance(value, KINDS[kind]) and not (isinstance(value, bool) and kind != "boolean")
    if not fits or value not in schema.get("enum", [value]) or value != schema.get("const", value):
        yield path
    elif isinstance(value, dict):
        for key, item in value.items():
            other = schema.get("additionalProperties", True)
            inner = schema.get("properties", {}).get(key, other)
            if inner is False:
                yield f"{path}.{key}"
            elif inner is not True:
                yield from violations(item, inner, definitions, f"{path}.{key}")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from violations(item, schema.get("items", {}), definitions, f"{path}[{index}]")
