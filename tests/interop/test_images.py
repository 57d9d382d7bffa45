"""astropy and CASA read our FITS images, and the dirty image of real data is a direct sum."""
import os
import warnings

import numpy as np
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
    # centroid of the restored source
    box = image[row - 6 : row + 7, col - 6 : col + 7].clip(0.3)
    box = box - box.min()
    y, x = np.mgrid[row - 6 : row + 7, col - 6 : col + 7]
    ra, dec = w.all_pix2world((box * x).sum() / box.sum(), (box * y).sum() / box.sum(), 0)
    assert abs((ra - 202.9) * np.cos(np.radians(dec))) * 3600 < 1.0 and abs(dec - 30.6) * 3600 < 1.0


def test_the_dirty_image_of_m87_is_a_direct_sum(cittert, shared):
    path = os.path.join(shared, "data", "visibilities", "eht_m87_2017_096_lo.uvfits")
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
    # Stokes I from the parallel hands, weighted as independent estimates of it; a file of Stokes I as it is.
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
