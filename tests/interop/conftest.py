"""What the interop tests share: the program under test in a scratch folder, and the folders of data."""
import json
import os
import subprocess
import sys

import pytest

TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(TESTS, "peers", "workloads"))
import offline  # noqa: E402,F401  (before pyuvdata: astropy must not look for a network)

CITTERT = os.environ["CITTERT"]


class Program:
    """The program under test, run in a scratch folder as a user runs it."""

    def __init__(self, folder):
        self.folder = folder

    def path(self, name):
        return str(self.folder / name)

    def __call__(self, *words, ok=True):
        run = subprocess.run([CITTERT, *map(str, words)], cwd=self.folder, capture_output=True, text=True)
        if ok:
            assert run.returncode == 0, f"{words}\n{run.stdout}\n{run.stderr}"
        return run

    def json(self, *words):
        return json.loads(self("--json", *words).stdout)


@pytest.fixture
def cittert(tmp_path):
    return Program(tmp_path)


@pytest.fixture(scope="session")
def visibilities():
    """The folder of real public visibilities."""
    return os.path.join(os.environ["CITTERT_DATA"], "visibilities")


@pytest.fixture(scope="session")
def oracle():
    """The folder of the project's tables of reference values."""
    return os.path.join(TESTS, "oracle")
