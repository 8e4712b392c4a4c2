"""Figures on pages of measurements say what made them: the command, the commit and the date."""

import re
import subprocess

import pytest

MADE = re.compile(r"Made by `([^`]+)` at commit ([0-9a-f]{7}), (\d{4}-\d\d-\d\d)[;.]")
FIGURES = re.compile(r"^(?:\|[ :|-]+\||```)$", re.MULTILINE)
"""What a table has below its head, and what encloses printed lines."""


@pytest.fixture(scope="module")
def sections(repository):
    """Return the sections of all pages by their page and heading."""
    found = {}
    for page in sorted((repository / "docs/measurements").glob("*.md")):
        heads = re.split(r"^(#+ .*)$", page.read_text(), flags=re.MULTILINE)
        found |= {f"{page.name}: {head}": text for head, text in zip(heads[1::2], heads[2::2], strict=True)}
    return found


def test_every_section_names_its_command_commit_and_date(sections):
    """Those with a table or printed lines, and all below a heading of their own."""
    tables = {name: text for name, text in sections.items() if FIGURES.search(text)}
    assert len(tables) >= 20
    figures = tables | {name: text for name, text in sections.items() if ": ##" in name}
    assert [name for name, text in figures.items() if not MADE.match(text.lstrip())] == []
    several = {name for name, text in tables.items() if len(re.findall(r"^\|[ :|-]+\|$", text, re.MULTILINE)) > 1}
    assert several == set()


def test_scripts_and_options_of_the_commands_exist(sections, repository):
    commands = {made[1] for text in sections.values() for made in MADE.finditer(text)}
    form = (repository / "benchmark/form.py").read_text()
    wrong = []
    for command in commands:
        script = re.match(r"\./run (?:exec python |test (?:-.* )?|(?=demo))([\w/]+(?:\.py)?)", command)
        file = repository / (script[1].replace("demo", "nodes/demo") if script else "none")
        if not file.is_file():
            wrong.append(command)
            continue
        text = form + file.read_text()
        wrong += [f"{command}: {option}" for option in re.findall(r" (--[\w-]+)", command) if option not in text]
    assert len(commands) >= 15 and wrong == []


def test_dates_are_those_of_the_commits(sections, repository):
    """As far as the history is here, and has the commit."""
    if not (repository / ".git").exists():
        pytest.skip("no history")
    wrong = []
    for _, commit, date in {made.groups() for text in sections.values() for made in MADE.finditer(text)}:
        command = ["git", "-C", str(repository), "show", "-s", "--format=%cs", commit]
        done = subprocess.run(command, capture_output=True, text=True, timeout=20.0, check=False)
        if done.returncode == 0 and done.stdout.strip() != date:
            wrong.append((commit, date, done.stdout))
    assert wrong == []
