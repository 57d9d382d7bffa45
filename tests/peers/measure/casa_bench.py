#!/usr/bin/env python
"""Time the CASA tasks tclean, gaincal and applycal. usage: casa_bench.py [-n 3] a b c d [--only substring]"""
import argparse
import json
import os
import re
import shutil

from bench import GEOM, HERE, PY, WL, WORK, many, save

ap = argparse.ArgumentParser()
ap.add_argument("wl", nargs="*", default=["a"])
ap.add_argument("-n", type=int, default=3)
ap.add_argument("--only", default="")
ap.add_argument("--threads", default="1")
a = ap.parse_args()
env = {"OMP_NUM_THREADS": a.threads}
T = [PY, os.path.join(HERE, "casa_task.py")]


def parse(out):
    r = [x for x in out.splitlines() if x.startswith("RESULT ")]
    return json.loads(r[-1][7:]) if r else None


rows = []
for w in a.wl:
    n, cell = GEOM[w]
    ms = os.path.join(WL, w + ".ms")
    if w == "d":
        tag = "d:selfcal3"
        if re.search(a.only, tag):
            cp = os.path.join(WORK, "d_selfcal.ms")

            def prep():
                shutil.rmtree(cp, ignore_errors=True)
                shutil.copytree(ms, cp)

            rows.append(many(tag, T + ["selfcal", cp, "casa_d_selfcal", n, cell, 3], a.n, parse, prep, env))
            save("casa", rows)
        for tag, m in (("d:uncorrupted-hogbom5000", "a"), ("d:corrupted-hogbom5000", "d")):
            if re.search(a.only, tag):
                rows.append(many(tag, T + ["image", os.path.join(WL, m + ".ms"), f"casa_{m}_ref5000", n, cell, "hogbom", 5000, "briggs"], a.n, parse, env=env))
                save("casa", rows)
        continue
    J = {"dirty-natural": ("hogbom", 0, "natural"), "dirty-uniform": ("hogbom", 0, "uniform"), "dirty-briggs0": ("hogbom", 0, "briggs"),
         "hogbom1000-briggs0": ("hogbom", 1000, "briggs"), "clark1000-briggs0": ("clark", 1000, "briggs"),
         "hogbom10000-briggs0": ("hogbom", 10000, "briggs"), "clark10000-briggs0": ("clark", 10000, "briggs"),
         "multiscale1000-briggs0": ("multiscale", 1000, "briggs"), "mem-briggs0": ("mem", 30, "briggs")}
    if w == "c":
        J["mem-natural"] = ("mem", 50, "natural")
        J["multiscale5000-natural"] = ("multiscale", 5000, "natural")
    for k, (dec, nit, wt) in J.items():
        tag = f"{w}:{k}" + ("" if a.threads == "1" else f":t{a.threads}")
        if not re.search(a.only, tag):
            continue
        rows.append(many(tag, T + ["image", ms, f"casa_{w}_{k}", n, cell, dec, nit, wt], a.n, parse, env=env))
        print("     ", rows[-1]["parsed"][-1], rows[-1].get("tail", "")[-300:], flush=True)
        save("casa", rows)
