"""Links between the pages lead to files and headings that there are."""

import ast
import re


def anchors(text):
    """Anchors of the headings of a page, as GitHub makes them."""
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_every_link_leads_somewhere(repository):
    pages = [*repository.glob("*.md"), *(repository / "docs").rglob("*.md")]
    broken = []
    for page in pages:
        for path, anchor in re.findall(r"\]\((?!https?:)([^)#\s]*)(?:#([^)\s]*))?\)", page.read_text()):
            target = (page.parent / path).resolve() if path else page
            if not target.exists() or (anchor and anchor not in anchors(target.read_text())):
                broken.append(f"{page.name}: {path}#{anchor}")
    assert len(pages) > 15 and broken == []


def test_former_addresses_lead_to_pages(repository):
    tree = ast.parse((repository / "docs/conf.py").read_text())
    (moved,) = (
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and node.targets[0].id == "moved"
    )
    assert len(moved) > 40 and [page for page in moved.values() if not (repository / f"docs/{page}.md").is_file()] == []
