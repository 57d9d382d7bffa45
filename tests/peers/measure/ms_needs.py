#!/usr/bin/env python
"""Find out what each peer needs in a Measurement Set.

The script takes workload c's Measurement Set, removes one subtable, keyword or column at a time, and lets each peer read or image it.
ms_needs.json in $CITTERT_RES then holds, for each removal, "ok" or the last error line of WSClean, CASA tclean and pyuvdata."""
import json
import os
import shutil
import subprocess
import sys

from casacore.tables import table

from bench import GEOM, HERE, PY, RES, WL, WORK, WORKLOADS

src = os.path.join(WL, "c.ms")
n, cas = GEOM["c"]
ms = os.path.join(WORK, "needs.ms")
t = table(src, ack=False)
subs = [k for k in t.getkeywords() if str(t.getkeyword(k)).startswith("Table:")]
cols = [c for c in t.colnames() if c not in ("DATA",)]
t.close()
todo = [("nothing", None, None)] + [("subtable", s, None) for s in subs] + [("column", c, None) for c in cols]
for sub, col in (("SPECTRAL_WINDOW", c) for c in ("TOTAL_BANDWIDTH", "REF_FREQUENCY", "MEAS_FREQ_REF", "EFFECTIVE_BW", "RESOLUTION", "CHAN_WIDTH", "NAME")):
    todo.append(("subcolumn", sub, col))
for sub, col in (("FIELD", "DELAY_DIR"), ("FIELD", "REFERENCE_DIR"), ("FIELD", "SOURCE_ID"), ("ANTENNA", "DISH_DIAMETER"), ("ANTENNA", "MOUNT"), ("ANTENNA", "STATION"),
                 ("POLARIZATION", "CORR_PRODUCT"), ("OBSERVATION", "TIME_RANGE"), ("OBSERVATION", "TELESCOPE_NAME")):
    todo.append(("subcolumn", sub, col))
for col in ("TIME", "UVW"):
    todo.append(("measinfo", col, None))
todo.append(("rows", "FEED", None))
todo.append(("rows", "POINTING", None))
todo.append(("rows", "SOURCE", None))
todo.append(("version", "MS_VERSION", None))


def last(out):
    x = [l.strip() for l in out.splitlines() if l.strip() and not set(l.strip()) <= set("+ =.")]
    k = [l for l in x if any(w in l for w in ("xception", "Error", "rror:", ">>>", "SEVERE", "does not exist", "invalid", "nsupported"))]
    return ((k or x or ["?"])[-1])[-220:]


res = []
only = sys.argv[1] if len(sys.argv) > 1 else ""
for what, a, b in todo:
    if only and only not in f"{what} {a} {b}":
        continue
    shutil.rmtree(ms, ignore_errors=True)
    shutil.copytree(src, ms)
    try:
        t = table(ms, readonly=False, ack=False)
        if what == "subtable":
            t.removekeyword(a)
            shutil.rmtree(os.path.join(ms, a), ignore_errors=True)
        elif what == "column":
            t.removecols([a])
        elif what == "subcolumn":
            s = table(os.path.join(ms, a), readonly=False, ack=False)
            s.removecols([b])
            s.close()
        elif what == "measinfo":
            t.removecolkeyword(a, "MEASINFO")
        elif what == "rows":
            s = table(os.path.join(ms, a), readonly=False, ack=False)
            s.removerows(list(range(s.nrows())))
            s.close()
        elif what == "version":
            t.removekeyword(a)
        t.close()
    except Exception as e:
        res.append(dict(removed=f"{what} {a} {b or ''}".strip(), note="cannot be removed: " + str(e)[:100]))
        continue
    r = dict(removed=f"{what} {a or ''} {b or ''}".strip())
    p = subprocess.run(["wsclean", "-j", "1", "-size", "64", "64", "-scale", f"{cas:.6f}asec", "-niter", "0", "-weight", "natural", "-no-update-model-required", "-name", "needs_ws", ms], cwd=WORK, capture_output=True, text=True)
    r["wsclean"] = "ok" if p.returncode == 0 else last(p.stdout + p.stderr)
    p = subprocess.run([PY, os.path.join(HERE, "casa_task.py"), "image", ms, "needs_casa", "64", str(cas), "hogbom", "0", "natural"], cwd=WORK, capture_output=True, text=True, env={**os.environ, "OMP_NUM_THREADS": "1"})
    r["casa"] = "ok" if "RESULT" in p.stdout else last(p.stdout + p.stderr)
    p = subprocess.run([PY, "-c", f"import sys; sys.path.insert(0,{WORKLOADS!r}); import offline; from pyuvdata import UVData; u=UVData(); u.read({ms!r}); print('fine', u.Nblts)"], cwd=WORK, capture_output=True, text=True)
    r["pyuvdata"] = "ok" if "fine" in p.stdout else last(p.stdout + p.stderr)
    res.append(r)
    print(json.dumps(r), flush=True)
    json.dump(res, open(os.path.join(RES, "ms_needs.json"), "w"), indent=1)
