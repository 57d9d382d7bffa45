#!/usr/bin/env python
"""Time ehtim. usage: ehtim_bench.py [-n 3]

The variable EHTDATA names a folder with the files sample.uvfits, eht_095_lo.uvfits, EHT2017.txt, avery_sgra_eofn.txt"""
import argparse
import json
import os

from bench import HERE, PY, many, save

ap = argparse.ArgumentParser()
ap.add_argument("-n", type=int, default=3)
ap.add_argument("--only", default="")
a = ap.parse_args()
D = os.environ.get("EHTDATA", ".")
T = [PY, os.path.join(HERE, "ehtim_task.py")]
env = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}


def parse(out):
    r = [x for x in out.splitlines() if x.startswith("RESULT ")]
    return json.loads(r[-1][7:]) if r else None


J = {"sample-gs": ["mem", f"{D}/sample.uvfits", "ehtim_sample_gs", "gs", 32, 160, 80, 2.45],
     "sample-simple": ["mem", f"{D}/sample.uvfits", "ehtim_sample_simple", "simple", 32, 160, 80, 2.45],
     "m87-simple": ["mem", f"{D}/eht_095_lo.uvfits", "ehtim_m87_simple", "simple", 32, 128, 40, 0.6],
     "m87-gs": ["mem", f"{D}/eht_095_lo.uvfits", "ehtim_m87_gs", "gs", 32, 128, 40, 0.6],
     "observe": ["obs", f"{D}/EHT2017.txt", f"{D}/avery_sgra_eofn.txt", "ehtim_obs"]}
rows = []
for k, args in J.items():
    if a.only in k:
        rows.append(many(k, T + args, a.n, parse, env=env))
        print("   ", json.dumps(rows[-1]["parsed"][-1]), rows[-1].get("tail", ""), flush=True)
        save("ehtim", rows)
