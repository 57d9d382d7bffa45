"""What the interop tests share: our program, a scratch folder, and peers that never look for a network."""
import json
import os
import subprocess
import sys

import pytest

SHARED = os.environ["CITTERT_SHARED"]
sys.path.insert(0, os.path.join(SHARED, "peers", "workloads"))
import offline  # noqa: E402,F401  (before pyuvdata: astropy must not look for a network)

CITTERT = os.environ["CITTERT"]


class Program:
    """Our program, run as a user runs it."""

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
def shared():
    return SHARED
