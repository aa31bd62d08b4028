# SPDX-License-Identifier: GPL-3.0-or-later
"""Where volumes come from: an .esvr file, or numbered files that a pattern such as smoke.####.esvr names.

This module does not use bpy.
"""
import os
import re
from dataclasses import dataclass

EXTENSION = ".esvr"
NUMBERED = re.compile(r"^(?P<head>.*?)(?P<digits>\d+)(?P<tail>\D*)$")
PATTERN = re.compile(r"^(?P<head>.*?)(?P<places>#+|@+)(?P<tail>[^#@]*)$")
PLACES_OF_ONE_HASH = 4  # as in the programs and in fileseq


class SourceError(Exception):
    """The source cannot be used. The text is for the user."""


@dataclass(frozen=True)
class Source:
    """`text` is an absolute path: that of a file, or one whose last name is a pattern."""
    text: str

    @property
    def is_numbered(self):
        """True for a pattern. A file that exists under its very name is no pattern, as for the programs."""
        return not os.path.isfile(self.text) and PATTERN.match(os.path.basename(self.text)) is not None

    @property
    def stem(self):
        """The name without the extension and without the number."""
        name = os.path.basename(self.text)
        match = PATTERN.match(name) if self.is_numbered else None
        return match["head"].rstrip("._-") if match else os.path.splitext(name)[0]

    def numbered_files(self):
        """The paths of the files that belong to the pattern, by their numbers."""
        return self._listing()[0]

    def hint(self, frames=None):
        """Says which files look like frames, are none, and are left out; empty if there are none."""
        others = [entry for number, entry in self._listing()[1] if within(number, frames)] if self.is_numbered else []
        if not others:
            return ""
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        return (f"{os.path.basename(self.text)}: {min(others)}{more} looked like a frame and was left out: it has another "
                "number of digits, a negative number, which Blender does not show, or one with a fraction")

    def _listing(self):
        """The files of the pattern by their numbers, and (number, name) of those that look like them."""
        folder, name = os.path.split(self.text)
        match = PATTERN.match(name)
        width = width_of(match["places"])
        found, others = {}, []
        for entry in os.listdir(folder) if os.path.isdir(folder) else []:
            digits = entry[len(match["head"]):len(entry) - len(match["tail"])]
            if entry != match["head"] + digits + match["tail"] or not re.fullmatch(r"-?[0-9]+(\.[0-9]+)?", digits):
                continue
            if re.fullmatch("[0-9]+", digits) and digits == str(int(digits)).zfill(width):
                found[int(digits)] = os.path.join(folder, entry)
            else:
                others.append((float(digits), entry))
        return found, others

    def files(self, frames=None):
        """All paths by their numbers; {None: path} for a single file. `frames` is (first, last) or None.

        Raises SourceError if there is no file.
        """
        if not self.is_numbered:
            if not os.path.isfile(self.text):
                raise SourceError(f"{self.text}: there is no such file")
            return {None: self.text}
        found = {n: path for n, path in sorted(self.numbered_files().items()) if within(n, frames)}
        if not found:
            raise SourceError(f"{self.text}: there is no such file{in_frames(frames)}")
        return found


def width_of(places):
    """The number of digits that a pattern has at least."""
    if places[0] == "@":
        return len(places)
    return PLACES_OF_ONE_HASH if len(places) == 1 else len(places)


def within(number, frames):
    return frames is None or frames[0] <= number <= frames[1]


def gaps_in(frames):
    """The first and the last of the missing frames between increasing numbers, for each gap."""
    return [(before + 1, after - 1) for before, after in zip(frames, frames[1:]) if after > before + 1]


def text_of_gaps(stem, frames):
    """What the user should know about missing frames; empty if there is no gap."""
    gaps = ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in gaps_in(frames))
    if not gaps:
        return ""
    return (f"{stem}: nothing is shown in the missing frames {gaps}. --missing hold of vdb2esvr and esvr2vdb repeats "
            "the frame before a gap")


def in_frames(frames):
    return f" in the frames {frames[0]} to {frames[1]}" if frames else ""


def numbered(name):
    """A match with the head, the last number and the tail of a name that can become a pattern."""
    match = NUMBERED.match(name)
    return match if match and not set(match["tail"]) & set("#@%$") else None


def places_for(digits):
    """The pattern of the numbers of which `digits` is one of the shortest."""
    return "@" if len(digits) == 1 else "#" * len(digits)


def grouped(paths):
    """Sources of the chosen files, and the range of frames of each; None for a single file.

    Two or more files of one folder whose names differ in their last number only are a sequence.
    """
    groups = {}
    for path in paths:
        folder, name = os.path.split(os.path.abspath(path))
        match = numbered(name)
        key = (folder, match["head"], match["tail"]) if match else (folder, name, None)
        groups.setdefault(key, []).append((match["digits"] if match else "", os.path.join(folder, name)))
    for (folder, head, tail), members in groups.items():
        if len(members) == 1:
            yield Source(members[0][1]), None
            continue
        shortest = min((digits for digits, _ in members), key=len)
        numbers = [int(digits) for digits, _ in members]
        yield Source(os.path.join(folder, head + places_for(shortest) + tail)), (min(numbers), max(numbers))
