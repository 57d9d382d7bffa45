#!/usr/bin/env python
"""Run one ehtim job in one process and print a line of JSON.

  ehtim_task.py mem <uvfits> <out prefix> <entropy gs|simple> <npix> <fov_uas> <prior_fwhm_uas> <flux>
  ehtim_task.py obs <array.txt> <model.txt|fits> <out prefix>
"""
import json
import sys
import time
import warnings

import bench  # noqa: F401  (makes offline importable)
import offline  # noqa: F401  (before ehtim: astropy must not look for a network)
import matplotlib

matplotlib.use("Agg")
warnings.simplefilter("ignore")
import ehtim as eh
import numpy as np

what = sys.argv[1]
if what == "mem":
    f, pre, ent, npix, fov, fwhm, flux = sys.argv[2:9]
    npix, fov, fwhm = int(npix), float(fov) * eh.RADPERUAS, float(fwhm) * eh.RADPERUAS
    t = time.perf_counter()
    obs = eh.obsdata.load_uvfits(f, remove_nan=True)
    t_load = time.perf_counter() - t
    scan = "sample" not in f
    if scan:  # real EHT data: averaged over scans, with 2 % systematic noise, without the baselines inside one site
        obs.add_scans()
        obs = obs.avg_coherent(0.0, scan_avg=True)
        obs = obs.add_fractional_noise(0.02)
        obs = obs.flag_uvdist(uv_min=0.1e9)
    flux = float(flux)
    prior = eh.image.make_square(obs, npix, fov).add_gauss(flux, (fwhm, fwhm, 0, 0, 0))
    # The start is slightly asymmetric. The closure phases of a symmetric start have no gradient.
    prior = prior.add_gauss(flux * 1e-2, (fwhm, fwhm, 0, fwhm, fwhm))
    res = obs.res()
    # sample.uvfits has antenna gain errors in phase and amplitude, so only closure quantities are used.
    # The public M87 data have calibrated amplitudes: these are used with a low weight, together with closure quantities.
    sample = "sample" in f
    dt = {"cphase": 100, "logcamp": 100} if sample else {"amp": 20, "cphase": 100, "logcamp": 100}
    reg = {ent: 1, "flux": 100, "cm": 50} if sample else {ent: 100, "flux": 1000, "cm": 100, "tv2": 50}
    im, ts = prior, []
    for k in range(3):
        imgr = eh.imager.Imager(obs, im.blur_circ(res) if k else prior, prior, flux, data_term=dt, reg_term=reg, maxit=150, ttype="direct", norm_reg=True)
        t = time.perf_counter()
        im = imgr.make_image_I(show_updates=False, grads=True)
        ts.append(time.perf_counter() - t)
    chi = {}
    for d in ("vis", "amp", "cphase", "logcamp"):
        try:
            chi[d] = float(obs.chisq(im, dtype=d, ttype="direct"))
        except Exception as e:
            chi[d] = str(e)[:80]
    im.save_fits(pre + ".fits")
    import matplotlib.pyplot as plt
    plt.figure(figsize=(5, 5))
    plt.imshow(im.imvec.reshape(npix, npix), cmap="afmhot")
    plt.title(f"{pre.split('/')[-1]} {ent} fov {npix}px")
    plt.savefig(pre + ".png", dpi=70)
    r = dict(load_s=t_load, imaging_s=sum(ts), rounds=[round(x, 3) for x in ts], chi2=chi, nvis=len(obs.data), flux=float(im.total_flux()), prior_flux=flux,
             peak=float(im.imvec.max()), clean_beam_uas=float(res / eh.RADPERUAS), version=getattr(eh, "__version__", "1.3.2"))
elif what == "obs":
    arr, model, pre = sys.argv[2:5]
    array = eh.array.load_txt(arr)
    im = eh.image.load_txt(model)
    r = {}
    for ttype in ("direct", "fast", "nfft"):
        try:
            t = time.perf_counter()
            o = im.observe(array, 5, 60, 0, 24, 4e9, ttype=ttype, sgrscat=False, ampcal=True, phasecal=True, add_th_noise=True, verbose=False)
            r[ttype] = dict(s=time.perf_counter() - t, nvis=len(o.data))
        except Exception as e:
            r[ttype] = str(e)[:120]
    o.save_uvfits(pre + ".uvfits")
print("RESULT " + json.dumps(r), flush=True)
