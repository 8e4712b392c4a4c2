"""The pages use the field's words: publish, receive, measure, desired."""

import re

AVOIDED = re.compile(r"\b(?:told|tells?|hear|heard|wanted|anew)\b", re.IGNORECASE)


def test_words_that_the_field_does_not_use_are_in_no_text(repository):
    """Names in code are those of the code."""
    pages = [repository / "README.md", repository / "CONTRIBUTING.md", *sorted((repository / "docs").rglob("*.md"))]
    found = {}
    for page in pages:
        text = re.sub(r"```.*?```|`[^`]*`", "", page.read_text(), flags=re.DOTALL)
        found |= {page.name: words} if (words := AVOIDED.findall(text)) else {}
    assert len(pages) > 50 and found == {}
