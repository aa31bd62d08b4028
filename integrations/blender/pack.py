#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the file that Blender installs: pack.py OUT.zip. The same sources give the same bytes."""
import pathlib
import sys
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
NAME = "esvr_blender"
FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # of the ZIP format
FILE_MODE = 0o100644


def content():
    """The files by their names in the archive. Blender's old installer needs a folder; extensions may have one."""
    yield f"{NAME}/LICENSE", HERE / "LICENSE"
    for path in sorted((HERE / NAME).iterdir()):
        if path.suffix in (".py", ".toml"):
            yield f"{NAME}/{path.name}", path


def main():
    with zipfile.ZipFile(sys.argv[1], "w", zipfile.ZIP_STORED) as archive:  # versions of zlib compress differently
        for name, path in content():
            entry = zipfile.ZipInfo(name, FIRST_DATE)
            entry.external_attr = FILE_MODE << 16
            entry.create_system = 3  # Unix, whatever runs this script
            archive.writestr(entry, path.read_bytes())


main()
