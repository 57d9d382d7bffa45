#!/usr/bin/env python
"""Make the common workloads (MS, UVFITS, UVH5 and their truth) for cittert and its peers.

    make_workloads.py [a] [b] [c] [d]      (default: all)
    CITTERT_WL=<dir>   where to write (default ./wl)

The truth is a direct Fourier sum in double precision, computed in this file without a gridder. It follows the convention of the UVH5
memo: u = (r_ant2 - r_ant1) nu/c and V(u,v,w) = sum_k S_k(nu) exp(+2 pi i (u l + v m + w (n-1))). Gaussians are analytic.
pyuvdata conjugates the visibilities and negates uvw when it writes UVFITS and MS.
Gains: V_ij = g_i conj(g_j) V_true in the same UVH5 convention.
All random numbers have fixed seeds, so a second run writes the same data.
"""
import json
import os
import shutil
import sys

import offline  # noqa: F401  (must come before pyuvdata)
import astropy.units as u
import numba as nb
import numpy as np
from astropy.coordinates import EarthLocation, SkyCoord
from astropy.io import fits
from astropy.time import Time, TimeDelta
from pyuvdata import Telescope, UVData
from pyuvdata.utils import ECEF_from_ENU

C = 299792458.0
OUT = os.environ.get("CITTERT_WL", "wl")
HERE = os.path.dirname(os.path.abspath(__file__))
AS = np.pi / 180 / 3600


# ---------------------------------------------------------------- layouts
def vla_a_like():
    """27 antennas on three arms, r_n = 484 m * n^1.716 (the VLA A power law)."""
    rng = np.random.default_rng(27)
    enu, names = [], []
    for arm, az in (("W", 236.0), ("E", 115.0), ("N", 355.0)):
        for n in range(1, 10):
            r = 484.0 * n**1.716
            e, no = r * np.sin(np.radians(az)), r * np.cos(np.radians(az))
            up = -r * r / (2 * 6.371e6) + rng.normal(0, 6.0)
            enu.append((e, no, up))
            # The names are not W08, E08, N08: for the telescope VLA, CASA's exportuvfits takes the digits of a name as the antenna number.
            names.append(f"ea{len(enu):02d}")
    return np.array(enu), names, EarthLocation.from_geodetic(-107.6184 * u.deg, 34.0784 * u.deg, 2124 * u.m), 25.0


def mm_sparse(n=96, rmax=0.90, dmin=0.012):
    """n elements in one plane (up = 0), on a golden-angle spiral with a denser core and small random offsets.

    The shortest spacing is at least dmin metres; the longest is about 2*rmax."""
    rng = np.random.default_rng(94)
    k = np.arange(n)
    r = rmax * ((k + 0.5) / n) ** 1.6
    th = k * np.pi * (3 - 5**0.5)
    p = np.c_[r * np.cos(th), r * np.sin(th)] + rng.normal(0, 0.004, (n, 2))
    for _ in range(200):  # move the closest pair apart until no pair is too close
        d = p[:, None] - p[None]
        dist = np.hypot(*d.transpose(2, 0, 1)) + np.eye(n)
        i, j = np.unravel_index(np.argmin(dist), dist.shape)
        if dist[i, j] >= dmin:
            break
        step = 0.51 * (dmin - dist[i, j]) * d[i, j] / dist[i, j]
        p[i] += step
        p[j] -= step
    enu = np.c_[p, np.zeros(n)]
    return enu, [f"M{i:03d}" for i in range(n)], EarthLocation.from_geodetic(5.1 * u.deg, 52.1 * u.deg, 10 * u.m), 0.006


# ---------------------------------------------------------------- direct Fourier sum
@nb.njit(parallel=True, fastmath=False, cache=True)
def _dft(uvw, nu0, dnu, nch, lmn1, flux, out):
    """out[row, ch] += sum_k flux[k] exp(+2 pi i nu/c (u l + v m + w (n-1))).

    The phase of each source advances by the same angle from channel to channel. A complex recurrence, restarted every 16 channels,
    keeps the error near 1e-15."""
    c = 299792458.0
    tp = 2 * np.pi / c
    for r in nb.prange(uvw.shape[0]):
        for k in range(lmn1.shape[0]):
            d = uvw[r, 0] * lmn1[k, 0] + uvw[r, 1] * lmn1[k, 1] + uvw[r, 2] * lmn1[k, 2]
            a = tp * dnu * d
            sr, si = np.cos(a), np.sin(a)
            er, ei = 0.0, 0.0
            for ch in range(nch):
                if ch % 16 == 0:
                    ph = tp * (nu0 + ch * dnu) * d
                    er, ei = flux[k] * np.cos(ph), flux[k] * np.sin(ph)
                out[r, ch] += er + 1j * ei
                er, ei = er * sr - ei * si, er * si + ei * sr
    return out


def dft(uvw, freqs, l, m, s):
    lm = np.c_[l, m, np.sqrt(1 - l * l - m * m) - 1]
    out = np.zeros((len(uvw), len(freqs)), np.complex128)
    return _dft(np.ascontiguousarray(uvw), freqs[0], freqs[1] - freqs[0], len(freqs), lm, np.asarray(s, float), out)


def gaussians(uvw, freqs, comps):
    """Visibilities of elliptical Gaussians: flux, l, m, major and minor FWHM (rad), position angle from north through east."""
    out = np.zeros((len(uvw), len(freqs)), np.complex128)
    for s, l, m, bmaj, bmin, pa in comps:
        n1 = np.sqrt(1 - l * l - m * m) - 1
        for ch, f in enumerate(freqs):
            uu, vv, ww = (uvw * (f / C)).T
            a = uu * np.sin(pa) + vv * np.cos(pa)
            b = uu * np.cos(pa) - vv * np.sin(pa)
            env = np.exp(-(np.pi**2) / (4 * np.log(2)) * ((a * bmaj) ** 2 + (b * bmin) ** 2))
            out[:, ch] += s * env * np.exp(2j * np.pi * (uu * l + vv * m + ww * n1))
    return out


# ---------------------------------------------------------------- containers
def make_uv(enu, names, loc, diam, freqs, chw, times_jd, tint, centre, pols, telname, units):
    lat, lon, alt = loc.lat.rad, loc.lon.rad, loc.height.to_value(u.m)
    ecef = ECEF_from_ENU(enu, center_loc=loc)
    rel = ecef - np.array([loc.x.value, loc.y.value, loc.z.value])
    circ = pols[0] == "rr"
    tel = Telescope.new(telname, loc, antenna_positions=rel, antenna_names=names,
                        antenna_numbers=np.arange(len(names)), instrument=telname,
                        antenna_diameters=np.full(len(names), diam), mount_type="alt-az",
                        feeds=["r", "l"] if circ else ["x", "y"],
                        x_orientation="east", update_from_known=False)
    ap = [(i, j) for i in range(len(names)) for j in range(i + 1, len(names))]
    pnum = np.array([{"rr": -1, "ll": -2, "xx": -5, "yy": -6}[q] for q in pols])
    uv = UVData.new(freq_array=freqs, polarization_array=pnum, times=times_jd, antpairs=ap,
                    do_blt_outer=True, integration_time=tint, channel_width=chw, telescope=tel,
                    phase_center_catalog={0: dict(cat_name="FIELD", cat_type="sidereal", cat_lon=centre.ra.rad,
                                                  cat_lat=centre.dec.rad, cat_frame="icrs", cat_epoch=2000.0)},
                    phase_center_id_array=np.zeros(len(ap) * len(times_jd), int), vis_units=units, empty=True)
    uv.set_uvws_from_antenna_positions(update_vis=False)
    return uv


def write(uv, base):
    for ext in (".ms", ".uvfits", ".uvh5"):
        p = base + ext
        shutil.rmtree(p, ignore_errors=True) if os.path.isdir(p) else (os.path.exists(p) and os.remove(p))
    uv.write_uvh5(base + ".uvh5", clobber=True)
    uv.write_uvfits(base + ".uvfits")
    uv.write_ms(base + ".ms", clobber=True)
    print("wrote", base, "Nblts", uv.Nblts, "Nbls", uv.Nbls, "Nfreqs", uv.Nfreqs, "Npols", uv.Npols, flush=True)


def put(uv, model, sigma, seed):
    """Set the data to the model, the same in every parallel hand, plus complex noise. sigma is that of the real and of the imaginary part."""
    rng = np.random.default_rng(seed)
    for p in range(uv.Npols):
        n = rng.standard_normal((uv.Nblts, uv.Nfreqs, 2), dtype=np.float32)
        uv.data_array[:, :, p] = (model + sigma * (n[..., 0] + 1j * n[..., 1])).astype(np.complex64)
    uv.flag_array[:] = False
    uv.nsample_array[:] = 1.0


def accuracy_subset(path, uv, freqs, model, seed=5, nrow=2000):
    """Save the noise-free direct sum on a random subset of rows. It is the truth for tests of predicted visibilities."""
    idx = np.sort(np.random.default_rng(seed).choice(uv.Nblts, min(nrow, uv.Nblts), replace=False))
    np.savez_compressed(path, rows=idx, uvw=uv.uvw_array[idx], freqs=freqs, vis=model[idx],
                        ant1=uv.ant_1_array[idx], ant2=uv.ant_2_array[idx], time=uv.time_array[idx])


def fits_image(path, img, cell_rad, centre, freq, bw, unit):
    """Write img[row, col]. Column 0 has the largest offset in right ascension: in FITS order, right ascension decreases with the column."""
    n = img.shape[0]
    h = fits.Header()
    for k, v in (("CTYPE1", "RA---SIN"), ("CRPIX1", n // 2 + 1), ("CRVAL1", centre.ra.deg), ("CDELT1", -np.degrees(cell_rad)), ("CUNIT1", "deg"),
                 ("CTYPE2", "DEC--SIN"), ("CRPIX2", n // 2 + 1), ("CRVAL2", centre.dec.deg), ("CDELT2", np.degrees(cell_rad)), ("CUNIT2", "deg"),
                 ("CTYPE3", "FREQ"), ("CRPIX3", 1), ("CRVAL3", freq), ("CDELT3", bw), ("CUNIT3", "Hz"),
                 ("CTYPE4", "STOKES"), ("CRPIX4", 1), ("CRVAL4", 1.0), ("CDELT4", 1.0), ("EQUINOX", 2000.0), ("RADESYS", "ICRS"), ("BUNIT", unit)):
        h[k] = v
    fits.writeto(path, img[None, None].astype(np.float32), h, overwrite=True)


# ---------------------------------------------------------------- a and d
A = dict(ncell=512, cell_as=0.25, nch=16, f0=1.40e9, df=4e6, tint=10.0, hours=1.0, sigma=0.05)
A_CENTRE = SkyCoord("13h31m08.288s +30d30m32.96s", frame="icrs")


def sky_a():
    """Ten points and one Gaussian. Fluxes are in Jy, offsets east and north in arcsec. The points do not lie on centres of pixels."""
    rng = np.random.default_rng(11)
    s = np.array([1.0, 0.5, 0.25, 0.1, 0.05, 0.03, 0.02, 0.01, 0.005, 0.003])
    e = np.r_[12.34, -20.11, 30.0, rng.uniform(-52, 52, 7)]
    n = np.r_[7.77, 25.43, -15.25, rng.uniform(-52, 52, 7)]
    l, m = e * AS, n * AS  # the sine of a small angle; the values of l and m are then taken as exact
    g = [(0.5, -30.2 * AS, -22.6 * AS, 6 * AS, 4 * AS, np.radians(30))]
    return l, m, s, g


def start_jd(centre, loc, hours, near="2025-06-01T00:00:00"):
    """The UTC start for which the field is at hour angle 0 in the middle of the observation, as a Julian date."""
    t = Time(near, scale="utc", location=loc)
    lst = t.sidereal_time("apparent").hour
    dt = ((centre.ra.hour - lst) % 24) / 1.00273790935
    return (t + TimeDelta((dt - hours / 2) * 3600, format="sec")).jd


def make_a(with_d):
    enu, names, loc, diam = vla_a_like()
    p = A
    freqs = p["f0"] + p["df"] * np.arange(p["nch"])
    nt = int(p["hours"] * 3600 / p["tint"])
    t = start_jd(A_CENTRE, loc, p["hours"]) + (np.arange(nt) + 0.5) * p["tint"] / 86400
    uv = make_uv(enu, names, loc, diam, freqs, p["df"], t, p["tint"], A_CENTRE, ["rr", "ll"], "VLA", "Jy")
    l, m, s, g = sky_a()
    model = dft(uv.uvw_array, freqs, l, m, s) + gaussians(uv.uvw_array, freqs, g)
    accuracy_subset(f"{OUT}/a_dft_subset.npz", uv, freqs, model)
    put(uv, model, p["sigma"], 1)
    write(uv, f"{OUT}/a")
    json.dump(dict(params=p, l=list(l), m=list(m), s=list(s), gauss=[list(map(float, x)) for x in g],
                   ra_deg=A_CENTRE.ra.deg, dec_deg=A_CENTRE.dec.deg), open(f"{OUT}/a_truth.json", "w"), indent=1)
    np.savetxt(f"{OUT}/vla_a_like.enu.txt", np.c_[enu], header="E N U metres at lon -107.6184 lat 34.0784 h 2124; 27 antennas ea01..ea27: west, east, north arm, nine each, inside out")
    if with_d:
        step = 60.0
        ti = ((uv.time_array - t[0]) * 86400 / step + 1e-6).astype(int)
        ph = np.random.default_rng(44).normal(0, 0.5, (ti.max() + 1, len(names)))
        gph = np.exp(1j * (ph[ti, uv.ant_1_array] - ph[ti, uv.ant_2_array]))
        put(uv, model * gph[:, None], p["sigma"], 1)  # The noise is that of workload a, which is the truth without errors.
        write(uv, f"{OUT}/d")
        np.savez_compressed(f"{OUT}/d_gain_phases.npz", phase_rad=ph, step_s=step, t0_jd=t[0], names=names,
                            note="V_ij corrupted = g_i conj(g_j) V_ij, g = exp(i phase)")


# ---------------------------------------------------------------- b
B = dict(ncell=2048, cell_as=0.25, nch=64, f0=1.30e9, df=2e6, tint=60.0, hours=8.0, sigma=0.2)


def make_b():
    enu, names, loc, diam = vla_a_like()
    p = B
    freqs = p["f0"] + p["df"] * np.arange(p["nch"])
    nt = int(p["hours"] * 3600 / p["tint"])
    t = start_jd(A_CENTRE, loc, p["hours"]) + (np.arange(nt) + 0.5) * p["tint"] / 86400
    uv = make_uv(enu, names, loc, diam, freqs, p["df"], t, p["tint"], A_CENTRE, ["rr", "ll"], "VLA", "Jy")
    rng = np.random.default_rng(22)
    ns = 120
    s = 1e-3 * (1 - rng.uniform(0, 1, ns)) ** (-1 / 1.0)  # N(>S) ~ S^-1.0 from 1 mJy
    s = np.minimum(s, 2.0)
    l, m = rng.uniform(-230, 230, (2, ns)) * AS
    g = [(0.3, 100 * AS, 60 * AS, 10 * AS, 5 * AS, 0.4), (0.2, -150 * AS, 80 * AS, 6 * AS, 6 * AS, 0.0), (0.4, -40 * AS, -170 * AS, 15 * AS, 9 * AS, 2.0)]
    model = dft(uv.uvw_array, freqs, l, m, s) + gaussians(uv.uvw_array, freqs, g)
    accuracy_subset(f"{OUT}/b_dft_subset.npz", uv, freqs, model)
    put(uv, model, p["sigma"], 2)
    del model
    write(uv, f"{OUT}/b")
    json.dump(dict(params=p, l=list(l), m=list(m), s=list(s), gauss=[list(map(float, x)) for x in g],
                   ra_deg=A_CENTRE.ra.deg, dec_deg=A_CENTRE.dec.deg), open(f"{OUT}/b_truth.json", "w"), indent=1)


# ---------------------------------------------------------------- c
CC = dict(ncell=512, cell_rad=6.0e-4, nch=32, f0=90.125e9, df=0.25e9, tint=0.01, sigma_kelvin_sr=2e-3)


def airport(n=512):
    """An outdoor scene in kelvin: a warm apron, cold metal that reflects the sky, warm buildings, gradients."""
    y, x = np.mgrid[0:n, 0:n] / (n - 1.0)
    img = 275 + 8 * np.sin(3.1 * x + 0.5) * np.cos(2.3 * y) + 6 * y
    img[y > 0.80] = (150 - 350 * (y - 0.80))[y > 0.80]  # the sky, colder higher up

    def rect(x0, x1, y0, y1, t, g=0.0):
        k = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
        img[k] = t + g * (x[k] - x0) / (x1 - x0)

    rect(0.08, 0.92, 0.16, 0.24, 262, 6)  # runway
    for i in range(12):
        rect(0.11 + 0.068 * i, 0.14 + 0.068 * i, 0.194, 0.206, 240)  # markings
    k = np.abs(y - (0.24 + 0.9 * (x - 0.2))) < 0.02
    img[k & (y < 0.55) & (y > 0.24)] = 264  # taxiway
    rect(0.10, 0.55, 0.62, 0.76, 292, -12)  # terminal
    for i in range(7):
        rect(0.12 + 0.06 * i, 0.145 + 0.06 * i, 0.66, 0.70, 255)
    rect(0.62, 0.66, 0.55, 0.90, 288)  # tower
    rect(0.60, 0.68, 0.88, 0.93, 200)
    rect(0.74, 0.94, 0.60, 0.74, 180, 90)  # metal hangar roof with a gradient
    for cx, cy, a in ((0.30, 0.42, 0.2), (0.62, 0.36, -0.5), (0.80, 0.45, 0.9)):  # aircraft: cold metal
        xr = (x - cx) * np.cos(a) + (y - cy) * np.sin(a)
        yr = -(x - cx) * np.sin(a) + (y - cy) * np.cos(a)
        img[(np.abs(xr) < 0.075) & (np.abs(yr) < 0.010)] = 120
        img[(np.abs(xr - 0.3 * np.abs(yr)) < 0.014) & (np.abs(yr) < 0.070)] = 140
        img[(np.abs(xr + 0.065) < 0.008) & (np.abs(yr) < 0.025)] = 150
    rr = np.hypot(x - 0.5, y - 0.5)
    taper = np.where(rr < 0.42, 1.0, np.where(rr > 0.49, 0.0, 0.5 * (1 + np.cos(np.pi * (rr - 0.42) / 0.07))))
    return img * taper  # zero outside of the field of view, which has a soft edge


def make_c():
    enu, names, loc, diam = mm_sparse()
    p = CC
    freqs = p["f0"] + p["df"] * np.arange(p["nch"])
    t = Time("2025-06-01T12:00:00", scale="utc", location=loc)
    # The phase centre is the exact zenith in pyuvdata's own frame, so that w is almost zero.
    from pyuvdata.utils import phasing
    lst = t.sidereal_time("apparent").rad
    ra, dec = phasing.transform_app_to_icrs(time_array=t.jd, app_ra=lst, app_dec=loc.lat.rad, telescope_loc=loc)
    centre = SkyCoord(float(np.atleast_1d(ra)[0]) * u.rad, float(np.atleast_1d(dec)[0]) * u.rad, frame="icrs")
    uv = make_uv(enu, names, loc, diam, freqs, p["df"], np.array([t.jd]), p["tint"], centre, ["xx", "yy"], "MMIMAGER", "K str")
    print("c: max |w| metres before zeroing", np.abs(uv.uvw_array[:, 2]).max())
    uv.uvw_array[:, 2] = 0.0
    d = np.hypot(uv.uvw_array[:, 0], uv.uvw_array[:, 1])
    print("c: baselines", len(d), "min/max m", d.min(), d.max(), "resolution lam/B rad", C / 94e9 / d.max(), "cell", p["cell_rad"])
    img = airport(p["ncell"])
    n = p["ncell"]
    cell = p["cell_rad"]
    ax = (np.arange(n) - n // 2) * cell
    # image[row, col] as seen on the sky: m grows with the row; l falls with the column (east is left).
    L, M = np.meshgrid(-ax, ax)
    nn = np.sqrt(1 - L**2 - M**2)
    # With w = 0 the sum separates: exp(2 pi i (u l + v m)) = E_u(l) E_v(m). Each channel is one matrix product.
    F = img * cell * cell / nn  # T dOmega in kelvin steradian
    model = np.zeros((uv.Nblts, len(freqs)), np.complex128)
    for ch, f in enumerate(freqs):
        uu, vv = (uv.uvw_array[:, :2] * (f / C)).T
        Eu = np.exp(2j * np.pi * np.outer(uu, -ax))
        Ev = np.exp(2j * np.pi * np.outer(vv, ax))
        model[:, ch] = np.einsum("rm,rm->r", Ev, Eu @ F.T)
    accuracy_subset(f"{OUT}/c_dft_subset.npz", uv, freqs, model)
    put(uv, model, p["sigma_kelvin_sr"], 3)
    write(uv, f"{OUT}/c")
    fits_image(f"{OUT}/c_scene_kelvin.fits", img, cell, centre, freqs.mean(), p["df"] * p["nch"], "K")
    np.savetxt(f"{OUT}/mm_sparse96.enu.txt", enu, header="E N U metres, 96 elements, coplanar")
    json.dump(dict(params=p, ra_deg=centre.ra.deg, dec_deg=centre.dec.deg, total_kelvin_sr=float(F.sum()), time_jd=t.jd,
                   lat_deg=52.1, lon_deg=5.1), open(f"{OUT}/c_truth.json", "w"), indent=1)


if __name__ == "__main__":
    os.makedirs(OUT, exist_ok=True)
    todo = sys.argv[1:] or ["a", "b", "c", "d"]
    if "a" in todo or "d" in todo:
        make_a("d" in todo)
    if "c" in todo:
        make_c()
    if "b" in todo:
        make_b()
