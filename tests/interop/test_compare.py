"""`compare` takes the images of WSClean and of CASA as they are: other sizes, cells and centres, blank borders, other units."""
import subprocess

import numpy as np
import pytest
from astropy.io import fits

CLEAN = ["--weighting", "natural", "--niter", 2000, "--nsigma", 3]


@pytest.fixture
def observed(cittert):
    """Two sources, as UVH5 and as a Measurement Set, with an image of cittert and its beam (arcsec, arcsec, deg)."""
    with open(cittert.path("s.csv"), "w") as f:
        f.write("ra_deg,dec_deg,flux_jy\n202.79,30.51,1.0\n202.75,30.49,0.5\n")
    track = ["--phase-center", "13h31m08s,+30d30m33s", "--start", "2025-06-01T01:30:00", "--duration", "20min", "--integration", "60s"]
    cittert("simulate", "--layout", "vla-d", "--scene", "s.csv", "--freq", "1.4GHz", "--bandwidth", "64MHz", "--noise", *track, "-o", "v.uvh5")
    cittert("convert", "v.uvh5", "v.ms")
    said = cittert.json("clean", "v.uvh5", "--size", 128, "--cell", "10arcsec", *CLEAN, "-o", "same")
    beam = [np.degrees(said[k]) * f for k, f in (("bmaj_rad", 3600), ("bmin_rad", 3600), ("bpa_rad", 1))]
    return cittert, beam


def wsclean(folder, beam):
    """WSClean's image of the set, with exact transforms and the same beam: its own fit of the beam differs by a tenth."""
    exactly = "-use-wgridder -wgridder-accuracy 1e-6 -padding 2 -no-small-inversion -no-update-model-required -pol I -j 2 -quiet".split()
    how = "-size 128 128 -scale 10asec -weight natural -niter 2000 -mgain 0.8 -auto-threshold 3 -name ws".split()
    shape = ["-beam-shape", f"{beam[0]}asec", f"{beam[1]}asec", f"{beam[2]}deg"]
    subprocess.run(["wsclean", *exactly, *how, *shape, "v.ms"], cwd=folder, check=True, capture_output=True)


def test_an_image_of_wsclean_is_compared_in_one_command(observed):
    cittert, beam = observed
    wsclean(cittert.folder, beam)
    # Both CLEANs stop at three times the noise, and leave different residuals there.
    same = cittert.json("compare", "same-image.fits", "ws-image.fits")
    assert same["error_over_grey_card"] < 0.02 and abs(same["peak_ratio"] - 1) < 0.01 and same["n_blank"] == 0, same
    # Another grid, and a border that is blank as outside of a primary beam.
    cittert("clean", "v.uvh5", "--size", 100, "--cell", "12arcsec", *CLEAN, "-o", "other")
    with fits.open(cittert.path("ws-image.fits"), mode="update") as hdus:
        hdus[0].data[..., :8, :] = np.nan
    other = cittert.json("compare", "other-image.fits", "ws-image.fits", "--difference", "d.fits", "--fidelity", "f.fits")
    assert other["error_over_grey_card"] < 0.03 and other["n_blank"] > 0 and other["regridded_from"]["size"] == [128, 128], other
    difference = fits.getdata(cittert.path("d.fits")).astype(float)
    assert np.isnan(difference).sum() == other["n_blank"]
    assert abs(np.sqrt(np.nanmean(difference**2)) / other["rms_difference"] - 1) < 1e-4


def test_a_model_of_wsclean_is_a_truth_in_jansky_per_pixel(observed):
    cittert, beam = observed
    wsclean(cittert.folder, beam)
    found = cittert.json("compare", "same-image.fits", "ws-model.fits", "--convolve")
    assert found["error_over_grey_card"] < 0.02 and abs(found["flux_ratio"] - 1) < 0.02 and found["converted_from"] == "Jy/pixel", found


def test_an_image_of_casa_with_a_blank_border_is_compared(observed):
    from casatasks import exportfits, tclean

    cittert, beam = observed
    tclean(vis=cittert.path("v.ms"), imagename=cittert.path("casa"), imsize=160, cell="8arcsec", niter=2000, specmode="mfs", gridder="wproject",
           wprojplanes=8, deconvolver="hogbom", weighting="natural", stokes="I", pblimit=0.9, nsigma=3.0,
           restoringbeam=[f"{beam[0]}arcsec", f"{beam[1]}arcsec", f"{beam[2]}deg"])  # fmt: skip
    exportfits(cittert.path("casa.image"), cittert.path("casa.fits"))
    assert np.isnan(fits.getdata(cittert.path("casa.fits"))).any()
    found = cittert.json("compare", "same-image.fits", "casa.fits")
    assert found["error_over_grey_card"] < 0.05 and found["n_blank"] > 0 and found["regridded_from"]["size"] == [160, 160], found
