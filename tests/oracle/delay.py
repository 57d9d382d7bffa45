"""Writes the reference tables of the delay of air: delay_dispersion_numpy.csv, delay_zenith_p453.csv and sounding_oun_20130120.csv.

Usage: python delay.py TABLES SOUNDING
  TABLES    phenomenology/tables
  SOUNDING  the text table of the radiosonde of Norman, Oklahoma, 2013-01-20 12 UTC, of the University of Wyoming (jan20_sounding.txt of MetPy)

Dispersion is the plain complex sum of the published formulas with the time factor exp(-iwt) of the papers. Zenith delays are those of the
refractivity of Recommendation ITU-R P.453-14, integrated in steps of 1 m. Nothing here is shared with the program.
"""

import csv
import math
import sys
from pathlib import Path

import numpy as np

G0, EARTH_KM, R_DRY = 9.80665, 6370.95, 287.054
MODELS = {"mpm89": 10.0, "mpm93": 1.0}  # hPa in the unit of pressure of the catalogue


def rows(path):
    text = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return [[float(x) for x in row if x != ""] for row in list(csv.reader(text))[1:]]


def catalogue(tables, name):
    return np.array([row[:7] for row in rows(tables / "lines" / f"{name}.csv")])


def dispersion(tables, model, f, p_d, e, temperature):
    """Dispersive refractivity N'(f) - N'(0) of dry air and of vapour, ppm. Pressures in hPa."""
    th, unit = 300.0 / temperature, MODELS[model]
    pd, ev = p_d / unit, e / unit
    shape = lambda f0, g, d: (f / f0) * ((1 - 1j * d) / (f0 - f - 1j * g) - (1 + 1j * d) / (f0 + f + 1j * g))
    f0, a1, a2, a3, a4, a5, a6 = catalogue(tables, f"{model}_o2").T
    strength = a1 * 1e-6 * pd * th**3 * np.exp(a2 * (1 - th))
    width = a3 * 1e-3 * (pd * th ** (0.8 - a4) + 1.1 * ev * th)
    mixing = (a5 + a6 * th) * 1e-3 * (pd + (ev if model == "mpm93" else 0.0)) * th**0.8
    dry = np.sum(strength * shape(f0, width, mixing))
    if f > 0:
        dry += 6.14e-5 * p_d * th**2 * (-f / (f + 1j * 0.56e-3 * (p_d + e) * th**0.8))
    f0, b1, b2, b3, b4, b5, b6 = catalogue(tables, f"{model}_h2o").T
    ratio, x, y = (b5, b4, b6) if model == "mpm89" else (b4, b5, b6)
    strength = b1 * ev * th**3.5 * np.exp(b2 * (1 - th))
    wet = np.sum(strength * shape(f0, b3 * 1e-3 * (pd * th**x + ratio * ev * th**y), 0.0))
    if model == "mpm89":
        wet += 6.47e-6 * f**2.05 * ev * th**2.4
    return dry.real, wet.real


def write_dispersion(tables, out):
    states = [(1000.0, 12.0, 290.0), (1000.0, 35.0, 305.0), (700.0, 2.0, 265.0), (300.0, 0.05, 225.0), (50.0, 1e-4, 215.0)]
    freqs = [0.01, 0.3, 1.0, 5.0, 22.235, 23.8, 37.0, 52.8, 58.0, 60.31, 64.0, 86.0, 94.0, 118.75, 119.3, 140.0, 183.31, 186.0, 220.0,
             325.15, 340.0, 424.76, 557.0, 650.0, 752.0, 850.0, 988.0, 1000.0]
    with out.open("w") as file:
        file.write("# Dispersive refractivity N'(f) - N'(0) of dry air and vapour, ppm, by tests/oracle/delay.py (numpy).\n")
        file.write("model,freq_ghz,pressure_dry_hpa,vapour_hpa,temperature_k,dry_ppm,wet_ppm\n")
        for model in MODELS:
            for p_d, e, t in states:
                for f in freqs:
                    dry, wet = dispersion(tables, model, f, p_d, e, t)
                    file.write(f"{model},{f},{p_d},{e},{t},{dry:.10e},{wet:.10e}\n")


def p453(p_d, e, t):
    """Dry and wet term of Recommendation ITU-R P.453-14, ppm (hPa, K)."""
    return 77.6 * p_d / t, 72.0 * e / t + 3.75e5 * e / t**2


def zenith(levels):
    """Zenith delay in mm of the dry term, of the dry term above the top, and of the wet term."""
    z, p, t, e = (np.array(column) for column in zip(*levels))
    fine = np.linspace(z[0], z[-1], int(round((z[-1] - z[0]) * 1e3)) + 1)
    temperature = np.interp(fine, z, t)
    pressure = np.exp(np.interp(fine, z, np.log(p)))
    vapour = np.exp(np.interp(fine, z, np.log(np.maximum(e, 1e-12))))
    dry, wet = p453(pressure - vapour, vapour, temperature)
    integral = lambda n: float(np.sum(0.5 * (n[1:] + n[:-1]) * np.diff(fine)))
    # Above the top: isothermal, hydrostatic, gravity of a sphere.
    up = np.linspace(z[-1], 120.0, 200_001)
    gravity = G0 * (EARTH_KM / (EARTH_KM + up)) ** 2
    slope = gravity * 1e3 / (R_DRY * t[-1])
    fall = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(up))])
    above = 77.6 * p[-1] / t[-1] * np.exp(-fall)
    top = float(np.sum(0.5 * (above[1:] + above[:-1]) * np.diff(up)))
    return integral(dry), top, integral(wet)


def sounding(path):
    """Height (geometric), pressure, temperature and vapour pressure from a table of the University of Wyoming."""
    levels = []
    for line in path.read_text().splitlines()[4:]:
        if len(line.split()) < 11:
            continue
        p, height_m, t, _, _, mixing = (float(x) for x in line.split()[:6])
        geopotential = height_m / 1e3
        # Geopotential to geometric height at 35.2 deg north (gravity 9.7975 m/s2 at sea level).
        ratio = 9.7975 / G0
        z = EARTH_KM * geopotential / (ratio * EARTH_KM - geopotential)
        e = p * mixing / (621.97 + mixing)
        if not levels or z > levels[-1][0]:
            levels.append((z, p, t + 273.15, e))
    return levels


def main():
    tables, text = Path(sys.argv[1]), Path(sys.argv[2])
    here = Path(__file__).parent
    write_dispersion(tables, here / "delay_dispersion_numpy.csv")
    balloon = sounding(text)
    with (here / "sounding_oun_20130120.csv").open("w") as file:
        file.write("# Radiosonde of Norman, Oklahoma (72357 OUN), 2013-01-20 12 UTC, University of Wyoming, as in MetPy (jan20_sounding.txt).\n")
        file.write("# z: geometric height from the geopotential one; e: vapour pressure from the mixing ratio.\n")
        file.write("z_km,p_hpa,t_k,e_hpa\n")
        for z, p, t, e in balloon:
            file.write(f"{z:.5f},{p},{t:.2f},{e:.6f}\n")
    with (here / "delay_zenith_p453.csv").open("w") as file:
        file.write("# Zenith delays by the refractivity of ITU-R P.453-14, and the hydrostatic delay of Saastamoinen 1972 as in Davis et al. 1985,\n")
        file.write("# by tests/oracle/delay.py (numpy). dry_mm has the air above the top; hydrostatic_mm is empty where the profile is climate.\n")
        file.write("atmosphere,surface_hpa,dry_mm,above_mm,wet_mm,hydrostatic_mm\n")
        for name in ["ussa", "trl", "mls", "mlw", "sas", "saw", "sts", "stw", "as", "aw"]:
            levels = [row[:4] for row in csv_levels(tables / "atmospheres" / f"{name}.csv")]
            dry, above, wet = zenith(levels)
            file.write(f"{name},{levels[0][1]},{dry + above:.4f},{above:.4f},{wet:.4f},\n")
        dry, above, wet = zenith(balloon)
        surface = balloon[0]
        factor = 1 - 0.00266 * math.cos(2 * math.radians(35.18)) - 0.00028 * surface[0]
        hydrostatic = 2.2768 * surface[1] / factor
        file.write(f"sounding_oun_20130120,{surface[1]},{dry + above:.4f},{above:.4f},{wet:.4f},{hydrostatic:.4f}\n")


def csv_levels(path):
    text = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    return [[float(r["z_km"]), float(r["p_hpa"]), float(r["t_k"]), float(r["e_hpa"])] for r in csv.DictReader(text)]


if __name__ == "__main__":
    main()
