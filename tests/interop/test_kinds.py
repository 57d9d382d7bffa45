"""For files of the kinds that observatories write, `info` agrees with pyuvdata, and pyuvdata reads equal data from exports to every format."""
import os

import numpy as np
import pytest
from kinds import KINDS, make
from test_info import assert_info_agrees
from test_round_trips import assert_equal_sets, phase_if_drifting, read, where


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Each file is made once."""
    made = {}

    def get(kind):
        if kind not in made:
            folder = tmp_path_factory.mktemp(kind.__name__)
            made[kind] = str(folder / kind(str(folder)))
        return made[kind]

    return get


@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.__name__)
def test_info_agrees_with_pyuvdata(cittert, files, kind):
    path = files(kind)
    assert_info_agrees(cittert.json("info", path), read(path))


@pytest.mark.parametrize("form", ["uvh5", "uvfits", "ms"])
@pytest.mark.parametrize("kind", KINDS, ids=lambda k: k.__name__)
def test_exports_are_read_back_as_equal(cittert, files, kind, form):
    path, out = files(kind), cittert.path(f"out.{form}")
    cittert("convert", path, out)
    theirs, ours = read(path), read(out)
    phase_if_drifting(theirs, ours, form)
    assert_equal_sets(theirs, ours, f"{kind.__name__} as {form}")
    places = [where(uv) for uv in (theirs, ours)]
    names = set(map(str, ours.telescope.antenna_names)) & set(places[0])
    assert len(names) >= theirs.Nants_data
    for name in names:
        assert np.abs(places[0][name] - places[1][name]).max() < 1e-4, name


def test_a_polarisation_for_each_window_is_refused_by_name(cittert):
    uv = make("VLA", freqs=1.4e9 + 1e6 * np.arange(4), spw=[0, 0, 1, 1], pols=("xx", "yy"))
    uv.convert_to_flex_pol()
    uv.write_uvh5(cittert.path("flex.uvh5"))
    said = cittert("convert", "flex.uvh5", "y.uvfits", ok=False)
    assert said.returncode == 1 and "flex.uvh5" in said.stderr and "flex_spw_polarization_array" in said.stderr
    assert not os.path.exists(cittert.path("y.uvfits"))
