"""Visibilities through element patterns, against pyuvsim: python pyuvsim_patterns.py CITTERT

Six antennas at the equator look at 100 random sources within 25 degrees of the zenith. pyuvsim computes their visibilities through an Airy and a
Gaussian beam, and through Gaussian beams that differ from antenna to antenna. cittert gets the directions that pyuvsim uses, so that the patterns
and the sums are compared, and not the astrometry. The largest difference must be below 1e-6 of the total flux.

Needs: pip install pyuvsim mpi4py mpich psutil
"""

import csv
import subprocess
import sys
import tempfile
from pathlib import Path

import astropy.units as u
import numpy as np
from astropy.coordinates import ICRS, AltAz, EarthLocation, Latitude, Longitude
from astropy.time import Time
from pyradiosky import SkyModel
from pyuvdata import AiryBeam, GaussianBeam, Telescope, UVData
from pyuvsim.simsetup import SkyModelData
from pyuvsim.telescope import BeamList
from pyuvsim.uvsim import run_uvdata_uvsim

CITTERT = str(Path(sys.argv[1]).resolve())
N, SITE = 6, EarthLocation.from_geodetic(lon=0 * u.deg, lat=0 * u.deg, height=0 * u.m)
FREQ, WIDTH = 150e6, 1e6
TIME = Time(2460000.5, format="jd")
RNG = np.random.default_rng(5)
ENU = np.column_stack([RNG.uniform(-60, 60, (N, 2)), np.zeros(N)])


def catalog():
    zenith = 90 - np.degrees(np.arccos(1 - RNG.uniform(0, 1, 100) * (1 - np.cos(np.radians(25)))))
    places = AltAz(alt=zenith * u.deg, az=RNG.uniform(0, 360, 100) * u.deg, obstime=TIME, location=SITE).transform_to(ICRS())
    stokes = np.zeros((4, 1, 100)) * u.Jy
    stokes[0, 0] = RNG.uniform(0.1, 2, 100) * u.Jy
    names = np.array([f"s{k}" for k in range(100)])
    return SkyModel(name=names, ra=Longitude(places.ra), dec=Latitude(places.dec), stokes=stokes, spectral_type="flat", frame="icrs")


def observed(beams):
    """pyuvsim's set of the sources through beams: one for all antennas, or one for each."""
    names = [f"A{k}" for k in range(N)]
    telescope = Telescope.new(
        location=SITE, name="t", antenna_positions=dict(enumerate(ecef(ENU))),
        antenna_names=names, instrument="t", x_orientation="east", mount_type="fixed", feeds=["x", "y"],
    )  # fmt: skip
    uv = UVData.new(
        freq_array=np.array([FREQ]), channel_width=np.array([WIDTH]), polarization_array=np.array([-5, -6, -7, -8]), times=np.array([TIME.jd]),
        antpairs=[(a, b) for a in range(N) for b in range(a + 1, N)], integration_time=1.0, telescope=telescope, do_blt_outer=True, empty=True,
    )  # fmt: skip
    sky = catalog_once
    which = {name: (k if len(beams) > 1 else 0) for k, name in enumerate(names)}
    return run_uvdata_uvsim(uv, BeamList(beams), which, SkyModelData(sky), quiet=True)


def ecef(enu):
    """Positions relative to the site at longitude and latitude 0: up is x, east is y, north is z."""
    return np.column_stack([enu[:, 2], enu[:, 0], enu[:, 1]])


def directions(sky):
    """Direction cosines to the east and to the north, as pyuvsim finds them."""
    sky.update_positions(TIME, SITE)
    alt, az = sky.alt_az
    return np.cos(alt) * np.sin(az), np.cos(alt) * np.cos(az)


def measured(folder, pattern, extra=()):
    """cittert's visibilities of the same baselines, and the widths of the patterns."""
    folder = Path(folder)
    antennas = "".join(f'[[antenna]]\nname = "A{k}"\nposition_m = [{p[0]!r}, {p[1]!r}, 0.0]\n' for k, p in enumerate(ENU.tolist()))
    (folder / "layout.toml").write_text(f'name = "t"\nframe = "boresight"\n{antennas}[pattern]\n{pattern}\n')
    l, m = directions(catalog_once)
    flux = catalog_once.stokes[0, 0].value
    lines = "".join(f"{a!r},{b!r},{s!r}\n" for a, b, s in zip(l.tolist(), m.tolist(), flux.tolist()))
    (folder / "s.csv").write_text("l_rad,m_rad,flux_jy\n" + lines)
    words = ["--layout", "layout.toml", "--scene", "s.csv", "--freq", f"{FREQ}Hz", "--bandwidth", f"{WIDTH}Hz", "--channels", "1"]
    subprocess.run([CITTERT, "simulate", *words, *extra, "-o", "v.uvh5", "--overwrite"], cwd=folder, check=True, capture_output=True)
    uv = UVData.from_file(folder / "v.uvh5", run_check=False)
    return uv


def difference(theirs, ours):
    total = catalog_once.stokes[0, 0].value.sum()
    worst = 0.0
    for a in range(N):
        for b in range(a + 1, N):
            # pyuvsim gives XX = I / 2.
            them = theirs.get_data(a, b, "xx")[0, 0] + theirs.get_data(a, b, "yy")[0, 0]
            us = ours.get_data(a, b)[0, 0]
            worst = max(worst, abs(them - us) / total)
    return worst


catalog_once = catalog()


def main():
    sigma = 0.15
    fwhm = 2 * sigma * np.sqrt(np.log(2))
    with tempfile.TemporaryDirectory() as folder:
        results = {
            "airy": difference(observed([AiryBeam(diameter=9.0)]), measured(folder, 'kind = "airy"\ndiameter_m = 9.0')),
            "gaussian": difference(observed([GaussianBeam(sigma=sigma)]), measured(folder, f'kind = "gaussian"\nfwhm_rad = {float(fwhm)!r}')),
        }
        ours = measured(folder, f'kind = "gaussian"\nfwhm_rad = {float(fwhm)!r}', ["--width-rms", "0.2"])
        with open(Path(folder) / "v-pointing.csv", newline="") as f:
            widths = [float(row["width"]) for row in csv.DictReader(f)]
        assert len(widths) == N and np.std(widths) > 0.05, widths
        results["gaussian, different widths"] = difference(observed([GaussianBeam(sigma=sigma * w) for w in widths]), ours)
        ours = measured(folder, 'kind = "airy"\ndiameter_m = 9.0', ["--width-rms", "0.1"])
        with open(Path(folder) / "v-pointing.csv", newline="") as f:
            widths = [float(row["width"]) for row in csv.DictReader(f)]
        results["airy, different widths"] = difference(observed([AiryBeam(diameter=9.0 / w) for w in widths]), ours)
    for name, worst in results.items():
        print(f"{name:30} {worst:.2e}")
    assert max(results.values()) < 1e-6


main()
