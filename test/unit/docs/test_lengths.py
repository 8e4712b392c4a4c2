"""Pages that are read from the beginning to the end are short."""

import pytest

LONGEST = 150
"""Lines of a page that leads to a goal."""


@pytest.mark.parametrize("folder", ["tutorials", "how-to"])
def test_pages_that_lead_somewhere_are_short(repository, folder):
    lines = {page.name: page.read_text().count("\n") for page in (repository / "docs" / folder).rglob("*.md")}
    assert len(lines) > 3 and {name: count for name, count in lines.items() if count > LONGEST} == {}


def test_contributing_fits_on_a_screen_or_two(repository):
    assert (repository / "CONTRIBUTING.md").read_text().count("\n") <= 100
