"""The scripts that cittert writes for Slurm, run by a real Slurm of one node (tests/peers/slurm.sh, which needs root)."""
import os
import subprocess
import time

import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
SLURM = os.path.join(os.path.dirname(HERE), "peers", "slurm.sh")
STUDY = """
title = "phases"
seeds = 500
layout = { name = "mm-y", antennas = 12, choose = "random" }
scene = { points = [{ flux = "1Jy" }] }
[simulate]
freq = "94GHz"
bandwidth = "1GHz"
method = "dft"
[image]
size = 64
cell = "1mrad"
no-w = true
[clean]
niter = 1
gain = 1.0
[corrupt]
phase-rms = "5deg"
[[axis]]
parameter = "corrupt.phase-rms"
values = ["5deg", "10deg", "20deg", "40deg"]
"""


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    """The environment of a running Slurm."""
    if os.geteuid() != 0:
        pytest.skip("a Slurm for the test is started by root alone")
    folder = tmp_path_factory.mktemp("slurm")
    run = subprocess.run(["bash", SLURM, "start", str(folder)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    conf = run.stdout.strip().split("=", 1)[1]
    yield {**os.environ, "SLURM_CONF": conf}
    subprocess.run(["bash", SLURM, "stop", str(folder)], check=True)


def wait(slurm, *names, seconds=300):
    """Wait until no job of these names is there."""
    for _ in range(seconds):
        left = subprocess.run(["squeue", "-h", "-o", "%j %T %r"], env=slurm, check=True, capture_output=True, text=True).stdout
        if not any(name in left for name in names):
            return
        time.sleep(1)
    raise AssertionError(f"jobs are left:\n{left}")


def submit(cittert, slurm, line):
    subprocess.run(["bash", "-c", line], cwd=cittert.folder, env=slurm, check=True)


def logs(cittert, name):
    return "".join(p.read_text() for p in sorted(cittert.folder.glob(f"{name}-slurm-*.log")))


def test_a_study_as_a_job_array_has_the_tables_of_one_process(cittert, slurm):
    (cittert.folder / "study.toml").write_text(STUDY)
    cittert("study", "study.toml", "-o", "one")
    planned = cittert.json("study", "study.toml", "-o", "out", "--slurm", "--shards", 8, "--slurm-memory", "600MB")
    assert planned["trials"] == 2000 and planned["shards"] == 8
    submit(cittert, slurm, planned["submit"])
    # A task is killed in the middle of its work; Slurm then does not start the job that merges.
    journal = cittert.folder / "out" / "shards" / "1-of-8" / "journal.jsonl"
    for _ in range(600):
        if journal.exists() and len(journal.read_bytes().splitlines()) > 5:
            break
        time.sleep(0.05)
    subprocess.run("scancel --signal=KILL --full $(squeue -h -r -o '%i' --states=R | grep _ | sort -V | head -1)", shell=True, env=slurm)
    wait(slurm, "cittert-study")
    subprocess.run("scancel --name=cittert-merge", shell=True, env=slurm)
    wait(slurm, "cittert-merge")
    # The same scripts again: only what is missing runs.
    submit(cittert, slurm, planned["submit"])
    wait(slurm, "cittert-study", "cittert-merge")
    for name in ["trials.csv", "summary.csv", "metrics.json", "study.h5"]:
        one, out = cittert.folder / "one" / name, cittert.folder / "out" / name
        assert out.exists(), logs(cittert, "out")
        assert one.read_bytes() == out.read_bytes(), name


def test_clean_runs_as_a_job(cittert, slurm):
    (cittert.folder / "s.csv").write_text("l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n")
    cittert("simulate", "--layout", "mm-y", "--freq", "94GHz", "--bandwidth", "1GHz", "--scene", "s.csv", "-o", "v.uvh5")
    words = ["clean", "v.uvh5", "--size", 64, "--cell", "1mrad", "--niter", 50, "-o", "c"]
    made = cittert.json(*words, "--slurm", "--slurm-time", "10min", "--slurm-memory", "1GB")
    submit(cittert, slurm, f"sbatch {made['output']}")
    wait(slurm, "cittert-clean")
    assert (cittert.folder / "c-image.fits").exists(), logs(cittert, "c")


def test_a_run_is_a_job(cittert, slurm):
    text = STUDY.split("[[axis]]")[0].replace("seeds = 500\n", "").replace(", antennas = 12, choose = \"random\"", "")
    text = text.replace('scene = { points = [{ flux = "1Jy" }] }', 'scene = { file = "s.csv" }').replace("[clean]", "[[clean]]")
    (cittert.folder / "run.toml").write_text(text.replace("niter = 1\ngain = 1.0\n", "niter = 10\n"))
    (cittert.folder / "s.csv").write_text("l_rad,m_rad,flux_jy\n0.01,0.005,1.0\n")
    made = cittert.json("run", "run.toml", "-o", "r", "--slurm", "--slurm-time", "10min", "--slurm-memory", "1GB")
    submit(cittert, slurm, f"sbatch {made['output']}")
    wait(slurm, "cittert-run")
    assert (cittert.folder / "r" / "report.html").exists(), logs(cittert, "r")
