"""pyuvdata, WSClean and CASA agree with cittert on the Measurement Sets that it writes and reads. The tests make their visibilities by a plain sum."""
import os
import subprocess
import tarfile
import warnings

import numpy as np
import pytest
from astropy.coordinates import EarthLocation
from astropy.io import fits
from astropy.time import Time
from casacore import tables
from pyuvdata import Telescope, UVData

C = 299792458.0
L, M = 0.012, 0.005
CELL = 5e-5  # rad
SIZE = 640
ARRAYS = ("data_array", "flag_array", "nsample_array", "uvw_array", "time_array", "integration_time", "ant_1_array", "ant_2_array",
          "freq_array", "channel_width", "polarization_array", "flex_spw_id_array")  # fmt: skip


def spiral(n, radius):
    k = np.arange(n)
    r, t = radius * np.sqrt((k + 1) / n), 2.4 * k
    return np.column_stack([r * np.cos(t), r * np.sin(t), 0.01 * r * np.sin(3 * t)])


def enu_to_ecef(location, enu):
    lat, lon = location.lat.rad, location.lon.rad
    east = np.array([-np.sin(lon), np.cos(lon), 0])
    north = np.array([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)])
    up = np.array([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)])
    return enu @ np.array([east, north, up])


def telescope(name, location, enu, first=0, **more):
    n = len(enu)
    names = [f"A{k + 1:02d}" for k in range(n)]
    return Telescope.new(name=name, location=location, antenna_positions=enu_to_ecef(location, enu), antenna_names=names,
                         antenna_numbers=np.arange(n) + first, instrument=name, antenna_diameters=np.full(n, 25.0), **more)  # fmt: skip


def plain_sum(uvw, freqs, l=L, m=M):
    turns = (uvw @ np.array([l, m, np.sqrt(1 - l * l - m * m) - 1]))[:, None] * freqs[None] / C
    return np.exp(2j * np.pi * turns)


def sky_set(pols=("xx", "yy"), first=0, spread=False):
    """A source of 2 Jy off the centre, seen by an array called VLA, with random flags and numbers of samples."""
    where = EarthLocation.from_geodetic(-107.6184, 34.0788, 2115.0)
    tel = telescope("VLA", where, spiral(12, 300.0), first)
    freqs = np.array([1.40e9, 1.41e9, 1.42e9, 1.43e9])
    times = Time("2023-02-25T06:00:00").jd + np.arange(5) * 120 / 86400
    pairs = [(a, b) for a in tel.antenna_numbers for b in tel.antenna_numbers if a < b]
    catalog = {0: dict(cat_name="CYGA", cat_type="sidereal", cat_lon=5.2337, cat_lat=0.7109, cat_frame="icrs", cat_epoch=2000.0)}
    uv = UVData.new(freq_array=freqs, channel_width=1e7, polarization_array=list(pols), times=times, telescope=tel, antpairs=pairs,
                    do_blt_outer=True, integration_time=120.0, phase_center_catalog=catalog, vis_units="Jy", empty=True,
                    pol_convention="avg")  # fmt: skip
    uv.set_uvws_from_antenna_positions(update_vis=False)
    hands = [k for k, p in enumerate(uv.polarization_array) if p in (1, -1, -2, -5, -6)]
    uv.data_array[:, :, hands] = 2 * plain_sum(uv.uvw_array, freqs)[:, :, None]
    uv.data_array = uv.data_array.astype(np.complex64)
    rng = np.random.default_rng(5)
    uv.flag_array[:] = rng.random(uv.flag_array.shape) < 0.02
    uv.nsample_array[:] = rng.uniform(1, 3, uv.nsample_array.shape if spread else uv.nsample_array[:, :1, :1].shape)
    uv.nsample_array = uv.nsample_array.astype(np.float32)
    return uv


def strict(read, *args):
    """Read a file with pyuvdata. Every warning is an error."""
    uv = UVData()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        getattr(uv, read)(*args)
        uv.check()
    return uv


def assert_same(a, b, arrays=ARRAYS):
    for uv in (a, b):
        uv.reorder_blts(order="time", minor_order="baseline")
    for name in arrays:
        x, y = np.asarray(getattr(a, name)), np.asarray(getattr(b, name))
        assert x.shape == y.shape, name
        allowed = {"time_array": 1e-3 / 86400, "uvw_array": 1e-6 * np.abs(a.uvw_array).max()}.get(name, 0)
        assert np.abs(x.astype(complex) - y).max() <= allowed, name
    assert list(a.telescope.antenna_names) == list(b.telescope.antenna_names)
    where = [uv.telescope.antenna_positions + uv.telescope._location.xyz() for uv in (a, b)]
    assert np.abs(where[0] - where[1]).max() < 1e-4


def peak(image):
    """Direction cosines of the highest point, by a parabola on each axis. In the image, l increases to the left."""
    row, col = np.unravel_index(np.argmax(image), image.shape)

    def between(a, b, c):
        return 0.5 * (a - c) / (a - 2 * b + c)

    x = col + between(*image[row, col - 1 : col + 2])
    y = row + between(*image[row - 1 : row + 2, col])
    return -(x - image.shape[1] // 2) * CELL, (y - image.shape[0] // 2) * CELL


def wsclean(folder, ms, name):
    subprocess.run(["wsclean", "-quiet", "-j", "2", "-size", str(SIZE), str(SIZE), "-scale", f"{np.degrees(CELL)}", "-niter", "0",
                    "-pol", "I", "-name", name, ms], cwd=folder, check=True, capture_output=True)  # fmt: skip
    return fits.getdata(os.path.join(folder, f"{name}-dirty.fits"))[0, 0]


def casa(folder, ms, name):
    import casatools
    from casatasks import tclean

    path = os.path.join(folder, name)
    tclean(vis=os.path.join(folder, ms), imagename=path, imsize=SIZE, cell=f"{np.degrees(CELL) * 3600}arcsec", niter=0, specmode="mfs",
           gridder="wproject", wprojplanes=8, pblimit=-1, weighting="natural", stokes="I")  # fmt: skip
    image = casatools.image()
    image.open(f"{path}.residual")
    data = image.getchunk()[:, :, 0, 0].T
    image.close()
    return data


def beam(uv):
    """The resolution, rad: half of the fringe spacing of the longest baseline."""
    longest = np.linalg.norm(uv.uvw_array[:, :2], axis=1).max()
    return 0.5 * C / (uv.freq_array.max() * longest)


def off(image):
    l, m = peak(image)
    return np.hypot(l - L, m - M)


@pytest.mark.parametrize("pols", [("xx", "yy"), ("rr", "ll", "rl", "lr")])
@pytest.mark.parametrize("first", [0, 1])
def test_pyuvdata_reads_the_measurement_set_that_cittert_writes(cittert, pols, first):
    uv = sky_set(pols, first, spread=True)
    uv.write_uvh5(cittert.path("x.uvh5"))
    cittert("convert", "x.uvh5", "x.ms")
    ms = strict("read_ms", cittert.path("x.ms"))
    assert_same(uv, ms)
    assert (ms.telescope.name, ms.vis_units, ms.pol_convention) == ("VLA", "Jy", "avg")
    assert np.abs(ms.telescope._location.xyz() - uv.telescope._location.xyz()).max() < 1e-4
    cittert("convert", "x.ms", "y.uvh5")
    assert_same(uv, strict("read_uvh5", cittert.path("y.uvh5")))
    assert len([n for n in os.listdir(cittert.folder) if n.startswith(".")]) == 0


def test_imagers_put_the_source_in_its_place_and_mirror_images_fail(cittert):
    uv = sky_set()
    uv.write_uvh5(cittert.path("x.uvh5"))
    cittert("convert", "x.uvh5", "x.ms")
    allowed = 0.1 * beam(uv)
    for imager in (wsclean, casa):
        assert off(imager(cittert.folder, "x.ms", f"{imager.__name__}-x")) < allowed, imager.__name__
    wrong = {"turned": ("UVW", lambda v: -v), "mirrored": ("UVW", lambda v: v * [-1, 1, 1]), "conjugated": ("DATA", np.conj)}
    for name, (column, change) in wrong.items():
        subprocess.run(["cp", "-r", "x.ms", f"{name}.ms"], cwd=cittert.folder, check=True)
        with tables.table(cittert.path(f"{name}.ms"), readonly=False, ack=False) as t:
            t.putcol(column, change(t.getcol(column)))
        for imager in (wsclean, casa):
            assert off(imager(cittert.folder, f"{name}.ms", f"{imager.__name__}-{name}")) > 10 * allowed, (name, imager.__name__)


def test_casa_lists_a_set_without_a_warning(cittert):
    from casatasks import casalog, flagdata, listobs

    uv = sky_set(first=1)
    uv.write_uvh5(cittert.path("x.uvh5"))
    cittert("convert", "x.uvh5", "x.ms")
    log = cittert.path("casa.log")
    casalog.setlogfile(log)
    listobs(cittert.path("x.ms"), listfile=cittert.path("x.txt"))
    assert flagdata(cittert.path("x.ms"), mode="summary")["flagged"] == uv.flag_array.sum()
    with open(log) as f:
        assert [line for line in f if "\tWARN" in line or "\tSEVERE" in line] == []


def test_an_imager_of_warm_scenes_is_imaged_in_jansky(cittert):
    """A boresight set in K sr becomes a Measurement Set in Jy with a made-up phase centre. Imagers find the source where it is, with its flux."""
    nowhere = EarthLocation.from_geodetic(0.0, 0.0, 0.0)
    tel = telescope("IMAGER", nowhere, spiral(24, 1.2), mount_type="fixed", feeds=["x", "y"], feed_angle=[np.pi / 2, 0])
    freqs = np.array([93e9, 95e9])
    pairs = [(a, b) for a in range(24) for b in range(a + 1, 24)]
    catalog = {0: dict(cat_name="boresight", cat_type="unprojected", cat_lon=0.0, cat_lat=np.pi / 2, cat_frame="altaz", cat_epoch=None)}
    uv = UVData.new(freq_array=freqs, channel_width=2e9, polarization_array=[1], times=np.array([2460000.75]), telescope=tel,
                    antpairs=pairs, do_blt_outer=True, integration_time=1.0, phase_center_catalog=catalog, vis_units="K str", empty=True)  # fmt: skip
    uv.extra_keywords = {"cittert_frame": "boresight"}
    position = spiral(24, 1.2)
    uv.uvw_array = position[uv.ant_2_array] - position[uv.ant_1_array]
    uv.data_array[:, :, 0] = plain_sum(uv.uvw_array, freqs)
    uv.write_uvh5(cittert.path("x.uvh5"))
    said = cittert("convert", "x.uvh5", "x.ms").stderr
    assert "2 k nu^2 / c^2" in said and "zenith" in said
    ms = strict("read_ms", cittert.path("x.ms"))
    assert list(ms.polarization_array) == [-1, -2] and ms.vis_units == "Jy"
    factor = 2 * 1.380649e-23 * (freqs / C) ** 2 * 1e26
    want = uv.data_array[:, :, 0] * factor
    for pol in range(2):
        assert np.abs(ms.data_array[:, :, pol] - want).max() < 1e-6 * np.abs(want).max()
    for imager in (wsclean, casa):
        image = imager(cittert.folder, "x.ms", imager.__name__)
        assert off(image) < 0.1 * beam(uv), imager.__name__
        assert abs(image.max() / factor.mean() - 1) < 0.05, imager.__name__


def test_windows_in_any_order_of_rows_are_read(cittert):
    uv = sky_set(spread=True)
    uv.flex_spw_id_array, uv.spw_array, uv.Nspws = np.array([0, 0, 1, 1]), np.array([0, 1]), 2
    uv.write_uvh5(cittert.path("x.uvh5"))
    cittert("convert", "x.uvh5", "x.ms")
    uv.write_ms(cittert.path("theirs.ms"))
    whole = f"select from {cittert.path('x.ms')}"
    tables.taql(f"{whole} orderby RAND() giving {cittert.path('mixed.ms')} as plain")
    for name in ("x", "theirs", "mixed"):
        assert_same(uv, strict("read_ms", cittert.path(f"{name}.ms")))
        cittert("convert", f"{name}.ms", f"{name}-back.uvh5")
        assert_same(uv, strict("read_uvh5", cittert.path(f"{name}-back.uvh5")))
    tables.taql(f"{whole} where not (DATA_DESC_ID == 1 and rowid() % 7 == 0) orderby RAND() giving {cittert.path('gaps.ms')} as plain")
    cittert("convert", "gaps.ms", "gaps.uvh5")
    ours, theirs = strict("read_uvh5", cittert.path("gaps.uvh5")), strict("read_ms", cittert.path("gaps.ms"))
    assert ours.flag_array.all(axis=2)[:, 2:].any()
    # Where a window lacks a row, pyuvdata sets the number of samples to 1, cittert to 0.
    assert_same(theirs, ours, [n for n in ARRAYS if n != "nsample_array"])


def test_a_drift_scan_becomes_what_pyuvdata_phases_it_to(cittert, visibilities):
    path = os.path.join(visibilities, "hera_zen.2458432.34569.uvh5")
    cittert("convert", path, "hera.ms")
    ms = strict("read_ms", cittert.path("hera.ms"))
    uv = UVData()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        uv.read_uvh5(path)
        for time in np.unique(uv.time_array):
            rows = uv.time_array == time
            center = ms.phase_center_catalog[ms.phase_center_id_array[ms.time_array == time][0]]
            uv.phase(lon=center["cat_lon"], lat=center["cat_lat"], phase_frame="icrs", epoch=2000, cat_name=f"t{time}", select_mask=rows)
        for u in (uv, ms):
            u.conjugate_bls("ant1<ant2")
            u.reorder_blts(order="time", minor_order="baseline")
    assert len(ms.phase_center_catalog) == uv.Ntimes
    assert np.abs(uv.uvw_array - ms.uvw_array).max() < 1e-6 * np.abs(uv.uvw_array).max()
    assert np.abs(uv.data_array - ms.data_array).max() < 1e-6 * np.abs(uv.data_array).max()
    assert (uv.flag_array == ms.flag_array).all() and (uv.nsample_array == ms.nsample_array).all()


def test_a_set_of_the_mwa_is_read_as_pyuvdata_reads_it(cittert, visibilities):
    with tarfile.open(os.path.join(visibilities, "mwa_birli.ms.tar.gz")) as tar:
        tar.extractall(cittert.folder, filter="data")
    name = "1090008640_birli.ms"
    cittert("convert", name, "mwa.uvh5")
    cittert("convert", "mwa.uvh5", "again.ms")
    theirs, ours, again = UVData(), UVData(), UVData()
    with warnings.catch_warnings():
        # pyuvdata warns that the autocorrelations of this correlator are not exactly real.
        warnings.simplefilter("ignore")
        theirs.read_ms(cittert.path(name))
        ours.read_uvh5(cittert.path("mwa.uvh5"))
        again.read_ms(cittert.path("again.ms"))
    for uv in (ours, again):
        assert_same(theirs, uv)
        assert np.abs(uv.telescope._location.xyz() - theirs.telescope._location.xyz()).max() < 1e-3
    info = cittert.json("info", name)
    assert (info["telescope"], info["n_blts"], info["n_freqs"], info["n_pols"]) == ("MWA", theirs.Nblts, theirs.Nfreqs, theirs.Npols)
    assert info["polarizations"] == ["XX", "YY", "XY", "YX"]
    assert sorted(info["antenna_names"]) == sorted(map(str, theirs.telescope.antenna_names))
    assert info["flagged_fraction"] == pytest.approx(theirs.flag_array.mean(), abs=1e-9)


def test_broken_sets_are_refused_by_name(cittert):
    sky_set().write_uvh5(cittert.path("x.uvh5"))
    cittert("convert", "x.uvh5", "x.ms")
    for file in ("table.dat", "ANTENNA/table.dat", "SPECTRAL_WINDOW/table.f0", "table.f0"):
        path = cittert.path(f"x.ms/{file}")
        with open(path, "rb") as f:
            whole = f.read()
        with open(path, "wb") as f:
            f.write(whole[: len(whole) // 3])
        run = cittert("convert", "x.ms", "y.uvh5", ok=False)
        assert run.returncode == 1 and "x.ms" in run.stderr and "panicked" not in run.stderr
        assert not os.path.exists(cittert.path("y.uvh5"))
        with open(path, "wb") as f:
            f.write(whole)
    assert cittert("convert", "x.uvh5", "x.ms", ok=False).returncode == 1, "an existing set is not overwritten unasked"
