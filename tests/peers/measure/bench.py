"""Run a command n times under /usr/bin/time -v, and keep the results as JSON. The other scripts of this folder import this module.

$PEERS/env.sh sets the folders:
CITTERT_WL    the workloads
CITTERT_RES   the results as JSON
CITTERT_WORK  scratch files
"""
import json
import os
import re
import statistics as st
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
WORKLOADS = os.path.join(os.path.dirname(HERE), "workloads")
sys.path.insert(0, WORKLOADS)  # for `import offline`
try:
    WL, RES, WORK = (os.path.abspath(os.environ[k]) for k in ("CITTERT_WL", "CITTERT_RES", "CITTERT_WORK"))
except KeyError as e:
    sys.exit(f"{e} is not set: run `. $PEERS/env.sh` first, which tests/peers/setup.sh writes")
PY = os.environ.get("CITTERT_PY", sys.executable)
for d in (RES, WORK):
    os.makedirs(d, exist_ok=True)

GEOM = {  # image size, cell in arcsec
    "a": (512, 0.25), "d": (512, 0.25), "b": (2048, 0.25), "c": (512, 6.0e-4 * 206264.80624709636),
}


def once(cmd, cwd=None, env=None, shell=False):
    with tempfile.NamedTemporaryFile("r", suffix=".time") as tf:
        load = os.getloadavg()[0]
        full = ["/usr/bin/time", "-v", "-o", tf.name] + (["bash", "-c", cmd] if shell else list(map(str, cmd)))
        t = time.perf_counter()
        p = subprocess.run(full, cwd=cwd or WORK, env={**os.environ, **(env or {})}, capture_output=True, text=True)
        wall = time.perf_counter() - t
        txt = tf.read()
    g = lambda pat: float(re.search(pat + r": ([\d.]+)", txt).group(1))
    return dict(rc=p.returncode, wall=wall, user=g(r"User time \(seconds\)"), sys=g(r"System time \(seconds\)"),
                rss_mib=g(r"Maximum resident set size \(kbytes\)") / 1024, load=load, out=p.stdout + p.stderr)


def many(tag, cmd, n=3, parse=None, prep=None, env=None, shell=False, quiet=False):
    runs = []
    for _ in range(n):
        if prep:
            prep()
        r = once(cmd, env=env, shell=shell)
        if parse:
            r["parsed"] = parse(r["out"])
        r["tail"] = r.pop("out")[-600:] if r["rc"] else r.pop("out") and ""
        runs.append(r)
        if r["rc"]:
            break
    med = lambda k: st.median(x[k] for x in runs)
    res = dict(tag=tag, cmd=cmd if isinstance(cmd, str) else " ".join(map(str, cmd)), n=len(runs), rc=runs[-1]["rc"],
               wall_s=med("wall"), wall_min=min(x["wall"] for x in runs), wall_all=[round(x["wall"], 3) for x in runs],
               cpu_s=st.median(x["user"] + x["sys"] for x in runs), rss_mib=max(x["rss_mib"] for x in runs),
               load=[round(x["load"], 2) for x in runs], parsed=[x.get("parsed") for x in runs])
    if res["rc"]:
        res["tail"] = runs[-1]["tail"]
    if not quiet:
        print(f"{tag:44s} wall {res['wall_s']:8.3f} s (min {res['wall_min']:.3f})  cpu {res['cpu_s']:8.2f} s  rss {res['rss_mib']:7.0f} MiB  rc {res['rc']} load {res['load']}", flush=True)
    return res


def save(name, rows):
    p = os.path.join(RES, name + ".json")
    old = json.load(open(p)) if os.path.exists(p) else []
    new = {r["tag"]: r for r in old}
    new.update({r["tag"]: r for r in rows})
    json.dump(list(new.values()), open(p, "w"), indent=1)
