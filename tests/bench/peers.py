"""Compare the processor times of cittert, ducc0 and WSClean in one run on one machine, and print a table of ratios. peers.sh starts this script.

Each comparison runs the two programs in turn and takes the least processor time of each, because other work on the machine only adds time."""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

import numpy as np

WL = os.environ["CITTERT_WL"]
WORKLOADS = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "peers", "workloads")
CITTERT, CORE = os.environ["CITTERT"], os.environ["CITTERT_CORE"]
ARCSEC = np.pi / 180 / 3600
GEOMETRY = {"a": (512, 0.25), "b": (2048, 0.25), "c": (512, 6.0e-4 / ARCSEC)}
WSCLEAN = shutil.which("wsclean")


def run(words, folder):
    """Processor seconds, resident MiB and output of a command."""
    log = tempfile.TemporaryFile("w+")
    env = {**os.environ, "OMP_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "1"}
    process = subprocess.Popen([str(w) for w in words], cwd=folder, stdout=log, stderr=subprocess.PIPE, text=True, env=env)
    errors = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    log.seek(0)
    out = log.read()
    if status:
        sys.exit(f"bench: failed: {' '.join(map(str, words))}\n{out[-2000:]}{errors[-2000:]}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, out


def alternate(turns, *works):
    """The least value that each of the functions `works` returns over some turns, in alternating order."""
    best = [None] * len(works)
    for turn in range(turns):
        order = range(len(works)) if turn % 2 == 0 else reversed(range(len(works)))
        for k in order:
            value = works[k]()
            best[k] = value if best[k] is None else min(best[k], value)
    return best


class Table:
    def __init__(self):
        self.rows = []

    def add(self, what, ours, peer, wanted, note=""):
        ratio = f"{peer / ours:.2f}" if peer else ""
        held = "" if wanted is None or not peer else ("yes" if peer / ours >= wanted else "NO")
        row = (what, f"{ours:.3f}", f"{peer:.3f}" if peer else "not installed", ratio, "" if wanted is None else f"{wanted:.2f}", held, note)
        self.rows.append(row)
        print("  ".join(x for x in row if x), flush=True)

    def show(self):
        head = ("work", "cittert, CPU s", "peer, CPU s", "peer / cittert", "at least", "holds", "note")
        widths = [max(len(r[k]) for r in [head, *self.rows]) for k in range(len(head))]
        line = lambda r: "| " + " | ".join(x.ljust(w) for x, w in zip(r, widths)) + " |"
        print("\n" + line(head) + "\n|" + "|".join("-" * (w + 2) for w in widths) + "|")
        print("\n".join(map(line, self.rows)))


def visibilities(name):
    """uvw, frequencies and Stokes I of a workload in single precision."""
    sys.path.insert(0, WORKLOADS)
    import offline  # noqa: F401  (before pyuvdata: astropy must not look for a network)
    from pyuvdata import UVData

    uv = UVData()
    uv.read_uvh5(os.path.join(WL, name + ".uvh5"), run_check=False)
    return uv.uvw_array, uv.freq_array.ravel(), uv.data_array.mean(axis=2).astype(np.complex64)


def gridding(table, folder, turns):
    try:
        os.environ.pop("OMP_NUM_THREADS", None)  # ducc0 never uses more threads than this
        os.environ["DUCC0_NUM_THREADS"] = "2"
        import ducc0
    except ImportError:
        ducc0 = None
    for name, (n, cell) in GEOMETRY.items():
        core = lambda: json.loads(run([CORE, "transform", os.path.join(WL, name + ".uvh5"), n, repr(cell), "1e-5", 3], folder)[2])
        ours, ducc = [], {"to_image": [], "from_image": []}
        data = visibilities(name) if ducc0 else None
        for _ in range(turns):
            ours.append(core())
            if not ducc0:
                continue
            uvw, freq, vis = data
            geometry = dict(uvw=uvw, freq=freq, pixsize_x=cell * ARCSEC, pixsize_y=cell * ARCSEC, flip_u=True, flip_v=True, divide_by_n=False,
                            epsilon=1e-5, nthreads=1, do_wgridding=True)
            start = time.process_time()
            image = ducc0.wgridder.vis2dirty(vis=vis, npix_x=n, npix_y=n, **geometry)
            ducc["to_image"].append(time.process_time() - start)
            image = np.ascontiguousarray(image / vis.size)
            start = time.process_time()
            ducc0.wgridder.dirty2vis(dirty=image, **geometry)
            ducc["from_image"].append(time.process_time() - start)
        for way, text in (("to_image", "visibilities to image"), ("from_image", "image to visibilities")):
            mine = min(o["threads_1"][way]["cpu_s"] for o in ours)
            rate = ours[0]["n_vis"] / mine / 1e6
            table.add(f"{name}: {text}, 1e-5, f32, 1 thread", mine, min(ducc[way], default=None), 1.0, f"{rate:.1f} million a second")
            one, two = (min(o[t][way]["wall_s"] for o in ours) for t in ("threads_1", "threads_2"))
            table.add(f"{name}: {text}, 2 threads against 1 (wall)", two, one, 1.7)


def wsclean(folder, *words):
    n, cell = GEOMETRY["b"]
    base = [WSCLEAN, "-j", 2, "-size", n, n, "-scale", f"{cell:.9f}asec", "-pol", "I", "-no-update-model-required", "-name", "ws"]
    return run([*base, *words, os.path.join(WL, "b.ms")], folder)[0]


def dirty(table, folder, turns):
    n, cell = GEOMETRY["b"]
    ours = lambda: run([CITTERT, "dirty", os.path.join(WL, "b.uvh5"), "--size", n, "--cell", f"{cell}arcsec", "--weighting", "natural",
                        "-o", "dirty.fits", "--overwrite"], folder)[0]
    works = [ours] + ([lambda: wsclean(folder, "-weight", "natural", "-niter", 0)] if WSCLEAN else [])
    best = alternate(turns, *works)
    table.add("b: dirty image, whole program, cittert exact, WSClean's default", best[0], best[1] if WSCLEAN else None, 1 / 0.35)


def plane(path):
    from astropy.io import fits

    return fits.getdata(path).squeeze().astype(float)


def minor(table, folder, name):
    """Components on WSClean's own beam and dirty image; its time is that of a run with them less one without."""
    if not WSCLEAN:
        return
    briggs = ["-weight", "briggs", 0, "-mgain", 1.0, "-gain", 0.1] + (["-no-fast-subminor"] if name == "hogbom" else [])
    without = wsclean(folder, *briggs, "-niter", 1)
    peer = wsclean(folder, *briggs, "-niter", 10000) - without
    said = json.loads(run([CORE, "minor", name, "ws-psf.fits", "ws-dirty.fits", 10000, "ours-model.fits"], folder)[2])
    theirs, ours = plane(os.path.join(folder, "ws-model.fits")), plane(os.path.join(folder, "ours-model.fits"))
    apart = np.abs(theirs - ours).max() / np.abs(theirs).max()
    note = f"models differ by {apart:.1e} of the brightest; flux {ours.sum():.4f} and {theirs.sum():.4f} Jy"
    wanted = 10.0 if name == "hogbom" else 1.5
    table.add(f"b: 10,000 components, {name}", said["cpu_s"], peer, wanted, note)


def clean(table, folder, turns):
    n, cell = GEOMETRY["b"]
    ours = lambda: run([CITTERT, "clean", os.path.join(WL, "b.uvh5"), "--size", n, "--cell", f"{cell}arcsec", "--weighting", "briggs", "--robust", 0,
                        "--algorithm", "clark", "--niter", 10000, "--mgain", 0.85, "-o", "ours", "--overwrite"], folder)[0]
    peer = lambda: wsclean(folder, "-weight", "briggs", 0, "-niter", 10000, "-mgain", 0.85, "-gain", 0.1)
    best = alternate(turns, *([ours, peer] if WSCLEAN else [ours]))
    rms = lambda prefix: plane(os.path.join(folder, prefix + "-residual.fits")).std()
    note = f"residual rms {rms('ours'):.4e}" + (f" and {rms('ws'):.4e} Jy" if WSCLEAN else " Jy")
    table.add("b: whole CLEAN, 10,000 components, Briggs 0", best[0], best[1] if WSCLEAN else None, 1 / 0.35, note)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", default="grid,dirty,hogbom,clark,clean")
    parser.add_argument("--turns", type=int, default=2)
    a = parser.parse_args()
    table = Table()
    with tempfile.TemporaryDirectory() as folder:
        for name in a.only.split(","):
            if name == "grid":
                gridding(table, folder, a.turns)
            elif name in ("hogbom", "clark"):
                minor(table, folder, name)
            else:
                {"dirty": dirty, "clean": clean}[name](table, folder, a.turns)
    table.show()


main()
