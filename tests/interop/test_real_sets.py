"""Real visibility sets, read by cittert and by pyuvdata: rows, sites, antenna positions, flags and weights agree.

The sets lie in the folder `visibilities` of CITTERT_DATA.
"""
import os
import warnings

import numpy as np
import pytest
from pyuvdata import UVData

FILES = ["eht_m87_2017_096_lo.uvfits", "eht_m87_2017_100_lo.uvfits", "hera_zen.2458432.34569.uvh5", "paper_redundant.uvfits", "pyuvsim_ref_1.1_uniform.uvfits"]
UVFITS = ["eht_m87_2017_100_lo.uvfits", "paper_redundant.uvfits", "pyuvsim_ref_1.1_uniform.uvfits"]


def real(name):
    return os.path.join(os.environ["CITTERT_DATA"], "visibilities", name)


def read(path):
    uv = UVData()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        uv.read(path, run_check=False)
    return uv


@pytest.mark.parametrize("name", FILES)
def test_rows_sites_and_positions_agree_with_pyuvdata(cittert, name):
    """cittert reads the set and writes UVH5; pyuvdata reads the original and the copy."""
    # With a compression the file is written anew. Otherwise UVH5 would be copied.
    cittert("convert", real(name), "copy.uvh5", "--compression", "none")
    theirs, ours = read(real(name)), read(cittert.path("copy.uvh5"))
    a, b = theirs.telescope.location, ours.telescope.location
    assert abs(a.lat.rad - b.lat.rad) < 1e-10 and abs(a.lon.rad - b.lon.rad) < 1e-10
    assert np.abs(theirs.telescope.get_enu_antpos() - ours.telescope.get_enu_antpos()).max() < 1e-4
    assert (theirs.ant_1_array == ours.ant_1_array).all() and (theirs.ant_2_array == ours.ant_2_array).all()
    assert np.abs(theirs.time_array - ours.time_array).max() * 86400 < 1e-3
    np.testing.assert_allclose(ours.uvw_array, theirs.uvw_array, rtol=1e-7, atol=1e-7 * np.abs(theirs.uvw_array).max())
    order = [list(ours.polarization_array).index(p) for p in theirs.polarization_array]
    np.testing.assert_allclose(ours.data_array[..., order], theirs.data_array, rtol=1e-6)
    np.testing.assert_allclose(ours.nsample_array[..., order], theirs.nsample_array, rtol=1e-6)
    assert (ours.flag_array[..., order] == theirs.flag_array).all()


@pytest.mark.parametrize("name", UVFITS)
def test_an_export_to_uvfits_reads_back_equal(cittert, name):
    cittert("convert", real(name), "copy.uvh5")
    cittert("convert", "copy.uvh5", "copy.uvfits")
    theirs, ours = read(real(name)), read(cittert.path("copy.uvfits"))
    # Stokes I is written as two equal hands.
    order = [list(ours.polarization_array).index(p if p in ours.polarization_array else -1) for p in theirs.polarization_array]
    assert (ours.data_array[..., order] == theirs.data_array).all() or np.isnan(theirs.data_array).any()
    assert (ours.flag_array[..., order] == theirs.flag_array).all()


def test_weights_that_are_not_finite_are_counted(cittert):
    assert cittert.json("info", real("eht_m87_2017_096_lo.uvfits"))["n_not_finite"] == 6514 * 2


def test_a_hera_file_with_integer_visibilities_is_read(cittert):
    cittert("convert", real("hera_zen.2458432.34569.uvh5"), "hera.uvh5", "--compression", "none")
    uv = read(cittert.path("hera.uvh5"))
    told = cittert.json("info", "hera.uvh5")
    assert (told["telescope"], told["n_antennas"], told["n_blts"], told["phase_centers"][0]["kind"]) == ("HERA", 6, 80, "unprojected")
    assert (uv.data_array.real % 1 == 0).all() and (uv.data_array.imag % 1 == 0).all() and np.abs(uv.data_array).max() > 1
