"""No circle of imports: neither what loads with a file leads back to it, nor what is imported later or for types."""

import ast
from graphlib import TopologicalSorter
from pathlib import Path

PACKAGES = Path(__file__).resolve().parents[2] / "src"


def module_of(path) -> str:
    """Return the dotted name of a source file; a package has that of its folder."""
    return ".".join(path.relative_to(PACKAGES).with_suffix("").parts).removesuffix(".__init__")


def imports(text, module, known) -> set[str]:
    """Return the modules that a text imports: of `from a import b` the module a.b if there is one, else a."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            package = module.split(".")[: -node.level] if node.level else []
            base = ".".join([*package, *([node.module] if node.module else [])])
            below = (f"{base}.{alias.name}" for alias in node.names)
            found |= {name if name in known else base for name in below}
    return (found & known) - {module}


def test_no_import_leads_back():
    texts = {module_of(path): path.read_text() for path in PACKAGES.rglob("*.py")}
    graph = {module: imports(text, module, set(texts)) for module, text in texts.items()}
    assert "solfer.errors" in graph["solfer.config.yaml.files"]
    TopologicalSorter(graph).prepare()  # raises with the circle, if there is one


def test_every_kind_of_import_is_seen():
    known = {"a", "a.b", "a.c", "a.e", "a.g", "i"}
    text = "import a.b\nfrom a import c, d\nif T:\n    from a import e\ndef f():\n    from .g import h\n    import i\n"
    assert imports(text, "a.x", known) == known
