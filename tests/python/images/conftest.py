"""Where the small files lie on which earlier readers failed."""
import os
import pathlib

import pytest


@pytest.fixture
def edge():
    """The folder of small files on which earlier readers failed."""
    folder = pathlib.Path(os.environ.get("ESVR_DATA_DIR", "/nowhere")) / "edge/faults2"
    if not folder.is_dir():
        pytest.skip("ESVR_DATA_DIR has no folder edge/faults2")
    return folder
