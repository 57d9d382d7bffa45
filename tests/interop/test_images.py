"""astropy reads cittert's FITS images. Dirty images and beams equal direct sums over the whole image with its edges, and equal WSClean's.

With CITTERT_BIG=1 the tests image the common workloads a, b and c in $CITTERT_WL as well as the small sets that they make themselves.
This takes minutes instead of seconds."""
import os
import subprocess
import warnings

import ducc0
import numpy as np
import pytest
from astropy.io import fits
from astropy.wcs import WCS
from pyuvdata import UVData

C = 299792458.0


def test_a_source_is_where_the_header_says(cittert):
    with open(cittert.path("s.csv"), "w") as f:
        f.write("ra_deg,dec_deg,flux_jy\n202.9,30.6,1.0\n")
    track = ["--phase-center", "202.7845deg,30.5092deg", "--start", "2025-06-01T01:30:00", "--duration", "20min", "--integration", "60s"]
    cittert("simulate", "--layout", "vla-d", "--scene", "s.csv", "--freq", "1.4GHz", "--bandwidth", "10MHz", "--method", "dft", *track, "-o", "v.uvh5")
    cittert("clean", "v.uvh5", "--size", 256, "--cell", "10arcsec", "--niter", 500, "-o", "c")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hdu = fits.open(cittert.path("c-image.fits"), checksum=True)[0]
        hdu.verify("exception")
        w = WCS(hdu.header).celestial
    image = hdu.data[0, 0]
    row, col = np.unravel_index(np.argmax(image), image.shape)
    # The centroid of the restored source.
    box = image[row - 6 : row + 7, col - 6 : col + 7].clip(0.3)
    box = box - box.min()
    y, x = np.mgrid[row - 6 : row + 7, col - 6 : col + 7]
    ra, dec = w.all_pix2world((box * x).sum() / box.sum(), (box * y).sum() / box.sum(), 0)
    assert abs((ra - 202.9) * np.cos(np.radians(dec))) * 3600 < 1.0 and abs(dec - 30.6) * 3600 < 1.0


def test_the_dirty_image_of_m87_is_a_direct_sum(cittert, visibilities):
    path = os.path.join(visibilities, "eht_m87_2017_096_lo.uvfits")
    n, cell = 64, np.radians(4e-6 / 3600)
    cittert("dirty", path, "--size", n, "--cell", "4uas", "--weighting", "natural", "-o", "d.fits")
    ours = fits.getdata(cittert.path("d.fits"))[0, 0]
    uv = UVData()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        uv.read(path, run_check=False)
    weight = np.where(uv.flag_array | ~np.isfinite(uv.nsample_array), 0, uv.nsample_array).astype(float)
    data = np.where(weight > 0, uv.data_array, 0)
    names = list(uv.polarization_array)
    # Each parallel hand is an independent estimate of Stokes I with its own weight. A file of Stokes I is used as it is.
    hands = [names.index(p) for p in (1, -1, -2) if p in names]
    l = -(np.arange(n) - n // 2) * cell
    m = (np.arange(n) - n // 2) * cell
    total, norm = np.zeros((n, n)), 0.0
    for p in hands:
        for c, f in enumerate(uv.freq_array.ravel()):
            w = weight[:, c, p]
            u, v, _ = (uv.uvw_array * f / C).T
            eu = np.exp(-2j * np.pi * np.outer(u, l))
            ev = np.exp(-2j * np.pi * np.outer(v, m)) * (w * data[:, c, p])[:, None]
            total += (ev.T @ eu).real
            norm += w.sum()
    want = total / norm
    assert np.abs(ours - want).max() < 1e-4 * np.abs(want).max()


ARCSEC = np.pi / 180 / 3600
# Name: how it is made, pixels along a side, size of one. `wide` needs many planes of w,.
SMALL = {
    "narrow": ("vla-d --freq 1.4GHz --bandwidth 50MHz --channels 24", 300, 8 * ARCSEC),
    "wide": ("vla-d --freq 300MHz --bandwidth 4MHz --channels 4", 360, 60 * ARCSEC),
    "odd": ("vla-c --freq 5GHz --bandwidth 200MHz --channels 8", 250, 1.2 * ARCSEC),
}
BIG = {"a": (512, 0.25 * ARCSEC), "b": (2048, 0.25 * ARCSEC), "c": (512, 6.0e-4)} if os.environ.get("CITTERT_BIG") else {}


@pytest.fixture(scope="module", params=[*SMALL, *BIG])
def observed(request, tmp_path_factory):
    """A program in a folder with a set v, the number of pixels along a side of its image, and the size of a pixel in rad."""
    from conftest import Program

    program = Program(tmp_path_factory.mktemp("observed"))
    if request.param in BIG:
        n, cell = BIG[request.param]
        for kind in ("uvh5", "ms"):
            os.symlink(os.path.join(os.environ["CITTERT_WL"], f"{request.param}.{kind}"), program.path(f"v.{kind}"))
        return program, n, cell
    words, n, cell = SMALL[request.param]
    edge = 0.49 * n * cell
    with open(program.path("s.csv"), "w") as f:
        f.write(f"l_rad,m_rad,flux_jy\n{0.3 * edge},{0.2 * edge},1\n{-0.99 * edge},{0.98 * edge},0.7\n{edge},{-0.5 * edge},0.5\n")
    layout, *band = words.split()
    track = ["--phase-center", "202.7845deg,30.5092deg", "--start", "2025-06-01T01:30:00", "--duration", "100min", "--integration", "200s"]
    program("simulate", "--layout", layout, "--scene", "s.csv", *band, *track, "--method", "dft", "--sefd", "400Jy", "--pols", "RR,LL", "-o", "v.uvh5")
    program("convert", "v.uvh5", "v.ms")
    return program, n, cell


def read(path):
    """uvw, frequencies, Stokes I and its weights."""
    uv = UVData()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        uv.read(path, run_check=False)
    good = ~uv.flag_array.any(axis=2)
    return uv.uvw_array, uv.freq_array.ravel(), np.where(good, uv.data_array.mean(axis=2), 0).astype(complex), good.astype(float)


def exact(n, cell, uvw, freq, vis):
    """The direct sum at all pixels, to 1e-12. Rows are m; l decreases with the column."""
    d = ducc0.wgridder.vis2dirty(uvw=uvw, freq=freq, vis=vis, npix_x=n + 2, npix_y=n, pixsize_x=cell, pixsize_y=cell, epsilon=1e-12,
                                 flip_u=True, flip_v=True, flip_w=False, do_wgridding=True, divide_by_n=False, nthreads=2)
    return np.array([d[n + 1 - c] for c in range(n)]).T


def image(path):
    """The image in flux per beam, also where the unit of the file is kelvin."""
    with fits.open(path) as f:
        plane, h = f[0].data.squeeze().astype(float), f[0].header
    if h["BUNIT"].strip() == "K":
        plane *= np.pi * np.radians(h["BMAJ"]) * np.radians(h["BMIN"]) / (4 * np.log(2))
    return plane


def test_natural_images_and_beams_are_direct_sums(observed):
    cittert, n, cell = observed
    uvw, freq, vis, weight = read(cittert.path("v.uvh5"))
    words = ["--size", n, "--cell", f"{cell!r}rad", "--weighting", "natural", "--unit-weights"]
    cittert("dirty", "v.uvh5", *words, "-o", "d.fits")
    cittert("beam", "v.uvh5", *words, "-o", "p.fits")
    total = weight.sum()
    for name, data in (("d.fits", vis * weight), ("p.fits", weight.astype(complex))):
        want = exact(n, cell, uvw, freq, data) / total
        # The reference itself is compared with the plain sum at the corners and at some other pixels.
        rng = np.random.default_rng(0)
        for r, c in [(0, 0), (0, n - 1), (n - 1, 0), (n - 1, n - 1), *rng.integers(0, n, (4, 2))]:
            l, m = -(c - n // 2) * cell, (r - n // 2) * cell
            path_m = uvw @ np.array([l, m, np.sqrt(1 - l * l - m * m) - 1])
            direct = sum((data[:, k] * np.exp(-2j * np.pi * path_m * f / C)).real.sum() for k, f in enumerate(freq)) / total
            assert abs(direct - want[r, c]) < 1e-9 * np.abs(want).max()
        got = image(cittert.path(name))
        assert np.abs(got - want).max() < 1e-5 * np.abs(want).max(), name


@pytest.mark.parametrize("weighting", ["natural", "uniform", "briggs 0"])
def test_images_are_those_of_wsclean_in_its_exact_mode(observed, weighting):
    cittert, n, cell = observed
    scheme, *robust = weighting.split()
    words = ["--size", n, "--cell", f"{cell!r}rad", "--weighting", scheme, *(["--robust", robust[0]] if robust else [])]
    cittert("dirty", "v.uvh5", *words, "-o", "d.fits", "--overwrite")
    exactly = "-use-wgridder -wgridder-accuracy 1e-6 -padding 2 -no-small-inversion -no-update-model-required -niter 0 -pol I -j 2 -name ws".split()
    peer = ["wsclean", *exactly, "-size", str(n), str(n), "-scale", f"{cell / ARCSEC:.12f}asec", "-weight", *weighting.split(), "v.ms"]
    subprocess.run(peer, cwd=cittert.folder, check=True, capture_output=True)
    ours, theirs = image(cittert.path("d.fits")), fits.getdata(cittert.path("ws-dirty.fits")).squeeze().astype(float)
    assert np.abs(ours - theirs).max() < 1e-4 * np.abs(theirs).max()
