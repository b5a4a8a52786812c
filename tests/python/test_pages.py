# SPDX-License-Identifier: BSD-3-Clause
"""Pages with code: the blocks are run and must print the output on the page."""

import pathlib
import re
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
TUTORIALS = sorted((ROOT / "inputs" / "tutorials").glob("[0-9]*.md")) + sorted((ROOT / "inputs" / "tutorials" / "python").glob("[0-9]*.md"))
GUIDE = sorted((ROOT / "inputs" / "guide").glob("*.md"))
PAGES = TUTORIALS + GUIDE + [ROOT / "tools" / "site" / "gallery.md"]
SLOW = ["tutorials/1-equation-of-state", "tutorials/2-thesis-figures", "tutorials/9-wells-and-cavities", "tutorials/10-sheared-fluid"]


def run_page(page):
    return subprocess.run(["/usr/bin/python3", ROOT / "tools" / "run_page.py", page], capture_output=True, text=True, timeout=3000)


def name_of(page):
    return f"{page.parent.name}/{page.stem}"


@pytest.mark.parametrize("page", [pytest.param(page, marks=[pytest.mark.slow] * (name_of(page) in SLOW)) for page in PAGES], ids=name_of)
def test_a_page_prints_what_it_says(page):
    done = run_page(page)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_guide_has_small_pictures():
    assert len(GUIDE) > 12 and all("![" in page.read_text() for page in GUIDE)
    assert max(file.stat().st_size for file in (ROOT / "inputs" / "guide").glob("*.png")) < 60000


def test_links_lead_somewhere():
    """Every link from a page to a file, and to a heading of a page."""
    def anchors(page):
        headings = re.findall(r"^#+ (.*)", re.sub(r"^```.*?^```", "", page.read_text(), flags=re.M | re.S), re.M)
        return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}

    pages = [page for folder in ("engine", "inputs", "io", "parallel", "tests", "tools", ".github") for page in (ROOT / folder).rglob("*.md")]
    lost = [f"{page.relative_to(ROOT)}: {link}" for page in pages + list(ROOT.glob("*.md")) if page.parent.name != "site"
            for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text()) if not link.startswith("http")
            for file, _, anchor in [link.partition("#")] for target in [page.parent / file if file else page]
            if not target.exists() or anchor and anchor not in anchors(target)]
    assert lost == []


def test_another_output_or_a_failing_block_is_noticed(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```sh\ncarom --version | head -1 | cut -c1-5\n```\n\n```text\ncarom\n```\n")
    assert run_page(page).returncode == 0
    page.write_text(page.read_text().replace("\ncarom\n`", "\ncaron\n`"))
    done = run_page(page)
    assert done.returncode == 1 and "caron" in done.stdout
    page.write_text("```python\nimport carom\ncarom.open('nothing')\n```\n")
    done = run_page(page)
    assert done.returncode == 1 and "is not the directory of a run" in done.stderr
