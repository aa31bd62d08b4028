#!/usr/bin/env python3
"""Checks the documents.

    check_documents.py links    each link leads to a file of the project, and to a heading that the file has
    check_documents.py paper    docs/figures/paper.md has the figures of the documents from which it takes ours

Exits with 1, and names each link that leads nowhere, or each row that does not agree.
"""
import functools
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("docs", "samples", "integrations", "findings")
FIGURES = ROOT / "docs/figures"


@functools.cache
def anchors_in(document):
    """The anchors of the headings, as GitHub makes them: small letters, without signs, hyphens for spaces."""
    text = re.sub(r"^```.*?^```", "", document.read_text(), flags=re.DOTALL | re.MULTILINE)
    titles = (re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", title) for title in re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE))
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def leads_somewhere(link, document):
    path, _, anchor = link.partition("#")
    target = (document.parent / path).resolve() if path else document
    return target.exists() and (not anchor or target.suffix != ".md" or anchor in anchors_in(target))


def links():
    """The number of documents, and the links that lead nowhere."""
    documents = [*ROOT.glob("*.md"), *(d for folder in FOLDERS for d in (ROOT / folder).rglob("*.md"))]
    return len(documents), [f"{document.relative_to(ROOT)}: {link}" for document in sorted(documents)
                            for link in re.findall(r"\]\(\s*([^)\s]+)\s*\)", document.read_text())
                            if not link.startswith(("http:", "https:")) and not leads_somewhere(link, document)]


def cells(line):
    """The cells of a row of a table; an escaped bar is no border."""
    return [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line.strip().strip("|"))]


def lines_of(place):
    """The lines of a document, or of DOCUMENT#HEADING, its section with a heading of the second level."""
    document, _, heading = place.partition("#")
    text = (FIGURES / document).read_text()
    if heading:
        text = text.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]
    return text.splitlines()


def holds(figure, place, beginning):
    """Whether a row of a place that begins so has the figure as one of its cells or words."""
    rows = (line.lstrip("| ") for line in lines_of(place))
    return any(row.startswith(beginning) and figure in re.split(r"[\s|,;]+", row) for row in rows)


def paper():
    """The number of rows of the table "Figures of other documents", and those that do not agree.

    Each row has what it is, the paper's figure, ours, the place of ours, and the beginning of the row there.
    """
    section = (FIGURES / "paper.md").read_text().split("## Figures of other documents", 1)[1].split("\n## ", 1)[0]
    rows = [cells(line) for line in section.splitlines() if line.startswith("|")][2:]
    return len(rows), [f'docs/figures/paper.md: {row[0]}: {row[3]} has no row "{row[4]}" with {row[2]}' for row in rows
                       if not holds(*row[2:5])]


def main():
    checked, wrong = {"links": links, "paper": paper}[sys.argv[1]]()
    print("\n".join(wrong) or f"{checked} checked")
    return 1 if wrong or not checked else 0


if __name__ == "__main__":
    sys.exit(main())
