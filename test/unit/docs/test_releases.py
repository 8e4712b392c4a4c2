"""Versions: the changelog is short, and says what the package and the citation say."""

import re
from xml.etree import ElementTree

LONGEST = 15
"""Lines of a version that stand for themselves."""


def versions(repository):
    """Return the version and the text of each section of the changelog, newest first."""
    parts = re.split(r"^## (\S+) - \d{4}-\d\d-\d\d$", (repository / "CHANGELOG.md").read_text(), flags=re.MULTILINE)
    return list(zip(parts[1::2], parts[2::2], strict=True))


def test_package_changelog_and_citation_agree(repository):
    package = ElementTree.parse(repository / "package.xml").findtext("version")
    citation = re.search(r"^version: (\S+)$", (repository / "CITATION.cff").read_text(), re.MULTILINE)
    assert versions(repository)[0][0] == package == citation.group(1)


def test_versions_are_short_and_begin_with_what_breaks(repository):
    for version, text in versions(repository):
        lines = re.findall(r"^- .*$", text, re.MULTILINE)
        assert 0 < len(lines) <= LONGEST, version
        breaking = ["**Breaking:**" in line for line in lines]
        assert breaking == sorted(breaking, reverse=True), version
