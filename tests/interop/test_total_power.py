"""Sets with a pattern, autocorrelations and noise weights open in pyuvdata, CASA and WSClean without a warning, and say the same in all of them."""
import subprocess
import warnings

import numpy as np
import pytest
from astropy.io import fits
from pyuvdata import UVData

C = 299792458.0
K_B = 1.380649e-23
JY_PER_KSR = lambda f: 2 * K_B * (f / C) ** 2 / 1e-26  # noqa: E731


@pytest.fixture
def power(cittert):
    """A uniform 300 K through Gaussian elements of 9 degrees, and its files."""
    image = np.full((1, 1, 64, 64), 300.0, np.float32)
    h = fits.Header()
    d = np.degrees(6e-3)
    for k, v in dict(CTYPE1="RA---SIN", CRPIX1=33, CRVAL1=0.0, CDELT1=d, CUNIT1="deg", CTYPE2="DEC--SIN", CRPIX2=33, CRVAL2=0.0, CDELT2=d, CUNIT2="deg", BUNIT="K").items():
        h[k] = v
    fits.writeto(cittert.path("s.fits"), image, h)
    cittert("simulate", "--layout", "mm-ring", "--scene", "s.fits", "--element", "gaussian", "--element-width", "9deg", "--freq", "94GHz", "--bandwidth", "8GHz",
            "--channels", 2, "--tsys", "600K", "--autos", "--scene-noise", "--integration", "1s", "-o", "p.uvh5")  # fmt: skip
    cittert("convert", "p.uvh5", "p.uvfits")
    cittert("convert", "p.uvh5", "p.ms")
    return cittert


def read(path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        uv = UVData()
        uv.read(path)
        uv.check()
    return uv


def test_pyuvdata_finds_the_zero_spacing_and_the_receivers(power):
    uv = read(power.path("p.uvh5"))
    auto = uv.ant_1_array == uv.ant_2_array
    assert auto.sum() == uv.Nants_data
    seen = uv.data_array[auto][:, :, 0]
    assert np.abs(seen.imag).max() == 0 and seen.real.min() > 0
    for name in ("p.uvfits", "p.ms"):
        other = read(power.path(name))
        auto = other.ant_1_array == other.ant_2_array
        ksr = other.data_array[auto][:, :, 0].real / JY_PER_KSR(other.freq_array)[None]
        assert np.allclose(ksr.mean(axis=0), seen.real.mean(axis=0), rtol=1e-5), name


def test_the_receivers_are_kept_by_every_format(power):
    for name in ("p.uvh5", "p.uvfits", "p.ms"):
        found = power.json("dirty", name, "-o", "d.fits", "--overwrite", "--size", 192, "--cell", "2mrad")["mean"]
        assert found["known"] and found["n_autocorrelations_used"] > 0, name


def test_casa_and_wsclean_image_such_a_set(power):
    from casatasks import tclean

    out = power.path("w")
    made = subprocess.run(["wsclean", "-size", "64", "64", "-scale", "6e-3rad", "-niter", "0", "-name", out, power.path("p.ms")], capture_output=True, text=True)
    assert made.returncode == 0 and "arning" not in made.stdout + made.stderr, made.stdout + made.stderr
    assert np.isfinite(fits.getdata(out + "-dirty.fits")).all()
    tclean(vis=power.path("p.ms"), imagename=power.path("c"), imsize=64, cell="%.4farcsec" % (np.degrees(6e-3) * 3600), niter=0, pblimit=-1, stokes="I")
