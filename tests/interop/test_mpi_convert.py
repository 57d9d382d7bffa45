"""Conversions under mpirun write the files of one process."""
import os
import subprocess

import pytest

from conftest import CITTERT
from test_mpi import ENV, mpirun
from test_mpi_commands import SCENE, SIMULATE, TRACK, run_on

CONVERSIONS = {
    "joined": ["../p-time0.uvh5", "../p-time1.uvh5", "w.uvfits"],
    "compressed": ["../v.uvh5", "w.uvh5", "--compression", "lzf"],
    "copied": ["../v.uvh5", "w.uvh5"],
    "column": ["../model.uvh5", "w.uvfits", "--column", "model"],
    "beside": ["../model.uvh5", "w.uvh5", "--compression", "lzf"],
    "measurement set": ["../v.uvh5", "w.ms"],
    "split by time": ["../model.uvh5", "w.uvh5", "--split", "time=6,channel=2"],
    "split by channel": ["../v.uvh5", "w.uvfits", "--split", "channel=3"],
    "split by baseline": ["../v.uvh5", "w.uvh5", "--split", "baseline=100"],
    "image": ["../c-image.fits", "w.png"],
}


def contents(folder):
    """All files below a folder. Those of casacore hold times, so only their sizes count."""
    files = [os.path.join(top, name) for top, _, names in os.walk(folder) for name in names]
    return {os.path.relpath(path, folder): os.path.getsize(path) if ".ms/" in path else open(path, "rb").read() for path in files}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "s.csv").write_text(SCENE)
    for words in [
        [*SIMULATE, *TRACK, "-o", "v.uvh5"],
        ["convert", "v.uvh5", "p.uvh5", "--split", "time=2"],
        ["predict", "v.uvh5", "--model", "s.csv", "--into", "model", "-o", "model.uvh5"],
        ["clean", "v.uvh5", "-o", "c", "--size", 64, "--cell", "1mrad", "--niter", 100],
    ]:
        subprocess.run([CITTERT, *map(str, words)], cwd=folder, check=True, capture_output=True)
    return folder


@pytest.mark.parametrize("what", CONVERSIONS)
def test_conversions_are_those_of_one_process(inputs, what):
    written = []
    for n in [1, 2, 4]:
        folder = inputs / f"{what} by {n}"
        folder.mkdir()
        # Blocks of a few hundred rows, so that every process reads some.
        words = ["--memory", "16MiB", "--json", "convert", *CONVERSIONS[what]]
        run = subprocess.run([CITTERT, *words] if n == 1 else mpirun(n, *words), cwd=folder, env=ENV, capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        written.append((contents(folder), run.stdout.splitlines()[-1]))
    assert written[0][0] and written[1] == written[0] and written[2] == written[0]


def test_what_cannot_be_converted_is_said_once_and_leaves_nothing(inputs, cittert):
    there = inputs / "v.uvh5"
    run = run_on(cittert, 3, "convert", there, "w.uvh5", "--split", "time=1000", code=2)
    assert run.stderr.count("error:") == 1 and "time=1000" in run.stderr
    broken = cittert.folder / "broken.uvh5"
    broken.write_bytes(there.read_bytes()[: there.stat().st_size // 2])
    run = run_on(cittert, 3, "convert", broken, "w.uvfits", code=1)
    assert run.stderr.count("error:") == 1 and "broken.uvh5" in run.stderr
    assert os.listdir(cittert.folder) == ["broken.uvh5"]
