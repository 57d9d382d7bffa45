#!/usr/bin/env python
"""Measure how close each peer's prediction of visibilities is to the direct Fourier sum. usage: predict_truth.py [inner]

The model image for workloads a and c has points on centres of pixels, so that it is exact. It is predicted by the direct sum, by ducc0
(epsilon 1e-4, 1e-5 and 1e-12) and by WSClean -predict (w-stacking and wgridder). With `inner` the points lie in the inner half of the image."""
import os
import shutil
import subprocess
import sys

from bench import GEOM, WL, WORK, save
import offline  # noqa: F401  (bench makes it importable; it must come before pyuvdata)
import ducc0
import numpy as np
from astropy.io import fits
from casacore.tables import table
from pyuvdata import UVData


rows = []
INNER = "inner" in sys.argv[1:]
S = "-inner" if INNER else ""
AS = np.pi / 180 / 3600
for w in ("a", "c"):
    n, cas = GEOM[w]
    cell = cas * AS
    src = os.path.join(WORK, f"ws_{w}_clean10000-briggs0-model.fits")
    h = fits.open(src)[0]
    img = np.zeros((n, n))
    rng = np.random.default_rng(9)
    pr, pc = rng.integers(n // 4 if INNER else 10, 3 * n // 4 if INNER else n - 10, (2, 30))
    img[pr, pc] = rng.uniform(0.01, 1, 30)
    name = f"pt_{w}"
    h.data[:] = img
    cp = os.path.join(WORK, f"{w}_pt.ms")
    u = UVData()
    u.read_uvh5(os.path.join(WL, w + ".uvh5"), run_check=False)
    uvw, f = u.uvw_array, u.freq_array
    idx = np.sort(np.random.default_rng(1).choice(u.Nblts, 2000, replace=False))
    l, m = -(pc - n // 2) * cell, (pr - n // 2) * cell
    n1 = np.sqrt(1 - l * l - m * m) - 1
    s = img[pr, pc]
    g = uvw[idx] @ np.array([l, m, n1])
    truth = np.stack([(s * np.exp(2j * np.pi * g * (k / 299792458.0))).sum(1) for k in f], axis=1)
    tot = s.sum()
    for eps in (1e-4, 1e-5, 1e-12):
        d = np.roll(img.T[::-1], 1, axis=0)  # the inverse of sky_order in ducc_bench.py
        v = ducc0.wgridder.dirty2vis(uvw=uvw[idx], freq=f, dirty=d, pixsize_x=cell, pixsize_y=cell, epsilon=eps, do_wgridding=True,
                                     flip_u=True, flip_v=True, flip_w=False, divide_by_n=False, nthreads=2)
        rows.append(dict(tag=f"{w}:ducc-eps{eps:g}{S}", rc=0, wall_s=0, max_abs_err_over_total_flux=float(np.abs(v - truth).max() / tot),
                         rms_err_over_rms=float(np.sqrt((np.abs(v - truth) ** 2).mean() / (np.abs(truth) ** 2).mean()))))
        print(rows[-1])
    for k, opt in (("wstack", []), ("wgridder", ["-use-wgridder"]), ("wgridder1e-6", ["-use-wgridder", "-wgridder-accuracy", "1e-6"]),
                   ("wgridder1e-6-pad2-nosmall", ["-use-wgridder", "-wgridder-accuracy", "1e-6", "-padding", "2", "-no-small-inversion"]),
                   ("wstack-pad2-w16-nosmall", ["-nwlayers", "16", "-padding", "2", "-no-small-inversion"])):
        shutil.rmtree(cp, ignore_errors=True)
        shutil.copytree(os.path.join(WL, w + ".ms"), cp)
        h.writeto(os.path.join(WORK, name + "-model.fits"), overwrite=True)
        r = subprocess.run(["wsclean", "-j", "2", "-size", str(n), str(n), "-scale", f"{cas:.9f}asec", "-pol", "I", *opt, "-predict", "-name", name, cp],
                           cwd=WORK, capture_output=True, text=True)
        t = table(cp, ack=False)
        md = t.getcol("MODEL_DATA")[..., 0]
        mu = t.getcol("UVW")
        t.close()
        # pyuvdata wrote -uvw and conjugated data. The rows are in the same order.
        sgn = np.sign((mu * uvw).sum())
        v = md[idx] if sgn > 0 else md[idx].conj()
        rows.append(dict(tag=f"{w}:wsclean-predict-{k}{S}", rc=r.returncode, wall_s=0, max_abs_err_over_total_flux=float(np.abs(v - truth).max() / tot),
                         rms_err_over_rms=float(np.sqrt((np.abs(v - truth) ** 2).mean() / (np.abs(truth) ** 2).mean()))))
        print(rows[-1])
    save("predict_truth", rows)
