#!/usr/bin/env python
"""Time the wgridder of ducc0 in million visibilities a second, and measure its error against the direct sum. usage: ducc_bench.py [-n 3] a b c

The sign of UVH5 is V = sum I exp(+2 pi i (u l + v m + w (n-1))). vis2dirty of ducc0 computes
sum V exp(+2 pi i (u l + v m - w (n-1))), so flip_u = flip_v = True and flip_w = False.
The first axis of its image is l, increasing. The image[row m, col] with right ascension to the left is dirty[::-1].T, shifted by one column."""
import argparse
import json
import os
import statistics as st
import sys
import time

os.environ.pop("OMP_NUM_THREADS", None)  # ducc0 never uses more threads than this variable says
os.environ["DUCC0_NUM_THREADS"] = "2"
from bench import GEOM, RES, WL, WORK, save
import offline  # noqa: F401  (bench makes it importable; it must come before pyuvdata)
import ducc0
import numpy as np
from pyuvdata import UVData


ap = argparse.ArgumentParser()
ap.add_argument("wl", nargs="*", default=["a"])
ap.add_argument("-n", type=int, default=3)
ap.add_argument("--eps", type=float, default=1e-5)
ap.add_argument("--t2-only", action="store_true")
a = ap.parse_args()
AS = np.pi / 180 / 3600


def sky_order(d):
    """Turn dirty[l, m] into image[row m, col]. l decreases with the column; the centre has the index n/2."""
    im = np.roll(d[::-1].T, 1, axis=1)
    im[:, 0] = np.nan  # l = +n/2 lies outside of ducc0's grid
    return im


rows = []
for w in a.wl:
    n, cas = GEOM[w]
    cell = cas * AS
    u = UVData()
    u.read_uvh5(os.path.join(WL, w + ".uvh5"), run_check=False)
    uvw, f = u.uvw_array, u.freq_array
    V = u.data_array.mean(axis=2)  # Stokes I is the mean of the two parallel hands
    del u
    kw = dict(uvw=uvw, freq=f, pixsize_x=cell, pixsize_y=cell, flip_u=True, flip_v=True, flip_w=False, divide_by_n=False)
    for sp in (True, False):
        Vp = V.astype(np.complex64 if sp else np.complex128)
        for nt in ((2,) if a.t2_only else (1, 2)):
            for what in ("vis2dirty", "dirty2vis"):
                if not sp and w == "b" and nt == 1:
                    continue
                ts = []
                for _ in range(a.n):
                    t = time.perf_counter()
                    c0 = time.process_time()
                    if what == "vis2dirty":
                        d = ducc0.wgridder.vis2dirty(vis=Vp, npix_x=n, npix_y=n, epsilon=a.eps, nthreads=nt, do_wgridding=True, **kw)
                    else:
                        v = ducc0.wgridder.dirty2vis(dirty=img, epsilon=a.eps, nthreads=nt, do_wgridding=True, **kw)
                    ts.append((time.perf_counter() - t, time.process_time() - c0))
                if what == "vis2dirty":
                    img = np.ascontiguousarray(d / V.size)
                m = st.median(x[0] for x in ts)
                rows.append(dict(tag=f"{w}:{what}-{'f32' if sp else 'f64'}-t{nt}-eps{a.eps:g}", wall_s=m, wall_all=[round(x[0], 3) for x in ts],
                                 cpu_s=st.median(x[1] for x in ts), mvis=V.size / 1e6, mvis_per_s=V.size / 1e6 / m, rc=0, load=[round(os.getloadavg()[0], 2)]))
                print(rows[-1], flush=True)
                save("ducc", rows)
    if a.t2_only:
        continue
    # The true dirty image (natural weights, epsilon 1e-12, double precision), and the direct sum at random pixels.
    d = ducc0.wgridder.vis2dirty(vis=V.astype(np.complex128), npix_x=n, npix_y=n, epsilon=1e-12, nthreads=2, do_wgridding=True, **kw) / V.size
    p = ducc0.wgridder.vis2dirty(vis=np.ones_like(V, dtype=np.complex128), npix_x=n, npix_y=n, epsilon=1e-12, nthreads=2, do_wgridding=True, **kw) / V.size
    im = sky_order(d)
    np.savez(os.path.join(WORK, f"ducc_{w}_natural.npz"), dirty=im.astype(np.float64), psf=sky_order(p))
    rng = np.random.default_rng(0)
    px = rng.integers(1, n, (24, 2))
    err = []
    for r, c in px:
        l, m = -(c - n // 2) * cell, (r - n // 2) * cell
        g = uvw @ np.array([l, m, np.sqrt(1 - l * l - m * m) - 1])
        s = 0.0
        for k in range(len(f)):
            s += (V[:, k] * np.exp(-2j * np.pi * g * f[k] / 299792458.0)).real.sum()
        err.append(im[r, c] - s / V.size)
    rows.append(dict(tag=f"{w}:direct-sum-check", rc=0, wall_s=0, max_abs_err_24px=float(np.abs(err).max()), peak=float(np.nanmax(im))))
    print(rows[-1], flush=True)
    save("ducc", rows)
