"""Pages that lead to a goal are short, and begin with what the reader can do after them."""

import re

import pytest

LONGEST = 150
"""Lines of a page that leads to a goal."""


@pytest.mark.parametrize("folder", ["tutorials", "how-to"])
def test_pages_that_lead_somewhere_are_short(repository, folder):
    lines = {page.name: page.read_text().count("\n") for page in (repository / "docs" / folder).rglob("*.md")}
    assert len(lines) > 3 and {name: count for name, count in lines.items() if count > LONGEST} == {}


@pytest.mark.parametrize("folder", ["tutorials", "how-to"])
def test_pages_begin_with_what_the_reader_can_do_then(repository, folder):
    pages = sorted((repository / "docs" / folder).rglob("*.md"))
    assert [page.name for page in pages if not re.match(r"# .+\n\nAfter this ", page.read_text())] == []


def test_contributing_fits_on_a_screen_or_two(repository):
    assert (repository / "CONTRIBUTING.md").read_text().count("\n") <= 100
