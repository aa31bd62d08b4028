"""Mistyped names of grids, values of arguments and options are answered with the nearest ones."""
import pytest

import esvr
from esvr.images import image2vdb


def test_a_name_that_no_grid_has(volume):
    file = esvr.convert([volume], preset="draft", device="cpu")
    with pytest.raises(KeyError, match="there is no grid 'densty'; there are: density; did you mean 'density'\\?"):
        file["densty"]
    with pytest.raises(KeyError) as refused:
        file["velocity"]
    assert "did you mean" not in str(refused.value)


@pytest.mark.parametrize("words, meant", [
    ({"preset": "drfat"}, "draft"), ({"representation": "elipsoids"}, "ellipsoids"), ({"device": "cdua"}, "cuda"),
    ({"storage": "Compact"}, "compact")])
def test_a_word_that_an_argument_does_not_take(volume, words, meant):
    with pytest.raises(esvr.UsageError, match=f"; did you mean {meant}\\?"):
        esvr.fit(volume, **words)
    with pytest.raises(esvr.UsageError, match="; did you mean double\\?"):
        esvr.GridBuilder("duoble")


@pytest.mark.parametrize("words, meant", [
    (["--datset", "t"], "--dataset"), (["a.nii", "b.vdb", "--thresold=3"], "--threshold"), (["--endian", "litle"], "little"),
    (["--colour", "red"], None)])
def test_an_option_that_a_program_does_not_have(words, meant):
    with pytest.raises(esvr.UsageError) as refused:
        image2vdb.PARSER.parse(words)
    assert str(refused.value).endswith(f"; did you mean {meant}?") if meant else "did you mean" not in str(refused.value)
