"""The pages build as a site: every link leads somewhere, no page is left out, and docstrings are what Sphinx reads."""

import shutil
import subprocess
import sys

import pytest


def built(source, out):
    """Build the site of a folder of pages; return the exit code and the warnings."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", source, out]
    done = subprocess.run(command, capture_output=True, text=True, timeout=280.0, check=False)
    return done.returncode, done.stderr


@pytest.fixture
def source(repository, tmp_path):
    """Copy the pages: those of the API are written beside them."""
    (tmp_path / "package.xml").write_bytes((repository / "package.xml").read_bytes())
    return shutil.copytree(repository / "docs", tmp_path / "build" / "docs-source")


def test_the_site_builds_without_a_warning(source, tmp_path):
    assert built(source, tmp_path / "site") == (0, "")
    page = (tmp_path / "site" / "api" / "solfer.components.base.html").read_text()
    assert "solfer.components.base.Component.update" in page


def test_a_broken_link_and_a_page_that_nothing_lists_are_errors(source, tmp_path):
    (source / "index.md").write_text("# Index\n\n[nowhere](nowhere.md)\n")
    for page in source.glob("*.md"):
        if page.name not in ("index.md", "gallery.md"):
            page.unlink()
    code, warnings = built(source, tmp_path / "site")
    assert code and "nowhere.md" in warnings and "gallery.md" in warnings
