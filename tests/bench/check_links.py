#!/usr/bin/env python3
"""Checks the links of all documents: each leads to a file of the project, and to a heading that the file has.

Exits with 1, and names each link that leads nowhere.
"""
import functools
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDERS = ("docs", "samples", "integrations", "findings")


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


def main():
    documents = [*ROOT.glob("*.md"), *(d for folder in FOLDERS for d in (ROOT / folder).rglob("*.md"))]
    wrong = [f"{document.relative_to(ROOT)}: {link}" for document in sorted(documents)
             for link in re.findall(r"\]\(\s*([^)\s]+)\s*\)", document.read_text())
             if not link.startswith(("http:", "https:")) and not leads_somewhere(link, document)]
    print("\n".join(wrong) or f"all links of {len(documents)} documents lead somewhere")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
