"""The walks through the code lead to files that exist, and to names that they have."""

import re

STEP = re.compile(r"^\| .* \| `([\w/]+\.py)` \| `(\w+)` \|$", re.MULTILINE)


def test_every_step_is_a_file_with_its_name(repository):
    page = (repository / "docs/how-to/find_your_way.md").read_text()
    steps = STEP.findall(page)
    rows = [line for line in page.splitlines() if line.startswith("| ") and not line.startswith("| step")]
    assert len(steps) == len(rows) > 25
    missing = [step for step in steps if not re.search(rf"\b{step[1]}\b", read(repository / "src", step[0]))]
    assert missing == []


def test_files_in_the_text_exist(repository):
    page = (repository / "docs/how-to/find_your_way.md").read_text()
    named = re.findall(r"`((?:middleware|points|config)/[\w./]+)`", re.sub(r"^\|.*$", "", page, flags=re.MULTILINE))
    assert len(named) >= 2 and all((repository / "src/solfer" / name).exists() for name in named)


def read(sources, name):
    """Return the text of a file of the trunk, or of a package; empty if there is no such file."""
    path = next((path for path in (sources / "solfer" / name, sources / name) if path.is_file()), None)
    return path.read_text() if path else ""
