"""Self-calibrations, simulations, predictions and studies under mpirun are those of one process, and leave no half output."""
import os
import random
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from astropy.io import fits

from test_mpi import ENV, children, kill_one_of_three, mpirun
from test_slurm import STUDY

SCENE = "l_rad,m_rad,flux_jy\n0.01,0.005,1e6\n-0.02,0.01,4e5\n"
SIMULATE = ["simulate", "--layout", "mm-y", "--freq", "94GHz", "--bandwidth", "1GHz", "--channels", 16, "--scene", "s.csv", "--noise", "--seed", 3]
TRACK = ["--duration", "2s", "--integration", "0.1s"]


def run_on(cittert, n, *words, code=0):
    run = subprocess.run(mpirun(n, *words), cwd=cittert.folder, env=ENV, capture_output=True, text=True, timeout=300)
    assert run.returncode == code, f"{words}\n{run.stdout}\n{run.stderr}"
    return run


def data(path):
    """All that a UVH5 file holds but its history."""
    found = {}
    with h5py.File(path) as f:
        f.visititems(lambda name, item: found.update({name: item[()]}) if isinstance(item, h5py.Dataset) and "history" not in name else None)
    return found


def assert_same(one, other):
    one, other = data(one), data(other)
    assert one.keys() == other.keys()
    for name in one:
        a, b = np.asarray(one[name]), np.asarray(other[name])
        assert np.array_equal(a, b) if a.dtype.kind == "O" else a.tobytes() == b.tobytes(), name


def hidden(folder):
    return [name for name in os.listdir(folder) if name.startswith(".")]


NEAR = ["--layout", "mm-y", "--freq", "94GHz", "--bandwidth", "1GHz"]
FAR = ["--layout", "vla-a", "--freq", "1.4GHz", "--bandwidth", "10MHz", "--phase-center", "19h59m28s,+40d44m02s", "--start", "2026-01-01T18:00:00"]
SIMULATIONS = {
    "plain": [*NEAR, *TRACK],
    "air": [*FAR, "--duration", "300s", "--integration", "5s", "--atmosphere", "ussa"],
    "pointing": [*NEAR, *TRACK, "--element", "gaussian", "--element-width", "9deg", "--pointing-rms", "0.5deg"],
}


@pytest.mark.parametrize("name", SIMULATIONS)
def test_simulations_have_the_values_of_one_process(cittert, name):
    (cittert.folder / "s.csv").write_text(SCENE)
    words = ["simulate", *SIMULATIONS[name], "--channels", 4, "--scene", "s.csv", "--noise", "--seed", 3, "-o"]
    cittert(*words, "one.uvh5")
    for n in [2, 4]:
        run_on(cittert, n, *words, f"{n}.uvh5")
        assert_same(cittert.path("one.uvh5"), cittert.path(f"{n}.uvh5"))
        for more in [".calh5", "-pointing.csv"]:
            one, several = cittert.folder / f"one{more}", cittert.folder / f"{n}{more}"
            assert one.exists() == several.exists()
            assert not more.endswith("csv") or not one.exists() or one.read_bytes() == several.read_bytes()
    assert (cittert.folder / "one.calh5").exists() == (name == "air") and (cittert.folder / "one-pointing.csv").exists() == (name == "pointing")
    assert not hidden(cittert.folder)


def test_predictions_have_the_values_of_one_process(cittert):
    (cittert.folder / "s.csv").write_text(SCENE)
    cittert(*SIMULATE, *TRACK, "-o", "v.uvh5")
    cittert("clean", "v.uvh5", "-o", "c", "--size", 128, "--cell", "1mrad", "--niter", 200)
    for model in ["s.csv", "c-model.fits"]:
        for residual in [[], ["--residual"]]:
            words = ["predict", "v.uvh5", "--model", model, *residual, "--overwrite", "-o"]
            one = cittert.json(*words, "one.uvh5")
            for n in [2, 4]:
                several = run_on(cittert, n, "--json", *words, "several.uvh5").stdout
                assert_same(cittert.path("one.uvh5"), cittert.path("several.uvh5"))
                assert f'"n_unflagged":{one["n_unflagged"]}' in several
    refused = run_on(cittert, 2, "predict", "v.uvh5", "--model", "s.csv", "--into", "model", "-o", "w.uvh5", code=2)
    assert "--into" in refused.stderr and not (cittert.folder / "w.uvh5").exists()


@pytest.mark.parametrize("options", [["--mode", "phase"], ["--mode", "amp-phase", "--solint", "0.5s"]])
def test_self_calibrations_are_those_of_one_process(cittert, options):
    (cittert.folder / "s.csv").write_text(SCENE)
    cittert(*SIMULATE, *TRACK, "-o", "v.uvh5")
    cittert("corrupt", "v.uvh5", "-o", "d.uvh5", "--gains", "truth.calh5", "--seed", 1, "--phase-rms", "30deg", "--amp-rms", 0.1)
    words = ["selfcal", "d.uvh5", "--deconvolver", "hogbom", "--size", 128, "--cell", "1mrad", "--rounds", 4, *options, "-o"]
    one = cittert.json(*words, "one")
    for n in [1, 2, 4]:
        folder = cittert.folder / str(n)
        folder.mkdir()
        run_on(cittert, n, *words, folder / "one")
        assert sorted(os.listdir(folder)) == sorted(name for name in os.listdir(cittert.folder) if name.startswith("one"))
        with h5py.File(cittert.path("one.calh5")) as a, h5py.File(folder / "one.calh5") as b:
            a, b = a["Data"], b["Data"]
            assert np.array_equal(a["flags"], b["flags"])
            assert np.abs(a["gains"][()] - b["gains"][()]).max() < 1e-6, n
        for name in ["dirty", "model", "residual", "image"]:
            a, b = fits.getdata(cittert.path(f"one-{name}.fits")), fits.getdata(folder / f"one-{name}.fits")
            scale = np.abs(fits.getdata(cittert.path("one-image.fits"))).max()
            assert np.abs(a - b).max() <= 1e-6 * scale, (n, name)
        a, b = data(cittert.path("one.uvh5")), data(folder / "one.uvh5")
        assert np.abs(a["Data/visdata"] - b["Data/visdata"]).max() < 2e-6 * np.abs(a["Data/visdata"]).max()
        assert np.array_equal(a["Data/flags"], b["Data/flags"]) and np.array_equal(a["Header/ant_1_array"], b["Header/ant_1_array"])
    assert one["accepted"] is True
    for refused in [["--pointing"], ["--deconvolver", "hogbom", "--solve", "leakage"]]:
        said = run_on(cittert, 2, "selfcal", "d.uvh5", *refused, "-o", "r", code=2).stderr
        assert said.count("error: 2 processes share this command: selfcal") == 1, said


QUESTION = """
[question]
keep = "dynamic_range"
at-least = 8.0
parameter = "corrupt.phase-rms"
from = "1deg"
to = "60deg"
fraction = 0.5
precision = 0.3
"""
FAILURES = '\n[failures]\nscore = "dynamic_range"\nantennas = "each"\n'


def tables(folder):
    return {p.name: p.read_bytes() for p in folder.iterdir() if p.suffix == ".csv" or p.name == "metrics.json"}


@pytest.mark.parametrize("more", ["", "question", "failures"])
def test_studies_have_the_bytes_of_one_process(cittert, more):
    text = STUDY.replace("seeds = 500", "seeds = 12")
    if more == "question":
        text = text[: text.index("[[axis]]")] + QUESTION
    elif more == "failures":
        text = text.replace("seeds = 12", "seeds = 3").replace(', antennas = 12, choose = "random"', "").replace(', "20deg", "40deg"', "") + FAILURES
    (cittert.folder / "study.toml").write_text(text)
    cittert("study", "study.toml", "-o", "one")
    for n in [2, 4]:
        told = run_on(cittert, n, "study", "study.toml", "-o", f"out{n}").stdout
        assert told.count("report.html") == 1
        assert tables(cittert.folder / f"out{n}") == tables(cittert.folder / "one"), n
        assert (cittert.folder / f"out{n}" / "study.h5").read_bytes() == (cittert.folder / "one" / "study.h5").read_bytes()


def test_a_study_that_is_killed_goes_on_with_any_number_of_processes(cittert):
    (cittert.folder / "study.toml").write_text(STUDY)
    cittert("study", "study.toml", "-o", "one")
    dice = random.Random(18)
    journal = cittert.folder / "out" / "journal.jsonl"
    for n in [3, 2, 4, 3]:
        job = subprocess.Popen(mpirun(n, "study", "study.toml", "-o", "out"), cwd=cittert.folder, env=ENV, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        before = journal.read_bytes().count(b"\n") if journal.exists() else 0
        while job.poll() is None and (not journal.exists() or journal.read_bytes().count(b"\n") < before + 300):
            time.sleep(0.002)
        ranks = children(job.pid)
        if ranks:
            at = time.monotonic()
            os.kill(dice.choice(ranks), signal.SIGKILL)
            job.communicate(timeout=60)
            assert time.monotonic() - at < 10 and not (cittert.folder / "out" / "trials.csv").exists()
    stored = journal.read_bytes().count(b"\n")
    assert stored > 900
    told = run_on(cittert, 2, "study", "study.toml", "-o", "out").stderr
    assert "are in the journal already" in told
    assert tables(cittert.folder / "out") == tables(cittert.folder / "one")


def test_a_trial_that_fails_anywhere_says_what_it_says_in_one_process(cittert):
    text = STUDY.replace("seeds = 500", "seeds = 6").replace("[corrupt]", "[corrupt]\nflag-good = 0.0")
    text = text[: text.index("[[axis]]")] + '[[axis]]\nparameter = "corrupt.flag-good"\nvalues = [0.0, 1.0]\n'
    (cittert.folder / "study.toml").write_text(text)
    one = cittert("study", "study.toml", "-o", "one", ok=False)
    assert one.returncode == 1
    several = run_on(cittert, 3, "study", "study.toml", "-o", "out", code=1).stderr
    assert several.count("error:") == 1, several
    for says in ["caused by: the trial at corrupt.flag-good = 1.0, seed", "66 of 66 visibilities of I are flagged"]:
        assert says in one.stderr and says in several


def test_a_simulation_of_which_a_process_is_killed_leaves_the_old_file(cittert):
    (cittert.folder / "s.csv").write_text(SCENE)
    cittert(*SIMULATE, *TRACK, "-o", "v.uvh5")
    old = (cittert.folder / "v.uvh5").read_bytes()
    # This takes longer than any of the waits.
    words = [*SIMULATE, "--duration", "60s", "--integration", "0.01s", "-o", "v.uvh5", "--overwrite"]
    dice = random.Random(19)
    for _ in range(6):
        err, code = kill_one_of_three(cittert, words, dice.uniform(0, 1.0), dice)
        assert code != 0 and ("rank" in err or "process" in err), (code, err)
        assert (cittert.folder / "v.uvh5").read_bytes() == old


def test_a_self_calibration_of_which_a_process_is_killed_leaves_the_old_files(cittert):
    (cittert.folder / "s.csv").write_text(SCENE)
    cittert(*SIMULATE, *TRACK, "-o", "v.uvh5")
    cittert("corrupt", "v.uvh5", "-o", "d.uvh5", "--gains", "truth.calh5", "--seed", 1, "--phase-rms", "30deg")
    words = ["selfcal", "d.uvh5", "--deconvolver", "hogbom", "--size", 256, "--cell", "0.5mrad", "--overwrite", "-o", "c", "--rounds"]
    cittert(*words, 2)
    before = {p: p.read_bytes() for p in cittert.folder.iterdir() if p.name.startswith("c")}
    assert len(before) >= 10
    dice = random.Random(21)
    for _ in range(8):
        # A CLEAN that never ends, so that each kill hits a job at work, however slow the machine is.
        err, code = kill_one_of_three(cittert, [*words, 50, "--niter", 10**8, "--nsigma", 0, "--gain", 0.001], dice.uniform(0, 2), dice)
        assert code != 0 and ("rank" in err or "process" in err), (code, err)
        assert {p: p.read_bytes() for p in cittert.folder.iterdir() if p.name.startswith("c")} == before
