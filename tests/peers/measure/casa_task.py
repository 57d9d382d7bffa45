#!/usr/bin/env python
"""Run one CASA job in one process and print a line of JSON with the seconds inside each task.

  casa_task.py image <ms> <name> <npix> <cell_arcsec> <deconvolver> <niter> <weighting> [extra k=v ...]
  casa_task.py selfcal <ms> <name> <npix> <cell_arcsec> <rounds>
  casa_task.py fits <image> <out.fits>
"""
import glob
import json
import os
import shutil
import sys
import time

from casatasks import applycal, casalog, clearcal, exportfits, gaincal, imstat, tclean

casalog.filter("WARN")


def clear(name):
    for f in glob.glob(name + ".*"):
        if os.path.isdir(f):
            shutil.rmtree(f)


def image(ms, name, npix, cell, dec, niter, weighting="briggs", **k):
    clear(name)
    t = time.perf_counter()
    o = dict(vis=ms, imagename=name, imsize=npix, cell=f"{cell}arcsec", specmode="mfs", gridder="standard", deconvolver=dec,
             weighting=weighting, robust=0.0, niter=niter, gain=0.1, cyclefactor=1.0, datacolumn="data", pblimit=-1.0,
             stokes="I", savemodel="none", interactive=False, calcpsf=True)
    if dec == "multiscale":
        o["scales"] = [0, 5, 15, 45]
    o.update(k)
    r = tclean(**o)
    dt = time.perf_counter() - t
    out = dict(tclean_s=dt)
    if isinstance(r, dict):
        out.update({q: r[q] for q in ("iterdone", "nmajordone", "stopcode") if q in r})
    out = {q: (int(v) if hasattr(v, "item") else v) for q, v in out.items()}
    return out


def stats(name):
    import numpy as np
    from casatools import image as ia_
    ia = ia_()
    ia.open(name + ".image")
    im = ia.getchunk().squeeze()
    ia.close()
    ia.open(name + ".residual")
    re = ia.getchunk().squeeze()
    ia.close()
    mad = 1.4826 * np.median(np.abs(re - np.median(re)))
    return dict(peak=float(im.max()), resid_rms=float(re.std()), resid_mad=float(mad), resid_absmax=float(abs(re).max()),
                dr_peak_over_rms=float(im.max() / re.std()))


def main():
    what = sys.argv[1]
    if what == "image":
        ms, name, npix, cell, dec, niter, w = sys.argv[2:9]
        extra = dict(x.split("=", 1) for x in sys.argv[9:])
        extra = {k: (json.loads(v) if v[0] in "[0123456789-{tf" else v) for k, v in extra.items()}
        r = image(ms, name, int(npix), float(cell), dec, int(niter), w, **extra)
        r.update(stats(name))
    elif what == "selfcal":
        ms, name, npix, cell, rounds = sys.argv[2:7]
        r = dict(steps=[])
        img = lambda nm, n, col, sm: image(ms, nm, int(npix), float(cell), "hogbom", n, "briggs", datacolumn=col, savemodel=sm)
        clearcal(vis=ms, addmodel=True)
        # CLEAN goes deeper in each round. The injected phases are constant for 60 s, so the interpolation is nearest: CASA's default,
        # linear, makes the rms phase error five times larger.
        for k in range(int(rounds) + 1):
            nit = (100, 1000, 5000, 5000)[min(k, 3)]
            i = img(f"{name}_{k}", nit, "data" if k == 0 else "corrected", "modelcolumn" if k < int(rounds) else "none")
            i.update(stats(f"{name}_{k}"), round=k)
            if k < int(rounds):
                tab = f"{name}_{k}.gcal"
                shutil.rmtree(tab, ignore_errors=True)
                t = time.perf_counter()
                gaincal(vis=ms, caltable=tab, solint="60s", refant="ea01", calmode="p", gaintype="T", minsnr=1.0)
                i["gaincal_s"] = time.perf_counter() - t
                t = time.perf_counter()
                applycal(vis=ms, gaintable=[tab], interp=["nearest"], calwt=False)
                i["applycal_s"] = time.perf_counter() - t
            r["steps"].append(i)
    elif what == "fits":
        exportfits(imagename=sys.argv[2], fitsimage=sys.argv[3], overwrite=True, dropdeg=False)
        r = {}
    print("RESULT " + json.dumps(r), flush=True)


main()
