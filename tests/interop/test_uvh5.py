"""pyuvdata reads the UVH5 files of cittert without a warning, its consistency checks pass, and the visibilities equal a plain sum."""
import warnings

import numpy as np
import pytest
from pyuvdata import UVData

C = 299792458.0
SOURCES = [(0.012, 0.005, 1.0), (-0.004, 0.009, 0.5)]
TRACK = ["--phase-center", "13h31m08.288s,+30d30m32.96s", "--start", "2025-06-01T01:30:00", "--duration", "20min", "--integration", "60s"]


def write_sources(path, sources):
    with open(path, "w") as f:
        f.write("l_rad,m_rad,flux_jy\n")
        for s in sources:
            f.write("%r,%r,%r\n" % s)


def read(path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        uv = UVData()
        uv.read_uvh5(path)
        uv.check()
    return uv


def plain_sum(uvw, freqs, sources):
    out = np.zeros((len(uvw), len(freqs)), complex)
    for l, m, s in sources:
        phase = uvw @ np.array([l, m, np.sqrt(1 - l * l - m * m) - 1])
        out += s * np.exp(2j * np.pi * phase[:, None] * freqs[None] / C)
    return out


@pytest.mark.parametrize("layout,extra", [("vla-a", TRACK), ("mm-y", [])])
def test_dft_equals_a_plain_sum(cittert, layout, extra):
    write_sources(cittert.path("s.csv"), SOURCES)
    freq = "94GHz" if layout.startswith("mm") else "1.4GHz"
    cittert("simulate", "--layout", layout, "--scene", "s.csv", "--freq", freq, "--bandwidth", "100MHz", "--channels", 3, "--method", "dft", *extra, "-o", "v.uvh5")
    uv = read(cittert.path("v.uvh5"))
    want = plain_sum(uv.uvw_array, uv.freq_array, SOURCES)
    for pol in range(uv.Npols):
        assert np.abs(uv.data_array[:, :, pol] - want).max() < 1e-6 * 1.5


def test_recomputed_uvw_of_a_track_agree(cittert):
    write_sources(cittert.path("s.csv"), SOURCES[:1])
    cittert("simulate", "--layout", "vla-a", "--scene", "s.csv", "--freq", "1.4GHz", "--bandwidth", "1MHz", "--method", "dft", *TRACK, "-o", "v.uvh5")
    uv = read(cittert.path("v.uvh5"))
    ours = uv.uvw_array.copy()
    stored = uv.phase_center_app_ra.copy(), uv.phase_center_app_dec.copy(), uv.phase_center_frame_pa.copy()
    uv._set_app_coords_helper()  # pyuvdata's own apparent place
    for name, a, b in zip(("app_ra", "app_dec", "frame_pa"), stored, (uv.phase_center_app_ra, uv.phase_center_app_dec, uv.phase_center_frame_pa)):
        assert np.abs(a - b).max() < 1e-7, name
    uv.set_uvws_from_antenna_positions(update_vis=False)
    length = np.linalg.norm(ours, axis=1)
    assert (np.linalg.norm(uv.uvw_array - ours, axis=1) < 0.01 + 1e-5 * length).all()


@pytest.mark.parametrize("epsilon", [1e-3, 1e-5, 1e-7])
def test_degridding_keeps_its_accuracy(cittert, epsilon):
    """For an image of sources on pixels, degridding differs from the exact sum by at most epsilon."""
    write_sources(cittert.path("s.csv"), [(30 * 4e-5, -20 * 4e-5, 1.0), (-101 * 4e-5, 77 * 4e-5, 0.5)])
    from astropy.io import fits

    image = np.zeros((1, 1, 512, 512), np.float32)
    image[0, 0, 256 - 20, 256 - 30] = 1.0
    image[0, 0, 256 + 77, 256 + 101] = 0.5
    h = fits.Header()
    d = np.degrees(4e-5)
    for k, v in dict(CTYPE1="RA---SIN", CRPIX1=257, CRVAL1=202.784533, CDELT1=-d, CUNIT1="deg", CTYPE2="DEC--SIN", CRPIX2=257, CRVAL2=30.509156, CDELT2=d, CUNIT2="deg", BUNIT="Jy/pixel").items():
        h[k] = v
    fits.writeto(cittert.path("s.fits"), image, h)
    common = ["--freq", "1.4GHz", "--bandwidth", "64MHz", "--channels", 2, "--layout", "vla-c", *TRACK]
    cittert("simulate", "--scene", "s.fits", "--method", "dft", *common, "-o", "dft.uvh5")
    cittert("simulate", "--scene", "s.fits", "--method", "degrid", "--epsilon", epsilon, *common, "-o", "deg.uvh5")
    a, b = read(cittert.path("dft.uvh5")).data_array, read(cittert.path("deg.uvh5")).data_array
    assert np.linalg.norm(a - b) / np.linalg.norm(a) <= epsilon
