"""Files with model and residual visibilities, with appended rows, with compression and with delays: other programs read them without a warning."""
import warnings

import h5py
import numpy as np
from astropy.io import fits
from casacore import tables
from pyuvdata import UVCal
from test_ms import sky_set, strict

MODEL = "l_rad,m_rad,flux_jy\n0.012,0.005,2.0\n"


def written(cittert):
    uv = sky_set(pols=("rr", "ll"), first=1)
    uv.write_uvh5(cittert.path("x.uvh5"))
    with open(cittert.path("s.csv"), "w") as f:
        f.write(MODEL)
    return uv


def test_a_prediction_is_put_into_the_file_and_goes_to_the_columns_of_a_measurement_set(cittert):
    uv = written(cittert)
    cittert("predict", "x.uvh5", "--model", "s.csv", "--into", "model,residual", "-o", "x.uvh5", "--overwrite")
    ours = strict("read_uvh5", cittert.path("x.uvh5"))
    assert np.array_equal(ours.data_array, uv.data_array) and np.array_equal(ours.flag_array, uv.flag_array)
    with h5py.File(cittert.path("x.uvh5")) as f:
        model, residual = f["Data/model"][()], f["Data/residual"][()]
    assert np.abs(model - uv.data_array).max() < 1e-4 and np.abs(model + residual - uv.data_array).max() < 1e-6
    said = cittert("convert", "x.uvh5", "x.ms").stderr
    assert '"residual" is kept as "corrected"' in said
    with tables.table(cittert.path("x.ms"), ack=False) as t:
        data, of_model, corrected = (t.getcol(c) for c in ("DATA", "MODEL_DATA", "CORRECTED_DATA"))
    assert np.abs(data - of_model - corrected).max() < 1e-6 and np.abs(of_model).max() > 1.9
    cittert("convert", "x.ms", "back.uvh5")
    with h5py.File(cittert.path("back.uvh5")) as f:
        assert {"model", "corrected"} <= set(f["Data"])
        assert np.abs(f["Data/corrected"][()]).max() < 1e-4
    cittert("dirty", "x.uvh5", "--column", "model", "--size", 128, "--cell", "10arcsec", "-o", "m.fits.gz")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert fits.getdata(cittert.path("m.fits.gz")).shape == (1, 1, 128, 128)


def test_rows_are_appended_and_others_are_refused(cittert):
    uv = written(cittert)
    times = np.unique(uv.time_array)
    uv.select(times=times[:2], inplace=False).write_uvh5(cittert.path("one.uvh5"))
    uv.select(times=times[2:], inplace=False).write_uvh5(cittert.path("two.uvh5"))
    cittert("convert", "one.uvh5", "all.uvh5", "--compression", "gzip-5")
    before = open(cittert.path("all.uvh5"), "rb").read()
    said = cittert("convert", "two.uvh5", "all.uvfits", "--append", ok=False)
    assert said.returncode == 1 and "UVH5 only" in said.stderr
    uv.select(freq_chans=[0, 1], inplace=False).write_uvh5(cittert.path("half.uvh5"))
    said = cittert("convert", "half.uvh5", "all.uvh5", "--append", ok=False)
    assert said.returncode == 1 and "channels" in said.stderr and "all.uvh5" in said.stderr
    assert open(cittert.path("all.uvh5"), "rb").read() == before
    cittert("convert", "two.uvh5", "all.uvh5", "--append", "--compression", "gzip-5")
    ours = strict("read_uvh5", cittert.path("all.uvh5"))
    for u in (ours, uv):
        u.reorder_blts(order="time", minor_order="baseline")
    for name in ("data_array", "flag_array", "nsample_array", "time_array", "uvw_array"):
        assert np.array_equal(getattr(ours, name), getattr(uv, name)), name
    with h5py.File(cittert.path("all.uvh5")) as f:
        assert f["Data/visdata"].compression == "gzip"


def test_delays_are_read_and_written_as_pyuvdata_does(cittert):
    uv = written(cittert)
    tel = uv.telescope
    tel.Nfeeds, tel.feed_array = 2, np.tile(["r", "l"], (tel.Nants, 1))
    tel.feed_angle, tel.mount_type = np.zeros((tel.Nants, 2)), ["alt-az"] * tel.Nants
    more = dict(cal_style="redundant", gain_convention="divide", jones_array=[-1, -2], time_array=np.unique(uv.time_array)[:1], integration_time=600.0,
                telescope=tel, cal_type="delay", freq_range=np.array([[1.39e9, 1.44e9]]), wide_band=True, empty=True)  # fmt: skip
    theirs = UVCal.new(**more)
    theirs.delay_array = np.random.default_rng(3).normal(size=theirs.delay_array.shape) * 2e-9
    theirs.write_calh5(cittert.path("d.calh5"))
    cittert("applycal", "x.uvh5", "d.calh5", "--invert", "-o", "y.uvh5")
    gains = np.exp(-2j * np.pi * theirs.delay_array[:, 0, 0, :][:, None, :] * uv.freq_array[None, :, None])
    at = {n: k for k, n in enumerate(theirs.ant_array)}
    a, b = ([at[n] for n in ants] for ants in (uv.ant_1_array, uv.ant_2_array))
    want = uv.data_array * gains[a] * gains[b].conj()
    assert np.abs(strict("read_uvh5", cittert.path("y.uvh5")).data_array - want).max() < 1e-5
    cittert("convert", "d.calh5", "g.calh5")
    cittert("convert", "g.calh5", "again.calh5", "--delays")
    ours = UVCal()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ours.read_calh5(cittert.path("again.calh5"))
        ours.check()
    assert ours.cal_type == "delay" and np.abs(ours.delay_array - theirs.delay_array).max() < 1e-15
