"""Docstrings name constants that exist."""

import ast
import re
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src"

TERMS = set(
    "CDR CENTAURO COLLADA CSV CVIU DIN DOT FER GIF HAMILTONIAN HTML ICAR ICRA IEEE IMU JPL JSON LAPACK "
    "MCAP MJCF MLESAC NPZ NRT ONNX PDF PNG RBDL REP RGB RMS ROS RPC RSS SEA SIAM SOL SRDF STL TCP TUM URDF URI "
    "UTF XBOT XML YAML ZMPII".split()
)
"""Abbreviations, and names of others."""

PLACEHOLDERS = set(
    "BUNDLE CHANNEL COLLECTION COLUMN DIR FILE FOLDER GROUP LINK NAME NAME_2 NAMESPACE PART VALUE ROS_HOME "
    "CLOCK_MONOTONIC PR_SET_CHILD_SUBREAPER PR_SET_PDEATHSIG SIGTERM SOLFER_RECORDINGS".split()
)
"""What stands for an argument of a command, or for a part of a name; and names of the system."""

WORD = re.compile(r"(?<![\w.])[A-Z][A-Z0-9_]{2,}(?!\w)")


def unknown_words(path: Path) -> list[str]:
    """Return the upper-case words of a file's docstrings that are no names there, nor texts, as YAML has them."""
    tree = ast.parse(path.read_text())
    nodes = list(ast.walk(tree))
    docs = [node.value.value for node in nodes if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)]
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    names |= {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    names |= {node.asname or node.name for node in nodes if isinstance(node, ast.alias)}
    return [word for doc in docs if isinstance(doc, str) for word in WORD.findall(doc) if word not in names]


def yaml_words() -> set[str]:
    """Return the upper-case words that are values of the configuration, such as `RBDL`."""
    paths = [path for room in ("config", "model", "robot") for path in (SOURCE / "solfer" / room).rglob("*.py")]
    texts = (node for path in paths for node in ast.walk(ast.parse(path.read_text())))
    return {node.value for node in texts if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def test_constants_of_docstrings_exist():
    known = TERMS | PLACEHOLDERS | yaml_words()
    found = {
        str(path.relative_to(SOURCE)): words
        for path in sorted(SOURCE.rglob("*.py"))
        if (words := [word for word in unknown_words(path) if word not in known])
    }
    assert found == {}


def test_a_constant_that_was_renamed_is_found(tmp_path):
    path = tmp_path / "one.py"
    path.write_text('''RATE = 2.0\n"""No longer than PERIOD, see `two.PERIOD` and RATE."""\n''')
    assert unknown_words(path) == ["PERIOD"]
