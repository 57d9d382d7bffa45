#!/usr/bin/env python
"""Find out which peers can read a UVFITS file, and whether its image by CASA importuvfits and WSClean equals the true dirty image.

  roundtrip.py [file.uvfits workload] ...

Without arguments the files are those of pyuvdata and of CASA for workloads a and c."""
import os
import shutil
import subprocess
import sys

from bench import GEOM, HERE, PY, WL, WORK, WORKLOADS


def py(code):
    p = subprocess.run([PY, "-c", f"import sys; sys.path.insert(0,{WORKLOADS!r})\n" + code], cwd=WORK, capture_output=True, text=True)
    o = (p.stdout + p.stderr).strip().splitlines()
    bad = [x for x in o if "SEVERE" in x or "Error" in x or "xception" in x]
    return p.returncode, (bad or o or [""])[-1][-230:]


jobs = [(sys.argv[i], sys.argv[i + 1]) for i in range(1, len(sys.argv), 2)]
if not jobs:
    for w in ("a", "c"):
        out = os.path.join(WORK, f"{w}_casa.uvfits")
        print(w, "CASA exportuvfits", py(f"from casatasks import exportuvfits\nexportuvfits(vis={os.path.join(WL, w + '.ms')!r}, fitsfile={out!r}, datacolumn='data', overwrite=True)"))
        jobs += [(os.path.join(WL, w + ".uvfits"), w), (out, w)]
for f, w in jobs:
    print("==", f)
    print("   header  ", py(f"from astropy.io import fits\nh=fits.getheader({f!r})\nprint('BITPIX', h['BITPIX'], [h.get('CTYPE%d'%i) for i in range(2,8)], [h.get('PTYPE%d'%i) for i in range(1,10)])")[1])
    print("   pyuvdata", py(f"import offline\nfrom pyuvdata import UVData\nu=UVData(); u.read({f!r}); print('ok', u.Nblts, u.Nfreqs, u.Npols, abs(u.data_array).sum())"))
    print("   ehtim   ", py(f"import offline\nimport ehtim as eh\no=eh.obsdata.load_uvfits({f!r}); print('ok', len(o.data))"))
    ms = os.path.join(WORK, f"{w}_imported.ms")
    shutil.rmtree(ms, ignore_errors=True)
    rc, o = py(f"from casatasks import importuvfits\nimportuvfits(fitsfile={f!r}, vis={ms!r})")
    print("   importuvfits", rc, o)
    if not os.path.exists(ms) or w not in GEOM:
        continue
    n, cas = GEOM[w]
    name = f"rt_{w}"
    p = subprocess.run(["wsclean", "-j", "2", "-size", str(n), str(n), "-scale", f"{cas:.9f}asec", "-weight", "natural", "-niter", "0", "-use-wgridder", "-wgridder-accuracy", "1e-6", "-padding", "2",
                        "-no-small-inversion", "-no-update-model-required", "-name", name, ms], cwd=WORK, capture_output=True, text=True)
    print("   wsclean rc", p.returncode, "" if p.returncode == 0 else p.stdout[-300:])
    if p.returncode == 0:
        subprocess.run([PY, os.path.join(HERE, "quality.py"), "dirty", w, os.path.join(WORK, name + "-dirty.fits")])
