"""CASA corrects images of cittert's Measurement Sets for the pattern of the elements as cittert does, for the patterns that it knows.

The Airy pattern has no blocked centre: CASA takes the Bessel function of the blockage at x D / d instead of x d / D, and is 2 % off with one.
WSClean knows the beams of telescopes, and neither a Gaussian nor an Airy pattern of a stated size.
"""
import numpy as np
import pytest
from astropy.io import fits

SIZE, CELL_ARCSEC = 240, 15.0
WIDTH_DEG, DIAMETER_M = 0.45, 25.0


def layout(pattern):
    """A spiral of 27 antennas at the site of the VLA, under its name, whose patterns CASA then takes from its table."""
    k = np.arange(27)
    east, north = [(600 * np.sqrt((k + 1) / 27) * f(2.4 * k)).tolist() for f in (np.cos, np.sin)]
    antennas = "".join(
        f'[[antenna]]\nname = "A{i:02d}"\nposition_m = [{east[i]!r}, {north[i]!r}, 0.0]\ndiameter_m = 25.0\n'
        for i in k.tolist()
    )
    site = "[site]\nlatitude_deg = 34.078813\nlongitude_deg = -107.618334\naltitude_m = 2114.89\n"
    return f'name = "VLA"\nframe = "enu"\n{site}{antennas}[pattern]\n{pattern}\n'


def casa_pattern(path, kind):
    """The table of CASA's pattern."""
    from casatools import vpmanager

    vp = vpmanager()
    vp.reset()
    if kind == "gaussian":
        # The half width is that of the power, at a frequency from which it scales.
        vp.setpbgauss(telescope="VLA", halfwidth=f"{WIDTH_DEG}deg", maxrad="3deg", reffreq="1.4GHz", dopb=True)
    else:
        vp.setpbairy(telescope="VLA", dishdiam=f"{DIAMETER_M}m", blockagediam="0m", maxrad="3deg", reffreq="1.4GHz", dopb=True)
    vp.saveastable(path)


def casa_images(cittert, table):
    """CASA's pattern and its corrected dirty image [m, l]."""
    from casatasks import tclean
    from casatools import image

    tclean(vis=cittert.path("v.ms"), imagename=cittert.path("casa"), niter=0, imsize=SIZE, cell=f"{CELL_ARCSEC}arcsec", weighting="natural",
           vptable=table, pblimit=0.2, pbcor=True, specmode="mfs", gridder="standard")  # fmt: skip
    out = []
    for name in ("pb", "image.pbcor"):
        im = image()
        im.open(f"{cittert.path('casa')}.{name}")
        out.append(im.getchunk()[:, :, 0, 0].T)
        im.close()
    return out


PATTERNS = {
    "gaussian": f'kind = "gaussian"\nfwhm_deg = {WIDTH_DEG}\nref_freq_ghz = 1.4',
    "airy": f'kind = "airy"\ndiameter_m = {DIAMETER_M}',
}


@pytest.mark.parametrize("kind", list(PATTERNS))
def test_casa_corrects_for_the_pattern_as_cittert_does(cittert, kind):
    (cittert.folder / "layout.toml").write_text(layout(PATTERNS[kind]))
    # Sources up to the half-power radius.
    places = [(0.0, 0.0), (0.0018, 0.0009), (-0.0012, 0.0024), (0.0026, -0.0018)]
    (cittert.folder / "s.csv").write_text("l_rad,m_rad,flux_jy\n" + "".join(f"{a},{b},1\n" for a, b in places))
    cittert("simulate", "--layout", "layout.toml", "--scene", "s.csv", "--freq", "1.4GHz", "--bandwidth", "10MHz", "--phase-center",
            "13h31m08s,+30d30m33s", "--hour-angle", "-1h,1h", "--integration", "10min", "--pols", "XX,YY", "-o", "v.uvh5")  # fmt: skip
    cittert("convert", "v.uvh5", "v.ms")
    cittert("dirty", "v.uvh5", "--size", SIZE, "--cell", f"{CELL_ARCSEC}arcsec", "--weighting", "natural", "--pbcor", "-o", "d.fits")
    ours = fits.getdata(cittert.path("d.fits"))[0, 0]
    casa_pattern(cittert.path("vp.tab"), kind)
    pattern, theirs = casa_images(cittert, cittert.path("vp.tab"))
    inside = (pattern > 0.5) & np.isfinite(ours)
    assert inside.sum() > 5000
    worst = np.abs(ours - theirs)[inside].max()
    print(kind, "largest difference inside the half-power field", worst, "of a peak of", ours[inside].max())
    assert worst < 0.01 * ours[inside].max()
