"""What a conversion keeps beside the data, as pyuvdata and casacore read it, and what it says to be lost."""
import os
import tarfile
import warnings

import h5py
import numpy as np
import pytest
from astropy.io import fits
from casacore import tables
from pyuvdata import UVData
from test_in_place import add_to_ms
from test_ms import sky_set, strict

KEYWORDS = {"foo": 3, "ratio": 0.25, "note": "a text, and more", "ready": True, "observer": "A. Nobody", "project": "P123"}


def made(cittert, orientation):
    """A set with extra keywords, a direction of the feeds, mounts and diameters, and with things that only UVH5 holds."""
    uv = sky_set(("xx", "yy"), first=1)
    uv.extra_keywords = KEYWORDS | {"a_long_name_of_a_keyword": 1.5, "nothing": None}
    uv.telescope.feed_array, uv.telescope.feed_angle, uv.telescope.Nfeeds = None, None, None
    uv.telescope.set_feeds_from_x_orientation(orientation, polarization_array=uv.polarization_array)
    uv.telescope.mount_type = ["equatorial"] * uv.telescope.Nants
    uv.telescope.antenna_diameters = np.linspace(10, 20, uv.telescope.Nants)
    uv.write_uvh5(cittert.path("x.uvh5"))
    with h5py.File(cittert.path("x.uvh5"), "a") as f:
        f["Mine/numbers"] = np.arange(3.0)
        f["Data"].attrs["mine"] = 1
    return uv


@pytest.mark.parametrize("orientation", ["east", "north"])
@pytest.mark.parametrize("form", ["uvh5", "uvfits", "ms"])
def test_keywords_feeds_mounts_and_diameters_are_kept(cittert, form, orientation):
    uv = made(cittert, orientation)
    anew = ["--compression", "none"] if form == "uvh5" else []
    lost = cittert.json("convert", "x.uvh5", f"y.{form}", *anew)["lost"]
    name = {"uvh5": "UVH5", "uvfits": "UVFITS", "ms": "Measurement Set"}[form]
    assert f"lost in {name}: dataset Mine/numbers" in lost and f"lost in {name}: attribute mine of Data" in lost
    about_long = [line for line in lost if "a_long_name_of_a_keyword" in line]
    assert len(about_long) == (form == "uvfits")
    # Back through UVH5, so that both the writer and the reader of the format are tried.
    cittert("convert", f"y.{form}", "z.uvh5", *anew)
    for path in (f"y.{form}", "z.uvh5"):
        ours = strict("read_" + path.split(".")[1], cittert.path(path))
        found = {k.lower(): v for k, v in ours.extra_keywords.items()}
        assert {k: found.get(k) for k in KEYWORDS if k not in ("observer", "project")} == {k: v for k, v in KEYWORDS.items() if k not in ("observer", "project")}
        assert found["observer"] == "A. Nobody", path
        assert ours.telescope.get_x_orientation_from_feeds() == orientation, path
        assert list(ours.telescope.mount_type) == ["equatorial"] * uv.telescope.Nants, path
        assert np.allclose(ours.telescope.antenna_diameters, uv.telescope.antenna_diameters, rtol=1e-6), path
        assert list(ours.telescope.antenna_names) == list(uv.telescope.antenna_names), path
    with h5py.File(cittert.path("z.uvh5")) as f:
        assert f["Header/x_orientation"][()] == orientation.encode()
        assert {k.lower(): v[()] for k, v in f["Header/extra_keywords"].items()}["project"] == b"P123"
    if form == "uvfits":
        header = fits.getheader(cittert.path("y.uvfits"))
        assert header["OBSERVER"] == "A. Nobody" and header["FOO"] == 3
        assert any("a_long_name_of_a_keyword = 1.5" in line for line in header["HISTORY"])
    if form == "ms":
        with tables.table(cittert.path("y.ms/OBSERVATION"), ack=False) as t:
            assert (t.getcell("OBSERVER", 0), t.getcell("PROJECT", 0)) == ("A. Nobody", "P123")


def test_a_copy_keeps_even_what_nobody_knows(cittert):
    made(cittert, "east")
    assert cittert.json("convert", "x.uvh5", "y.uvh5")["lost"] == []
    with h5py.File(cittert.path("y.uvh5")) as f:
        assert list(f["Mine/numbers"]) == [0, 1, 2] and f["Data"].attrs["mine"] == 1
        assert b"convert" in f["Header/history"][()]


def test_the_losses_of_a_measurement_set_are_named(cittert, visibilities):
    with tarfile.open(os.path.join(visibilities, "mwa_birli.ms.tar.gz")) as tar:
        tar.extractall(cittert.folder, filter="data")
    name = "1090008640_birli.ms"
    add_to_ms(cittert.path(name))
    with tables.table(cittert.path(name), ack=False) as t:
        subtables = {k for k, v in t.getkeywords().items() if isinstance(v, str) and v.startswith("Table: ")}
        rows = {}
        for s in subtables:
            with tables.table(cittert.path(f"{name}/{s}"), ack=False) as sub:
                rows[s] = sub.nrows()
    for out, form in (("y.uvh5", "UVH5"), ("y.uvfits", "UVFITS")):
        run = cittert("convert", name, out)
        lost = [line.removeprefix("note: ") for line in run.stderr.splitlines() if f"lost in {form}" in line]
        for what in ("column MINE", "keyword MY_KEYWORD", "subtable MY_NOTES"):
            assert f"lost in {form}: {what}" in lost, lost
        read = {"ANTENNA", "DATA_DESCRIPTION", "FIELD", "HISTORY", "OBSERVATION", "POLARIZATION", "SPECTRAL_WINDOW"}
        for s in subtables - read:
            assert any(line.startswith(f"lost in {form}: subtable {s}") for line in lost) == (rows[s] > 0), (s, lost)
        assert cittert.json("convert", name, out, "--overwrite")["lost"] == lost


def test_the_losses_of_uvfits_are_named(cittert, visibilities):
    source = os.path.join(visibilities, "eht_m87_2017_100_lo.uvfits")
    with fits.open(source) as f, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        f[0].header["COMMENT"] = "mine"
        f[0].header["MYWORD"] = "kept"
        f.append(fits.BinTableHDU.from_columns([fits.Column("A", "1E", array=[1.0])], name="AIPS CL"))
        f.writeto(cittert.path("x.uvfits"), output_verify="ignore")
    lost = cittert.json("convert", "x.uvfits", "y.uvh5")["lost"]
    assert "lost in UVH5: table AIPS CL" in lost and any("COMMENT" in line for line in lost)
    uv = UVData()
    uv.read(cittert.path("y.uvh5"), run_check=False)
    assert uv.extra_keywords["MYWORD"] == "kept"
