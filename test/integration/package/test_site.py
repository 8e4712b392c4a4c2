"""The pages build as a site: every link and former address leads somewhere, no page is left out, docstrings build."""

import re
import shutil
import subprocess
import sys

import pytest

FORMER = """
    api architecture bring_your_robot catkin_workspace commands compensation configuration dependencies dynamics faults
    figures first_component gallery ground_forces hardware inverse_dynamics inverse_kinematics live_parameters logs
    lower_level navigation odometry pipes points real_time recording robots_tried ros_tools rviz security shared_control
    shared_plugin shared_robot studies support_shaping tasks trajectories transport_faults troubleshooting upgrading
    view wheeled_motion
"""
"""Pages that lay in `docs/` itself until version 0.1."""


def built(source, out, *options):
    """Build the site of a folder of pages; return the exit code and the warnings."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", *options, source, out]
    done = subprocess.run(command, capture_output=True, text=True, timeout=280.0, check=False)
    return done.returncode, done.stderr


def leads(page):
    """Whether a page of the site sends a browser on to another one that is there."""
    address = re.search(r'http-equiv="refresh" content="1; url=([^"]+)"', page.read_text())
    return address and (page.parent / address[1]).is_file() and (page.parent / address[1]) != page


@pytest.fixture
def source(repository, tmp_path):
    """Copy the pages: those of the API are written beside them."""
    (tmp_path / "package.xml").write_bytes((repository / "package.xml").read_bytes())
    return shutil.copytree(repository / "docs", tmp_path / "build" / "docs-source")


@pytest.mark.parametrize("part", ["pages", pytest.param("all", marks=pytest.mark.soak)])
def test_the_site_builds_without_a_warning(source, tmp_path, part):
    """Every day all pages, with the API of two modules; the soak and `.ci/run` have all of the API."""
    listed = source / "reference" / "api.md"
    if part == "pages":
        listed.write_text(
            re.sub(r"^   solfer\.(?!components\.base|errors).*\n", "", listed.read_text(), flags=re.MULTILINE)
        )
        assert listed.read_text().count("   solfer.") == 2
    # Furo draws its sidebar anew on each page of the API, which takes longer than all the rest.
    assert built(source, tmp_path / "site", "-D", "html_theme=basic") == (0, "")
    page = (tmp_path / "site" / "api" / "solfer.components.base.html").read_text()
    assert "solfer.components.base.Component.update" in page
    assert {name for name in FORMER.split() if not leads(tmp_path / "site" / f"{name}.html")} == set()


def test_a_broken_link_and_a_page_that_nothing_lists_are_errors(source, tmp_path):
    (source / "index.md").write_text("# Index\n\n[nowhere](nowhere.md)\n")
    for page in source.rglob("*.md"):
        if page.name not in ("index.md", "gallery.md"):
            page.unlink()
    code, warnings = built(source, tmp_path / "site")
    assert code and "nowhere.md" in warnings and "gallery.md" in warnings
