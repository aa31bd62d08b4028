#!/usr/bin/env python3
"""Checks docs/figures/paper.md against the documents from which it takes our figures.

Each row of its table "Figures of other documents" names a document, or DOCUMENT#HEADING for one of its sections, and the beginning
of a row. Some row that begins so must have the figure as one of its cells or words. Exits with 1 and names the rows that do not agree.
"""
import pathlib
import re
import sys

DOCS = pathlib.Path(__file__).parents[2] / 'docs/figures'


def cells(line):
    """The cells of a row of a table; an escaped bar is no border."""
    return [cell.strip().replace('\\|', '|') for cell in re.split(r'(?<!\\)\|', line.strip().strip('|'))]


def claims():
    """The rows of the table: what it is, the figure, the place and the beginning of the row."""
    text = (DOCS / 'paper.md').read_text()
    section = text.split('## Figures of other documents', 1)[1].split('\n## ', 1)[0]
    rows = [cells(line) for line in section.splitlines() if line.startswith('|')]
    return [(row[0], row[2], row[3], row[4]) for row in rows[2:]]


def lines_of(place):
    """The lines of a document, or of its section with a heading of the second level."""
    document, _, heading = place.partition('#')
    text = (DOCS / document).read_text()
    if heading:
        text = text.partition(f'\n## {heading}\n')[2].partition('\n## ')[0]
    return text.splitlines()


def holds(figure, place, beginning):
    for line in lines_of(place):
        line = line.lstrip('| ')
        if line.startswith(beginning) and figure in re.split(r'[\s|,;]+', line):
            return True
    return False


def main():
    rows = claims()
    wrong = [row for row in rows if not holds(*row[1:])]
    for what, figure, place, beginning in wrong:
        print(f'docs/figures/paper.md: {what}: {place} has no row "{beginning}" with {figure}')
    if not rows:
        print('docs/figures/paper.md: the table "Figures of other documents" has no row')
    return 1 if wrong or not rows else 0


if __name__ == '__main__':
    sys.exit(main())
