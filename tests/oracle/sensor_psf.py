"""Writes sensor_psf.csv: PSFs of five aberrated pupils from prysm.

python sensor_psf.py > sensor_psf.csv, with numpy and prysm. Each PSF has 40 x 40 samples at a quarter of wavelength over diameter, in units of the
peak of the same pupil without aberrations; row by row, with the optical axis at sample 20. Coefficients are in waves rms, in the order of Noll.
A sample of the pupil is open or closed here: edges that lie along the samples are on their borders, so that the area is right.
"""

import sys

import numpy as np
from prysm.geometry import circle, regular_polygon, rectangle
from prysm.polynomials import noll_to_nm, zernike_nm
from prysm.propagation import Wavefront

N, SAMPLES = 4096, 40
WAVELENGTH_UM = 3000.0
DIAMETER_MM = 1000.0

dx = DIAMETER_MM / N
x = (np.arange(N) + 0.5) * dx - DIAMETER_MM / 2
x, y = np.meshgrid(x, x)
r, t = np.hypot(x, y), np.arctan2(y, x)
rho = r / (DIAMETER_MM / 2)
disc = circle(DIAMETER_MM / 2, r).astype(float)
ring = disc - circle(150.0, r)


def struts(width, count, angle_deg):
    out = np.zeros_like(r, dtype=bool)
    for k in range(count):
        a = np.radians(angle_deg + 360.0 * k / count)
        along, across = x * np.cos(a) + y * np.sin(a), y * np.cos(a) - x * np.sin(a)
        out |= rectangle(width / 2, across, np.where(along >= 0, along, 1e9), height=1e8)
    return out


HEXAGON_MM = 1773 * dx / np.cos(np.pi / 6)  # corner to centre
hexagon = regular_polygon(6, HEXAGON_MM, x, y, rotation=90).astype(float)
print("hexagon from corner to corner, mm:", 2 * HEXAGON_MM, file=sys.stderr)
pupils = {
    "circle": (disc, {4: 0.1}),  # name: amplitude, coefficients
    "ring": (ring, {8: 0.12, 5: 0.05}),
    "struts": (ring * ~struts(31.25, 3, 30.0), {5: 0.15, 7: 0.05}),
    "hexagon": (hexagon, {11: 0.1, 3: 0.2}),
    "taper": (disc * 10 ** (-10 * rho**2 / 20), {4: 0.05, 6: 0.1, 9: 0.08, 12: -0.06}),
}

columns = {}
for name, (amplitude, terms) in pupils.items():
    unit = r / HEXAGON_MM if name == "hexagon" else rho
    waves = sum(c * zernike_nm(*noll_to_nm(j), unit, t, norm=True) for j, c in terms.items())
    efl = 1e4
    pitch = 0.25 * WAVELENGTH_UM * efl / DIAMETER_MM
    psfs = []
    for phase in (waves, np.zeros_like(waves)):
        wave = Wavefront.from_amp_and_phase(amplitude, phase * WAVELENGTH_UM * 1e3, WAVELENGTH_UM, dx)
        psfs.append(wave.focus_fixed_sampling(efl, pitch, SAMPLES).intensity.data)
    columns[name] = (psfs[0] / psfs[1][SAMPLES // 2, SAMPLES // 2]).ravel()
    print(name, amplitude.mean(), columns[name].max(), file=sys.stderr)

print(",".join(columns))
for row in zip(*columns.values()):
    print(",".join(f"{v:.8f}" for v in row))
