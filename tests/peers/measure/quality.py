#!/usr/bin/env python
"""Compare images with the truth. usage: quality.py dirty <w> <img.fits|.npz> ... | clean <a|c> <restored.fits> ...

dirty: the reference is ducc0 at epsilon 1e-12 with natural weights, which equals the direct sum to 1e-13. The script prints the largest
       and the rms difference over the peak, for the whole image and for its inner half. Column 0 is left out.
clean: for workload a, the flux of each point (peak of the restored image by a parabola in two dimensions) and of the Gaussian (sum within
       40 pixels over the beam area), each over the true flux; the rms off the sources; the dynamic range.
       For workload c, the restored image in kelvin against the true scene convolved with the same beam.
A CASA image is given by its folder; the script exports it to FITS first."""
import json
import os
import subprocess
import sys

import numpy as np
from astropy.io import fits
from scipy.signal import fftconvolve

from bench import GEOM, HERE, PY, RES, WL, WORK

AS = np.pi / 180 / 3600


def load(p):
    if os.path.isdir(p):
        out = p.rstrip("/") + ".fits"
        subprocess.run([PY, os.path.join(HERE, "casa_task.py"), "fits", p, out], capture_output=True, cwd=WORK)
        p = out
    with fits.open(p) as f:
        return f[0].data.squeeze().astype(float), f[0].header


def beam_px(h, cell_as):
    s2f = 1 / np.sqrt(8 * np.log(2))
    return h["BMAJ"] * 3600 / cell_as * s2f, h["BMIN"] * 3600 / cell_as * s2f, np.radians(h["BPA"])


def beam_img(h, cell_as, n):
    a, b, pa = beam_px(h, cell_as)
    y, x = np.mgrid[-(n // 2): n // 2 + 1, -(n // 2): n // 2 + 1]
    # The position angle runs from north through east; east is -x.
    u = -x * np.sin(pa) + y * np.cos(pa)
    v = -x * np.cos(pa) - y * np.sin(pa)
    return np.exp(-0.5 * ((u / a) ** 2 + (v / b) ** 2))


def peakfit(b):
    y, x = np.mgrid[-1:2, -1:2]
    A = np.stack([np.ones(9), x.ravel(), y.ravel(), x.ravel() ** 2, y.ravel() ** 2, (x * y).ravel()], 1)
    c = np.linalg.lstsq(A, np.log(np.maximum(b, 1e-12)).ravel(), rcond=None)[0]
    H = np.array([[2 * c[3], c[5]], [c[5], 2 * c[4]]])
    d = -np.linalg.solve(H, c[1:3])
    return float(np.exp(c[0] + c[1:3] @ d / 2)), d


out = []
if sys.argv[1] == "dirty":
    w = sys.argv[2]
    z = np.load(os.path.join(WORK, f"ducc_{w}_natural.npz"))
    for p in sys.argv[3:]:
        im, h = load(p)
        ref = z["psf"] if "psf" in os.path.basename(p) else z["dirty"]
        pk = np.nanmax(np.abs(ref))
        d = np.abs(im - ref)[:, 1:] / pk
        n = im.shape[0]
        q = d[n // 4: 3 * n // 4, n // 4: 3 * n // 4]
        out.append(dict(tag=f"{w}:{os.path.basename(p)}", max_over_peak=float(d.max()), rms_over_peak=float(np.sqrt((d**2).mean())), inner_half_max=float(q.max()), inner_half_rms=float(np.sqrt((q**2).mean()))))
        print("{tag:48s} max {max_over_peak:.2e} rms {rms_over_peak:.2e} inner half max {inner_half_max:.2e} rms {inner_half_rms:.2e}".format(**out[-1]))
else:
    w = sys.argv[2]
    n, cas = GEOM[w]
    t = json.load(open(os.path.join(WL, f"{'a' if w in 'ad' else w}_truth.json")))
    for p in sys.argv[3:]:
        im, h = load(p)
        a, b, pa = beam_px(h, cas)
        area = 2 * np.pi * a * b
        r = dict(tag=f"{w}:{os.path.basename(p)}", peak=float(im.max()), beam_px_sigma=[a, b])
        if w in "ad":
            mask = np.ones_like(im, bool)
            rat = []
            for l, m, s in zip(t["l"], t["m"], t["s"]):
                x, y = n / 2 - l / AS / cas, n / 2 + m / AS / cas
                i, j = int(round(y)), int(round(x))
                k = im[i - 2: i + 3, j - 2: j + 3]
                q = np.unravel_index(k.argmax(), k.shape)
                i, j = i - 2 + q[0], j - 2 + q[1]
                f, d = peakfit(im[i - 1: i + 2, j - 1: j + 2])
                rat.append(dict(true=s, flux_ratio=f / s, dx=float(j + d[0] - x), dy=float(i + d[1] - y)))
                mask[i - 12: i + 13, j - 12: j + 13] = False
            g = t["gauss"][0]
            x, y = int(round(n / 2 - g[1] / AS / cas)), int(round(n / 2 + g[2] / AS / cas))
            r["gauss_flux_ratio"] = float(im[y - 40: y + 41, x - 40: x + 41].sum() / area / g[0])
            mask[y - 48: y + 49, x - 48: x + 49] = False
            r.update(points=rat, off_rms=float(im[mask].std()), dr=float(im.max() / im[mask].std()))
            print(f"{r['tag']:46s} peak {r['peak']:.4f} off-source rms {r['off_rms']:.2e} DR {r['dr']:.0f} Gaussian flux/true {r['gauss_flux_ratio']:.3f} points flux/true "
                  + " ".join(f"{q['flux_ratio']:.3f}" for q in rat[:7]) + f" max |shift| px {max(max(abs(q['dx']), abs(q['dy'])) for q in rat[:6]):.3f}")
        else:
            truth = fits.getdata(os.path.join(WL, "c_scene_kelvin.fits")).squeeze().astype(float)
            B = beam_img(h, cas, 64)
            tb = fftconvolve(truth, B / B.sum(), mode="same")
            cell = cas * AS
            K = im / (area * cell * cell)  # K sr / beam -> K
            y, x = np.mgrid[0:n, 0:n] / (n - 1.0)
            k = np.hypot(x - 0.5, y - 0.5) < 0.42
            e = K[k] - tb[k]
            r.update(nrmse=float(np.sqrt((e**2).mean()) / np.sqrt((tb[k] ** 2).mean())), rms_err_K=float(e.std()), mean_K=float(K[k].mean()), true_mean_K=float(tb[k].mean()),
                     corr=float(np.corrcoef(K[k], tb[k])[0, 1]), flux_ratio=float(K[np.hypot(x - .5, y - .5) < .48].sum() / tb[np.hypot(x - .5, y - .5) < .48].sum()))
            print("{tag:46s} NRMSE {nrmse:.3f} rms err {rms_err_K:.1f} K mean {mean_K:.1f} (true {true_mean_K:.1f}) K corr {corr:.4f} flux/true {flux_ratio:.3f}".format(**r))
        out.append(r)
p = os.path.join(RES, f"quality_{sys.argv[1]}.json")
old = {x["tag"]: x for x in (json.load(open(p)) if os.path.exists(p) else [])}
old.update({x["tag"]: x for x in out})
json.dump(list(old.values()), open(p, "w"), indent=1)
