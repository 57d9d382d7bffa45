#!/usr/bin/env python
"""Time WSClean. usage: wsclean_bench.py [-n 3] a b c [--only substring]"""
import argparse
import datetime as dt
import os
import re
import shutil

from bench import GEOM, WL, WORK, many, save

ap = argparse.ArgumentParser()
ap.add_argument("wl", nargs="*", default=["a"])
ap.add_argument("-n", type=int, default=3)
ap.add_argument("-j", type=int, default=2)
ap.add_argument("--only", default="")
a = ap.parse_args()


def split(log):
    """Seconds of each stage from a log with -log-time: the sums that WSClean prints, and the minor cycles and gridding by their time stamps."""
    t = []
    for line in log.splitlines():
        m = re.match(r"(\d{4}-\w{3}-\d\d \d\d:\d\d:\d\d\.\d+) (.*)", line)
        if m:
            t.append((dt.datetime.strptime(m.group(1), "%Y-%b-%d %H:%M:%S.%f").timestamp(), m.group(2)))
    s = dict(minor=0.0, degrid=0.0, grid=0.0)
    for (t0, x), (t1, _) in zip(t, t[1:]):
        if x.startswith("Initial peak") or x.startswith("Performed") or "Next major" in x or "Starting multi-scale" in x:
            s["minor"] += t1 - t0
        if "Predicting" in x or "Degridding" in x:
            s["degrid"] += t1 - t0
        if x.startswith("Gridding"):
            s["grid"] += t1 - t0
    for k in ("Inversion", "prediction", "deconvolution"):
        m = re.search(k + r": (\d+):(\d+):([\d.]+)", log)
        if m:
            s[k.lower()] = int(m.group(1)) * 3600 + int(m.group(2)) * 60 + float(m.group(3))
    m = re.findall(r"Performed (\d+) iterations", log)
    s["iterations"] = int(m[-1]) if m else 0
    m = re.findall(r"(\d+) major iterations were performed", log)
    s["major"] = int(m[-1]) if m else 0
    return s


ENV = {"OMP_NUM_THREADS": str(a.j), "OPENBLAS_NUM_THREADS": "1"}
rows = []
for w in a.wl:
    n, cell = GEOM[w]
    ms = os.path.join(WL, w + ".ms")
    base = ["wsclean", "-log-time", "-j", a.j, "-size", n, n, "-scale", f"{cell:.9f}asec", "-pol", "I"]
    nu = ["-no-update-model-required"]
    nat, uni, bri = ["-weight", "natural"], ["-weight", "uniform"], ["-weight", "briggs", "0"]
    wg = ["-use-wgridder"]
    prec = ["-use-wgridder", "-wgridder-accuracy", "1e-6", "-padding", "2", "-no-small-inversion"]
    J = {
        "psf-natural": nat + ["-make-psf-only"],
        "dirty-natural": nat + ["-niter", 0],
        "dirty-natural-wgridder": nat + wg + ["-niter", 0],
        "dirty-natural-precise": nat + prec + ["-niter", 0, "-make-psf"],
        "dirty-uniform-precise": uni + prec + ["-niter", 0, "-make-psf"],
        "dirty-briggs0-precise": bri + prec + ["-niter", 0, "-make-psf"],
        "clean1000-briggs0": bri + ["-niter", 1000, "-mgain", 0.85, "-gain", 0.1],
        "clean10000-briggs0": bri + ["-niter", 10000, "-mgain", 0.85, "-gain", 0.1],
        "clean10000-briggs0-wgridder": bri + wg + ["-niter", 10000, "-mgain", 0.85, "-gain", 0.1],
        "hogbom1000-briggs0-1major": bri + ["-niter", 1000, "-mgain", 1.0, "-gain", 0.1, "-no-fast-subminor"],
        "hogbom10000-briggs0-1major": bri + ["-niter", 10000, "-mgain", 1.0, "-gain", 0.1, "-no-fast-subminor"],
        "multiscale1000-briggs0": bri + ["-niter", 1000, "-mgain", 0.85, "-gain", 0.1, "-multiscale"],
    }
    if w == "c":
        J["multiscale5000-natural"] = nat + prec + ["-niter", 5000, "-mgain", 0.85, "-multiscale", "-multiscale-gain", 0.1]
        J["clean10000-natural"] = nat + prec + ["-niter", 10000, "-mgain", 0.85, "-gain", 0.1]
    for k, opt in J.items():
        tag = f"{w}:{k}"
        if not re.search(a.only, tag):
            continue
        rows.append(many(tag, base + nu + opt + ["-name", f"ws_{w}_{k}", ms], a.n, split, env=ENV))
        save("wsclean", rows)
    if re.search(a.only, f"{w}:predict"):
        # -predict reads <name>-model.fits, which is the model of the CLEAN run above. It writes MODEL_DATA, so it works on a copy.
        cp = os.path.join(WORK, w + "_predict.ms")
        shutil.rmtree(cp, ignore_errors=True)
        shutil.copytree(ms, cp)
        src = os.path.join(WORK, f"ws_{w}_clean10000-briggs0-model.fits")
        if os.path.exists(src):
            for k, opt in (("predict", []), ("predict-wgridder", wg)):
                shutil.copy(src, os.path.join(WORK, f"ws_{w}_{k}-model.fits"))
                rows.append(many(f"{w}:{k}", base + opt + ["-predict", "-name", f"ws_{w}_{k}", cp], a.n, split, env=ENV))
                save("wsclean", rows)
