"""`info --json` agrees with pyuvdata in every field, on real files."""
import os
import warnings

import numpy as np
import pytest
from pyuvdata import UVData
from pyuvdata.utils import polnum2str

FILES = ["eht_m87_2017_096_lo.uvfits", "eht_m87_2017_100_lo.uvfits", "hera_zen.2458432.34569.uvh5", "paper_redundant.uvfits", "pyuvsim_ref_1.1_uniform.uvfits"]


@pytest.mark.parametrize("name", FILES)
def test_info_agrees_with_pyuvdata(cittert, visibilities, name):
    path = os.path.join(visibilities, name)
    uv = UVData()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        uv.read(path, run_check=False)
    assert_info_agrees(cittert.json("info", path), uv)


def assert_info_agrees(ours, uv):
    """Every field that `info` and pyuvdata share."""
    assert ours["telescope"] == uv.telescope.name
    assert ours["n_blts"] == uv.Nblts
    assert ours["n_bls"] == uv.Nbls
    assert ours["n_times"] == uv.Ntimes
    assert ours["n_freqs"] == uv.Nfreqs
    assert ours["n_pols"] == uv.Npols
    assert ours["n_antennas"] == len(ours["antenna_names"])
    assert sorted(ours["antenna_names"]) == sorted(map(str, uv.telescope.antenna_names))
    np.testing.assert_allclose(ours["freq_hz"], uv.freq_array.ravel(), rtol=1e-12)
    np.testing.assert_allclose(np.broadcast_to(ours["channel_width_hz"], uv.Nfreqs), np.abs(np.ravel(uv.channel_width)), rtol=1e-6)
    np.testing.assert_allclose(ours["integration_s"], uv.integration_time.mean(), rtol=1e-6)
    assert ours["unit"].lower() == (uv.vis_units.lower() if uv.vis_units.lower() in ("jy", "k str") else "uncalib")
    assert len(ours["phase_centers"]) == len(uv.phase_center_catalog)
    for ours_of, theirs_of in zip(sorted(ours["phase_centers"], key=lambda c: c["name"]), sorted(uv.phase_center_catalog.values(), key=lambda c: c["cat_name"])):
        assert (ours_of["name"], ours_of["kind"]) == (theirs_of["cat_name"], theirs_of["cat_type"])
        if ours_of["kind"] == "sidereal":
            assert ours_of["frame"] == theirs_of["cat_frame"]
            assert abs(ours_of["ra_rad"] - theirs_of["cat_lon"]) < 1e-9 and abs(ours_of["dec_rad"] - theirs_of["cat_lat"]) < 1e-9
    names = [{"pI": "I", "pQ": "Q", "pU": "U", "pV": "V"}.get(p, p.upper()) for p in map(polnum2str, uv.polarization_array)]
    names = [{"EE": "XX", "NN": "YY", "EN": "XY", "NE": "YX"}.get(n, n) for n in names]
    assert ours["polarizations"] == names
    flags = uv.flag_array | ~np.isfinite(uv.data_array)
    assert abs(ours["flagged_fraction"] - flags.mean()) < 1e-9
    for i, p in enumerate(names):
        good = ~flags[..., i]
        assert ours["n_unflagged"][p] == good.sum()
        if good.any():
            mean = np.abs(uv.data_array[..., i][good].astype(complex)).mean()
            assert abs(ours["mean_abs_unflagged"][p] - mean) <= 1e-6 * mean
