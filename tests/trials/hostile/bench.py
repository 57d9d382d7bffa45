"""A folder with a tiny data set, calls of the program under limits, and the faults that no call may have."""

import math
import os
import random
import re
import shutil
import subprocess
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path

from . import readers

SLOW_S = 10.0
LIMIT_KB = 2_000_000

LAYOUT = 'name = "twelve"\nframe = "boresight"\nsource = "drawn"\n'
EARTH = 'name = "four"\nframe = "enu"\nsource = "drawn"\n[site]\nlatitude_deg = 34.0\nlongitude_deg = -107.6\naltitude_m = 2124.0\n'
IMAGE = "--size 32 --cell 1mrad"
SCENE = """kind = "solids"
name = "post"
freq_hz = 94e9
extrapolate = true
[camera]
position_m = [0, -30, 6]
look_at_m = [0, 0, 1]
fov_deg = 30
size_px = [16, 16]
[atmosphere]
profile = "ussa"
layers = ["fog:0m-200m:0.2g/m3"]
[surface.soil]
layer = [{ material = "soil", moisture = 0.1, temperature_k = 293 }]
roughness = "qh:0.1,0.5,0"
[surface.steel]
layer = [{ material = "paint", thickness_m = 2e-4, temperature_k = 294 }, { material = "steel", temperature_k = 294 }]
[ground]
surface = "soil"
height_m = 0.0
patch = [{ surface = "steel", strip_m = [[-20, 5], [20, 5]], width_m = 2 }]
[assembly.post]
body = [
  { name = "pole", type = "RCC", data = [0, 0, 0, 0, 0, 3, 0.2], surface = "steel" },
  { name = "head", type = "SPH", data = [0, 0, 3, 0.5], surface = "steel", temperature_k = 300 },
]
[[instance]]
assembly = "post"
position_m = [-1, 0, 0]
rotate_deg = [0, 0, 45]
scale = 1.5
"""
FLIGHT = 'scene = "b.toml"\nframes_per_second = 2\n[[key]]\ntime_s = 0\nposition_m = [0, -30, 6]\nlook_at_m = [0, 0, 1]\n' \
    "[[key]]\ntime_s = 0.5\nposition_m = [2, -30, 6]\nlook_at_m = [0, 0, 1]\n"
CHAIN = 'layout = { name = "l.toml" }\nscene = { file = "s.csv" }\n[simulate]\nfreq = "94GHz"\nbandwidth = "8GHz"\nchannels = 2\nsefd = "3000Jy"\n' \
    '[image]\nsize = 32\ncell = "1mrad"\n'
STUDY = "seeds = 1\n" + CHAIN.replace('sefd = "3000Jy"\n', "") + "[clean]\nniter = 20\n" \
    '[corrupt]\nphase-rms = "10deg"\n[[axis]]\nparameter = "corrupt.phase-rms"\nvalues = ["10deg", "20deg"]\n'

# The files of the data set that are texts. The antennas of both layouts are added by `make`.
TEXTS = {
    "s.csv": "l_rad,m_rad,flux_jy,major_rad,minor_rad,pa_rad\n0.003,0.002,1.0,0,0,0\n-0.004,0.001,0.5,0.001,0.0005,0.3\n",
    "x.toml": '[[error]]\nphase-rms = "10deg"\nvariation = "walk:20s"\n[[error]]\namp-rms = 0.1\n',
    "c.toml": 'title = "x"\n' + CHAIN + "[[clean]]\nniter = 20\n",
    "u.toml": 'title = "x"\n' + STUDY,
    "b.toml": SCENE,
    "f.toml": FLIGHT,
    "b.txt": "1 RPP -1 1 -1 1 0 2\nRCC bore  0 0 -1   0 0 4   0.5\nREGION block ; +1 -bore ; steel\nREGION plug ; +bore +1 ; air\n",
    "a.csv": "z_km,p_hpa,t_k,e_hpa\n0,1013,288,10\n5,540,256,2\n10,265,223,0.1\n20,55,217,0.01\n",
    "r.csv": "ox,oy,oz,dx,dy,dz\n-5,0.6,1,1,0,0\n0,0,9,0,0,-1\n",
    "p.csv": "x,y,z\n0.9,0.9,1\n0,0,1\n5,5,5\n",
    "k.toml": "coherent = false\n"
              "[[layer]]\nmaterial = 'paint'\nthickness_m = 2e-4\ntemperature_k = 294.0\n[[layer]]\neps = [4.0, 0.6]\ntemperature_k = 290.0\n",
}

# How the other files are made, in this order.
LINES = [
    "simulate --layout l.toml --scene s.csv --freq 94GHz --bandwidth 8GHz --channels 2 --duration 20s --sefd 3000Jy -o v.uvh5",
    "simulate --layout e.toml --scene s.csv --freq 8GHz --bandwidth 1GHz --channels 2 "
    "--phase-center 10deg,40deg --start 2025-06-01T15:00:00 --duration 1min -o e.uvh5",
    "corrupt v.uvh5 --phase-rms 1rad --amp-rms 0.1 -o c.uvh5 --gains g.calh5",
    "convert v.uvh5 v.uvfits",
    "convert e.uvh5 e.uvfits",
    f"dirty v.uvh5 {IMAGE} -o d.fits",
    f"dirty c.uvh5 {IMAGE} -o t.fits",
    f"clean v.uvh5 {IMAGE} --niter 50 -o m",
    f"mem v.uvh5 {IMAGE} --tolerance 9 --kkt 0.9 -o q",
    "scene render b.toml --scene-size 16 -o k.fits",
    "simulate --layout l.toml --scene k.fits --freq 94GHz --bandwidth 8GHz -o k.uvh5",
    "scene convert b.toml i.toml",
    "layout convert e.toml -o l.cfg",
    "layout convert e.toml --to ehtim -o l.txt",
    "layout convert e.toml --to pyuvsim -o l.csv",
    "layout convert e.toml --to miriad -o l.ant",
]


class Outcome:
    """What one call did."""

    def __init__(self, line, code, out, err, seconds, peak_kb, ended):
        self.line, self.code, self.out, self.err, self.seconds, self.peak_kb, self.ended = line, code, out, err, seconds, peak_kb, ended
        # Much work that makes progress.
        self.long = False

    def faults(self):
        """What no call may do, whatever it was given: (kind, text)."""
        found = []
        if self.long:
            return found
        if not self.ended:
            found.append(("hang", f"no end after {self.seconds:.0f} s, and no word in the last {SLOW_S:.0f} s"))
        elif self.code < 0:
            found.append(("abort", f"ended by signal {-self.code}: {self.err.strip()[-200:]}"))
        elif self.code not in (0, 1, 2) or "panicked" in self.err:
            found.append(("panic", f"exit code {self.code}: {self.err.strip()[-300:]}"))
        elif self.code and not self.err.strip():
            found.append(("silent", f"exit code {self.code} without a word"))
        if self.peak_kb > LIMIT_KB:
            found.append(("memory", f"{self.peak_kb / 1e6:.1f} GB"))
        return found


class Bench:
    def __init__(self, program, limit_s=60.0, seconds=None):
        """A call longer than `limit_s` is killed and counts as one that never ends. Each class draws cases for at most `seconds`."""
        self.limit_s, self.seconds, self.drawn = limit_s, seconds, 0
        self.program = str(Path(program).resolve())
        self.folder = Path(tempfile.mkdtemp(prefix="hostile-"))
        self.out, self.spool = self.folder / "out", Path(tempfile.mkdtemp(prefix="hostile-said-"))
        self.counts, self.reported, self.slowest = Counter(), Counter(), Outcome("", 0, "", "", 0.0, 0, True)
        self.make()

    def make(self):
        rng = random.Random(12)
        rows = [(0.08 * (k + 1) * math.cos(2.4 * k), 0.08 * (k + 1) * math.sin(2.4 * k)) for k in range(12)]
        antenna = '[[antenna]]\nname = "A{}"\nposition_m = [{:.4f}, {:.4f}, 0.0]\ndiameter_m = 0.01\ntsys_k = 600.0\n'
        self.write("l.toml", LAYOUT + "".join(antenna.format(k, x, y) for k, (x, y) in enumerate(rows)))
        antenna = '[[antenna]]\nname = "E{}"\nposition_m = [{:.1f}, {:.1f}, 0.0]\ndiameter_m = 25.0\nsefd_jy = 370.0\n'
        self.write("e.toml", EARTH + "".join(antenna.format(k, rng.uniform(-50, 50), rng.uniform(-50, 50)) for k in range(5)))
        for name, text in TEXTS.items():
            self.write(name, text)
        self.out.mkdir()
        for line in LINES:
            self.whole(line)
        self.inputs = {p.name: p.read_bytes() for p in self.folder.iterdir() if p.is_file()}

    def write(self, name, text):
        (self.folder / name).write_text(text)

    def whole(self, line):
        """Make a call that must succeed."""
        done = self.call(line.split())
        if done.code:
            raise SystemExit(f"{done.line}: {done.err}")
        return done

    def start(self, words, tag="one", quiet=True):
        """Start a call. Its words go to files, so that no pipe is held open by a child of the child."""
        flags = ["-q"] if quiet else []
        out, err = open(self.spool / f"{tag}.out", "wb"), open(self.spool / f"{tag}.err", "wb")
        with out, err:
            process = subprocess.Popen([self.program, *flags, *words], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err)
        process.begun, process.tag = time.monotonic(), tag
        process.line = " ".join(["cittert", *flags, *("''" if w == "" else f"'{w}'" if re.search(r"[^\w./:,=@%+-]", w) else w for w in words)])
        return process

    def finish(self, process):
        overdue = threading.Event()
        timer = threading.Timer(self.limit_s, lambda: (overdue.set(), process.kill()))
        timer.start()
        _, status, usage = os.wait4(process.pid, 0)
        timer.cancel()
        seconds = time.monotonic() - process.begun
        process.returncode = os.waitstatus_to_exitcode(status)
        out, err = ((self.spool / f"{process.tag}.{kind}").read_text(errors="replace") for kind in ("out", "err"))
        done = Outcome(process.line, process.returncode, out, err, seconds, usage.ru_maxrss, not overdue.is_set())
        if seconds > self.slowest.seconds:
            self.slowest = done
        if SLOW_S < seconds and done.ended:
            print(f"slow  {seconds:.0f} s  {done.line}", flush=True)
        return done

    def call(self, words):
        done = self.finish(self.start(words))
        if not done.ended and self.progresses(words):
            # Much work is no failure, where it is told.
            self.counts["long, with progress"] += 1
            print(f"long  {done.line}", flush=True)
            done.long = True
        return done

    def progresses(self, words):
        """Make a call that did not end once more, and see whether it says something in its last 10 s."""
        self.clear()
        self.finish(self.start(words, tag="again", quiet=False))
        return time.time() - (self.spool / "again.err").stat().st_mtime < SLOW_S

    def cases(self, count):
        """The numbers of the cases of a class, until its time is over."""
        begun, self.drawn = time.monotonic(), 0
        while self.drawn < count and (self.seconds is None or time.monotonic() - begun < self.seconds):
            yield self.drawn
            self.drawn += 1

    def must_work(self, words):
        """A line to which something hostile is added later: without it the call succeeds."""
        done = self.call(words)
        if done.code or done.faults():
            self.fail("plain", done.line, f"a right call fails: {done.err.strip()[:300]}")
        self.clear()

    def fail(self, kind, line, text, key=None):
        """Print a failure. Further ones of the same key are counted only."""
        self.counts[f"failed: {kind}"] += 1
        key = (kind, key or line)
        self.reported[key] += 1
        if self.reported[key] == 1:
            print(f"FAIL {kind}  {line}  # {' '.join(text.split())[:400]}", flush=True)

    def clear(self):
        """Empty the folder of outputs."""
        if any(self.out.iterdir()):
            shutil.rmtree(self.out)
            self.out.mkdir()

    def restore(self):
        """Put inputs back that have changed and remove what is new. Returns the names of both."""
        odd = []
        for path in self.folder.iterdir():
            if path == self.out:
                continue
            if path.is_symlink() or path.name not in self.inputs:
                odd.append(path.name)
                shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()
        for name, was in self.inputs.items():
            path = self.folder / name
            if not path.is_file() or path.read_bytes() != was:
                odd.append(name)
                path.write_bytes(was)
        return odd

    def listing(self):
        """All names in the folder: for a link where it leads, for the other name of an input its number, else nothing."""
        number = {(self.folder / name).stat().st_ino: name for name in self.inputs if (self.folder / name).exists()}
        return {str(p.relative_to(self.folder)): os.readlink(p) if p.is_symlink() else number.get(p.stat().st_ino, "") for p in self.folder.rglob("*")}

    def left(self):
        """Hidden leftovers in the folder of outputs."""
        return sorted(p.name for p in self.out.iterdir() if p.name.startswith(".") and p.name != ".cittert-files")

    def check_results(self):
        """What is wrong with the files in the folder of outputs: (kind, text)."""
        found = []
        for path in sorted(p for p in self.out.rglob("*") if p.is_file()):
            text = readers.fault(path, lambda p: self.call(["--json", "info", str(p)]))
            found += [("result", f"{path.relative_to(self.folder)}: {text}")] if text else []
        return found

    def close(self):
        shutil.rmtree(self.folder)
        shutil.rmtree(self.spool)
