"""Outputs on a disk that becomes full: a tmpfs of a random size. The message must say so, the old output must be as it was, and nothing else may be left.
A study alone keeps its journal: the same command goes on from the trials in it.

A tmpfs can be mounted by the administrator alone. Without that the class is skipped, and says so.
"""

import hashlib
import os
import random
import shutil
import subprocess

from .writers import WRITERS


def mount(folder, kilobytes, *more):
    options = ",".join([*more, f"size={kilobytes}k"])
    return subprocess.run(["mount", "-t", "tmpfs", "-o", options, "hostile", str(folder)], capture_output=True).returncode == 0


def taken(folder):
    """The kilobytes that are in use on a disk."""
    facts = os.statvfs(folder)
    return (facts.f_blocks - facts.f_bfree) * facts.f_frsize // 1024


def contents(folder):
    files = (p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def used(folder):
    """What the files need, in kilobytes of whole pages."""
    return sum(4 * -(-p.stat().st_size // 4096) for p in folder.rglob("*") if p.is_file())


def sizes(bench):
    """What the outputs of each writer need. Each writer must work on a disk with space."""
    needs = []
    for writer in WRITERS:
        bench.whole(" ".join(writer.words("out/o")))
        needs.append(used(bench.out))
        bench.clear()
    return needs


def campaign(bench, count, seed):
    disk = bench.folder / "out" / "disk"
    needs = sizes(bench)
    for case in bench.cases(count):
        rng = random.Random(f"disks {seed} {case}")
        k = case % len(WRITERS)
        writer, need = WRITERS[k], needs[k]
        old = rng.random() < 0.5
        # Full before the command begins, and full near its end, are cases of their own.
        room = 4 * int(need / 4 * rng.choice((0.02, rng.uniform(0, 1), 0.95)))
        disk.mkdir()
        if not mount(disk, 100_000):
            bench.counts["skipped: no right to mount a disk"] += 1
            disk.rmdir()
            return
        if old:
            bench.whole(" ".join(writer.words("out/disk/o")))
        # A tmpfs of no size would have no limit.
        mount(disk, max(taken(disk) + room, 4), "remount")
        before = contents(disk)
        words = writer.words("out/disk/o") + (["--overwrite"] if old else [])
        done = bench.call(words)
        after = contents(disk)
        faults = done.faults()
        if done.code == 0:
            faults += bench.check_results() if done.ended else []
            bench.counts["enough space"] += 1
        else:
            bench.counts["full"] += 1
            if "space" not in done.err.lower() and "the disk has" not in done.err:
                faults.append(("message", f"does not speak of space: {done.err.strip()[:300]}"))
            begun = {"o/.cittert-files", "o/journal.jsonl", "o/journal.lock"}
            if words[0] == "study" and not before and set(after) <= begun:
                bench.counts["study begun"] += 1
            elif after != before:
                lost, made = sorted(set(before) - set(after)), sorted(set(after) - set(before))
                faults.append(("left", f"lost {lost}, made {made}, changed {[n for n in before if n in after and before[n] != after[n]]}"))
            elif [p for p in disk.rglob("*") if p.name.startswith(".") and str(p.relative_to(disk)) not in before and p.name.endswith((".partial", ".lock"))]:
                faults.append(("left", f"left {[p.name for p in disk.iterdir()]}"))
        for kind, text in faults:
            disk_is = f"disk of {room} kB and {'the old output' if old else 'no output'}; {need} kB needed"
            bench.fail(kind, f"{done.line} ({disk_is})", text, f"{writer.line} {text[:40]}")
        subprocess.run(["umount", str(disk)], check=True)
        shutil.rmtree(disk)
        odd = bench.restore()
        if odd:
            bench.fail("input", done.line, f"changed or made {odd}")
