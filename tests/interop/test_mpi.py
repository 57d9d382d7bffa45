"""Several processes under mpirun make the images of one process, and leave no half output."""
import json
import os
import random
import signal
import subprocess
import time

import h5py
import numpy as np
import pytest
from astropy.io import fits

from conftest import CITTERT

ENV = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
IMAGING = ["--size", 128, "--cell", "1mrad", "--weighting", "briggs"]
COMMANDS = {
    "dirty": (IMAGING, ["c.fits"]),
    # With natural weights the image is made while the set is read, and planes of this size are shared.
    "dirty in one pass": (["--size", 2048, "--cell", "0.9mrad", "--weighting", "natural"], ["c.fits"]),
    "clean": ([*IMAGING, "--niter", 500], ["c-dirty.fits", "c-psf.fits", "c-model.fits", "c-image.fits", "c-residual.fits"]),
    "mem": (IMAGING, ["c-model.fits", "c-image.fits", "c-residual.fits"]),
}


def mpirun(n, *words):
    return ["mpirun", "--oversubscribe", "-n", str(n), CITTERT, *map(str, words)]


def simulate(cittert):
    (cittert.folder / "s.csv").write_text("l_rad,m_rad,flux_jy\n0.01,0.005,1e6\n-0.02,0.01,4e5\n")
    cittert("simulate", "--layout", "mm-y", "--freq", "94GHz", "--bandwidth", "1GHz", "--channels", 16, "--scene", "s.csv", "--noise", "--seed", 3, "-o", "v.uvh5")


@pytest.mark.parametrize("case", COMMANDS)
def test_images_are_those_of_one_process(cittert, case):
    simulate(cittert)
    command, (options, images) = case.split()[0], COMMANDS[case]
    # The rounding of single precision moves the end of an optimisation by about 1e-6 of the peak. What mpirun starts works in double precision.
    accuracy = ["--epsilon", "9e-6"] if command == "mem" else []
    cittert(command, "v.uvh5", *options, *accuracy, "-o", "c.fits" if command == "dirty" else "c")
    for n in [1, 2, 4]:
        folder = cittert.folder / str(n)
        folder.mkdir()
        output = folder / ("c.fits" if command == "dirty" else "c")
        run = subprocess.run(mpirun(n, command, "v.uvh5", *options, "-o", output), cwd=cittert.folder, env=ENV, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        for name in images:
            one, several = fits.getdata(cittert.folder / name), fits.getdata(folder / name)
            # A residual is the difference of two images that are as large as the restored one.
            scale = fits.getdata(cittert.folder / name.replace("residual", "image"))
            assert np.abs(one - several).max() <= 1e-6 * np.abs(scale).max(), (n, name)
        assert not [f for f in os.listdir(folder) if f.startswith(".")]


def test_the_components_are_those_of_one_process(cittert):
    simulate(cittert)
    words = ["clean", "v.uvh5", *COMMANDS["clean"][0], "-o"]
    cittert(*words, "one")
    subprocess.run(mpirun(4, *words, "four"), cwd=cittert.folder, env=ENV, check=True, capture_output=True)
    one, four = (np.genfromtxt(cittert.folder / f"{name}-components.csv", delimiter=",", names=True) for name in ["one", "four"])
    order = [np.lexsort((t["l_rad"], t["m_rad"])) for t in (one, four)]
    for column in ["l_rad", "m_rad", "flux_jy"]:
        assert np.allclose(one[column][order[0]], four[column][order[1]], rtol=0, atol=1e-6 * np.abs(one[column]).max()), column


@pytest.mark.parametrize("algorithm", ["hogbom", "clark", "multiscale"])
def test_deep_cleans_are_those_of_one_process(cittert, algorithm):
    """10,000 components far below the noise: a difference in the last digit of single precision would lead to others."""
    simulate(cittert)
    words = ["clean", "v.uvh5", *IMAGING, "--algorithm", algorithm, "--niter", 10000, "--nsigma", 0, "--hold-out", 0, "-o"]
    # What mpirun starts has this accuracy unless another one is given.
    cittert(*words, "one", "--epsilon", "9e-6")
    for n in [1, 2, 4]:
        subprocess.run(mpirun(n, *words, "several", "--overwrite"), cwd=cittert.folder, env=ENV, check=True, capture_output=True)
        one, several = (np.genfromtxt(cittert.folder / f"{name}-components.csv", delimiter=",", names=True) for name in ["one", "several"])
        order = [np.lexsort((t["l_rad"], t["m_rad"])) for t in (one, several)]
        for column in ["l_rad", "m_rad", "flux_jy"]:
            assert np.allclose(one[column][order[0]], several[column][order[1]], rtol=0, atol=1e-9 * np.abs(one[column]).max()), (n, column)
        one, several = fits.getdata(cittert.folder / "one-image.fits"), fits.getdata(cittert.folder / "several-image.fits")
        assert np.abs(one - several).max() <= 1e-7 * np.abs(one).max(), n


@pytest.mark.parametrize("deconvolver", [[], ["--deconvolver", "hogbom"], ["--deconvolver", "mem"]], ids=["auto", "hogbom", "mem"])
def test_images_and_gains_of_selfcal_are_those_of_one_process(cittert, deconvolver):
    simulate(cittert)
    cittert("corrupt", "v.uvh5", "-o", "wrong.uvh5", "--seed", 1, "--phase-rms", "60deg")
    words = ["selfcal", "wrong.uvh5", *IMAGING, *deconvolver, "-o"]
    results = []
    for n in [1, 2, 4]:
        subprocess.run(mpirun(n, *words, f"of{n}"), cwd=cittert.folder, env=ENV, check=True, capture_output=True)
        with h5py.File(cittert.folder / f"of{n}.calh5") as table:
            gains = table["Data/gains"][()]
        results.append((fits.getdata(cittert.folder / f"of{n}-image.fits"), gains))
    (image, gains), *others = results
    assert np.ptp(np.angle(gains)) > 1
    for several, own in others:
        assert np.abs(image - several).max() <= 1e-6 * np.abs(image).max()
        assert np.nanmax(np.abs(gains - own)) <= 1e-6


def close(one, several):
    """Two JSON values that agree but for rounding."""
    if isinstance(one, dict):
        return one.keys() == several.keys() and all(close(one[key], several[key]) for key in one)
    return one == several or abs(one - several) <= 1e-4 * abs(one)


@pytest.mark.parametrize("command", ["clean", "mem"])
@pytest.mark.parametrize("wrong_phases", [False, True])
def test_the_verdict_is_that_of_one_process(cittert, command, wrong_phases):
    simulate(cittert)
    name = "v.uvh5"
    if wrong_phases:
        cittert("corrupt", name, "-o", "wrong.uvh5", "--seed", 1, "--phase-rms", "60deg")
        name = "wrong.uvh5"
    words = ["--json", command, name, *IMAGING, "-o"]
    more = ["--startmod", "always"] if wrong_phases and command == "clean" else []
    run = lambda before, output: subprocess.run([*before, *map(str, [*words, output, *more])], cwd=cittert.folder, env=ENV, capture_output=True, text=True)
    # The accuracy of what mpirun starts: an image that cannot meet its constraints is not determined to the last digit.
    more += ["--epsilon", "9e-6"]
    one = run([CITTERT], "one")
    for n in [2, 4]:
        several = run(mpirun(n), f"of{n}")
        assert several.returncode == one.returncode, several.stderr
        a, b = (json.loads(r.stdout) for r in (one, several))
        assert a["verdict"] == b["verdict"] and [f["name"] for f in a["findings"]] == [f["name"] for f in b["findings"]]
        assert close(a["residuals"], b["residuals"]) and close(a["held_out"], b["held_out"])


def test_other_commands_and_options_refuse_several_processes(cittert):
    simulate(cittert)
    for words in [["info", "v.uvh5"], ["selfcal", "v.uvh5", "--pointing", "-o", "c"], ["mem", "v.uvh5", *IMAGING[:4], "--terms", "cphase", "-o", "c"]]:
        run = subprocess.run(mpirun(2, *words), cwd=cittert.folder, env=ENV, capture_output=True, text=True)
        assert run.returncode == 2 and run.stderr.count("error: 2 processes share this command") == 1, run.stderr
    assert sorted(os.listdir(cittert.folder)) == ["s.csv", "v.uvh5"]


def test_an_error_ends_all_processes(cittert):
    run = subprocess.run(mpirun(3, "dirty", "none.uvh5", "-o", "c.fits"), cwd=cittert.folder, env=ENV, capture_output=True, text=True, timeout=30)
    assert run.returncode != 0 and run.stderr.count("error:") == 1 and "none.uvh5" in run.stderr, run.stderr


def children(pid):
    """The cittert processes that an mpirun has started."""
    try:
        with open(f"/proc/{pid}/task/{pid}/children") as f:
            return [int(child) for child in f.read().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []


def runs(pid):
    """Whether a process exists and has not ended: mpirun may leave an ended one as a zombie."""
    try:
        with open(f"/proc/{pid}/stat") as f:
            return f.read().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


CLEANED = ["clean", "v.uvh5", "--size", 512, "--cell", "0.3mrad", "--startmod", "never", "-o", "c", "--overwrite"]
# What each mpirun printed that did not end by itself after all its processes had.
HUNG = []


def kill_one_of_three(cittert, words, wait, dice):
    """
    Kills a process `wait` seconds after all three run; the others must end within 10 s. Gives what mpirun printed and its exit code; None where the
    job had ended before.
    """
    job = subprocess.Popen(mpirun(3, *words), cwd=cittert.folder, env=ENV, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    while job.poll() is None and len(children(job.pid)) < 3:
        time.sleep(0.005)
    time.sleep(wait)
    ranks = children(job.pid)
    if not ranks:
        job.communicate(timeout=60)
        return None
    at = time.monotonic()
    try:
        os.kill(dice.choice(ranks), signal.SIGKILL)
    except ProcessLookupError:
        job.communicate(timeout=60)
        return None
    while any(map(runs, ranks)):
        assert time.monotonic() - at < 10, "processes outlive the one that was killed"
        time.sleep(0.005)
    try:
        _, err = job.communicate(timeout=10)
    except subprocess.TimeoutExpired:
        # mpirun of Open MPI 4.1 may hang after it has printed what happened (its issue 7790). No process of cittert is left then.
        job.kill()
        _, err = job.communicate(timeout=60)
        HUNG.append(err)
    return err, job.returncode


def test_a_process_that_is_killed_ends_the_job_and_leaves_no_half_output(cittert):
    simulate(cittert)
    subprocess.run(mpirun(3, *CLEANED), cwd=cittert.folder, env=ENV, check=True, capture_output=True)
    # Stay in one folder, so that an output that is replaced by a half one would show.
    before = {p: p.read_bytes() for p in cittert.folder.iterdir() if p.name.startswith("c-")}
    assert len(before) >= 5
    # Work for much longer than any of the waits.
    long = [*CLEANED, "--niter", 10**8, "--nsigma", 0, "--gain", 0.001]
    dice = random.Random(20)
    for _ in range(10):
        err, code = kill_one_of_three(cittert, long, dice.uniform(0, 1), dice)
        assert code != 0 and ("rank" in err or "process" in err), (code, err)
        for path, content in before.items():
            assert path.read_bytes() == content, path
    # A kill while the images are written: which of these jobs end before it depends on the machine.
    for _ in range(10):
        kill_one_of_three(cittert, CLEANED, dice.uniform(0, 1), dice)
        for path, content in before.items():
            assert len(path.read_bytes()) == len(content), path
    assert len(HUNG) <= 1, HUNG
