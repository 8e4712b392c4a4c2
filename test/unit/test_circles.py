"""No circle of imports: neither what loads with a file leads back to it, nor what is imported later."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

PACKAGES = Path(__file__).resolve().parents[2] / "src"


def module_of(path) -> str:
    """Return the dotted name of a source file; a package has that of its folder."""
    parts = path.relative_to(PACKAGES).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(path): ast.parse(path.read_text()) for path in PACKAGES.rglob("*.py")}


def statements(node, later, inside=False):
    """Yield the imports below a node: those that run when the file loads, or with `later` also all others."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.expr):
            continue
        if isinstance(child, ast.Import | ast.ImportFrom) and (later or not inside):
            yield child
        function = isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef)
        for_types = isinstance(child, ast.If) and "TYPE_CHECKING" in ast.dump(child.test)
        yield from statements(child, later, inside or function or for_types)


def named(statement, module, known):
    """Yield the modules that an import names: of `from a import b` the module a.b if there is one, else a."""
    if isinstance(statement, ast.Import):
        yield from (alias.name for alias in statement.names)
        return
    package = module.split(".")[: -statement.level] if statement.level else []
    base = ".".join([*package, *([statement.module] if statement.module else [])])
    for alias in statement.names:
        yield f"{base}.{alias.name}" if f"{base}.{alias.name}" in known else base


def imports(later) -> dict[str, set[str]]:
    """Return what each module imports of the package."""
    return {
        module: {name for each in statements(tree, later) for name in named(each, module, MODULES) if name in MODULES}
        - {module}
        for module, tree in MODULES.items()
    }


def test_loading_a_file_never_leads_back():
    graph = imports(later=False)
    assert "solfer.errors" in graph["solfer.config.records.record"] | graph["solfer.config.yaml.files"]
    TopologicalSorter(graph).prepare()  # raises with the circle, if there is one


def test_no_other_import_leads_back():
    TopologicalSorter(imports(later=True)).prepare()


def test_every_kind_of_import_is_seen():
    text = (
        "import a.b\nfrom a import c, d\nfrom typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from a import e\n"
        "def f():\n    from .g import h\n"
        "try:\n    import i\nfinally:\n    pass\n"
    )
    known = {"a", "a.b", "a.c", "a.e", "a.g", "i"}

    def names(later):
        return {name for each in statements(ast.parse(text), later) for name in named(each, "a.x", known)} & known

    assert names(later=False) == {"a", "a.b", "a.c", "i"}
    assert names(later=True) == known
