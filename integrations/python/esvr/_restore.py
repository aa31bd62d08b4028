"""What pickle calls to make objects again: functions of Python, because pickle cannot name those of the module."""
from . import _core


def volume_from(state):
    return _core._volume_from(state)


def packed_grid_from(state):
    return _core._packed_grid_from(state)


def grid_from(state):
    return _core._grid_from(state)


def file_from(state):
    return _core._file_from(state)


def metrics_from(state):
    return _core._metrics_from(state)


def ellipsoids_from(state):
    return _core._ellipsoids_from(state)
