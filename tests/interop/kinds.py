"""Make small files of the kinds that observatories write, with pyuvdata, CASA and astropy.

They differ in spectral windows, sources, antenna numbers, units and types of numbers."""
import os

import h5py
import numpy as np
from astropy.coordinates import EarthLocation
from astropy.io import fits
from astropy.time import Time
from pyuvdata import UVData
from pyuvdata.utils import polstr2num
from test_ms import spiral, telescope

PLACES = {
    "VLA": (-107.6184, 34.0788, 2115.0),
    "SMA": (-155.4777, 19.8243, 4083.9),
    "VLBA": (-107.6184, 34.0788, 2115.0),
    "MWA": (116.6708, -26.7033, 377.8),
    "ATA": (-121.4733, 40.8178, 1008.0),
    "HERA": (21.4283, -30.7215, 1051.7),
}
SKY = [("3C286", 3.5392, 0.5325), ("J1331+3030", 3.6, 0.55), ("OQ208", 3.68, 0.4966)]


def make(name, n=8, radius=500.0, numbers=None, names=None, diameters=None, freqs=None, width=1e6, spw=None, pols=("rr", "ll", "rl", "lr"),
         centers=1, times=3, autos=False, unit="Jy", cat_type="sidereal", pairs=None):  # fmt: skip
    """A set with a real geometry, in which visibilities, flags and numbers of samples are random."""
    rng = np.random.default_rng(sum(map(ord, name)) + n)
    tel = telescope(name, EarthLocation.from_geodetic(*PLACES[name]), spiral(n, radius), 1)
    if numbers is not None:
        tel.antenna_numbers = np.asarray(numbers)
    if names is not None:
        tel.antenna_names = np.asarray(names)
    if diameters is not None:
        tel.antenna_diameters = np.asarray(diameters, float)
    freqs = np.array([1.40e9, 1.401e9, 1.402e9, 1.403e9] if freqs is None else freqs, float)
    own = tel.antenna_numbers
    pairs = pairs or [(a, b) for i, a in enumerate(own) for b in own[i + (not autos) :]]
    jd = Time("2022-09-10T03:20:00").jd + np.arange(times) * 30 / 86400
    if cat_type == "sidereal":
        catalog = {k: dict(cat_name=s, cat_type="sidereal", cat_lon=ra, cat_lat=dec, cat_frame="icrs", cat_epoch=2000.0)
                   for k, (s, ra, dec) in enumerate(SKY[:centers])}  # fmt: skip
    else:
        at = (0.0, np.pi / 2) if cat_type == "unprojected" else (0.0, 1.2)  # pyuvdata 3.2.8 counts azimuths in the other direction
        catalog = {0: dict(cat_name=cat_type, cat_type=cat_type, cat_lon=at[0], cat_lat=at[1], cat_frame="altaz", cat_epoch=2000.0)}
    more = {}
    if spw is not None:
        more = dict(flex_spw_id_array=np.asarray(spw))
    of_row = np.repeat(np.arange(times) % centers, len(pairs))
    uv = UVData.new(freq_array=freqs, channel_width=width, polarization_array=list(pols), times=jd, telescope=tel, antpairs=pairs,
                    do_blt_outer=True, time_axis_faster_than_bls=False, integration_time=30.0, phase_center_catalog=catalog,
                    phase_center_id_array=of_row, vis_units=unit, empty=True, **more)  # fmt: skip
    uv.polarization_array = np.array([polstr2num(p) for p in pols])
    uv.set_uvws_from_antenna_positions(update_vis=False)
    shape = uv.data_array.shape
    uv.data_array = (rng.normal(size=shape) + 1j * rng.normal(size=shape)).astype(np.complex64)
    same = uv.ant_1_array == uv.ant_2_array
    if same.any():
        real = [k for k, p in enumerate(uv.polarization_array) if p in (-1, -2, -5, -6)]
        for k in real:
            uv.data_array[same, :, k] = np.abs(uv.data_array[same, :, k])
        if uv.Npols == 4:
            uv.data_array[same, :, 3] = uv.data_array[same, :, 2].conj()
    uv.flag_array = rng.random(shape) < 0.05
    uv.nsample_array = rng.uniform(0.5, 4, shape).astype(np.float32)
    if unit == "Jy":
        uv.pol_convention = "avg"
    return uv


def vla_ms(folder):
    """Three spectral windows of two channel widths and two fields, as CASA's `split` writes them."""
    from casatasks import split

    bands = [1.0e9 + 1e6 * np.arange(4), 1.5e9 + 1e6 * np.arange(4), 1.8e9 + 2e6 * np.arange(6)]
    width = np.repeat([1e6, 1e6, 2e6], [4, 4, 6])
    uv = make("VLA", freqs=np.concatenate(bands), width=width, spw=np.repeat([0, 1, 2], [4, 4, 6]), centers=2, times=4)
    uv.write_ms(os.path.join(folder, "raw.ms"))
    split(os.path.join(folder, "raw.ms"), os.path.join(folder, "vla.ms"), datacolumn="data", keepflags=True)
    return "vla.ms"


def sma_ms(folder):
    """Two sidebands of two windows each, with decreasing frequencies in the lower one; autocorrelations; correlator units; one hand."""
    chunks = [229e9 - 1e6 * np.arange(5), 227e9 - 1e6 * np.arange(5), 239e9 + 1e6 * np.arange(5), 241e9 + 1e6 * np.arange(5)]
    uv = make("SMA", n=7, radius=60.0, freqs=np.concatenate(chunks), spw=np.repeat([0, 1, 2, 3], 5), pols=("ll",), centers=3, times=6, autos=True,
              unit="uncalib", numbers=[1, 2, 3, 4, 5, 6, 8], diameters=np.full(7, 6.0))  # fmt: skip
    uv.write_ms(os.path.join(folder, "sma.ms"))
    return "sma.ms"


def vlba_uvfits(folder):
    """Two IFs, three sources, antenna positions from the centre of the Earth, the parameter FREQSEL, and a table that cittert does not read."""
    freqs = np.concatenate([4.98e9 + 5e5 * np.arange(8), 5.02e9 + 5e5 * np.arange(8)])
    names = ["BR", "FD", "HN", "KP", "LA", "MK", "NL", "OV", "PT", "SC"]
    uv = make("VLBA", n=10, radius=4e6, names=names, freqs=freqs, width=5e5, spw=np.repeat([0, 1], 8), centers=3, times=6, unit="uncalib")
    path = os.path.join(folder, "vlba.uvfits")
    uv.write_uvfits(path)
    with fits.open(path, mode="update") as hdus:
        an = hdus["AIPS AN"]
        centre = np.array([an.header[f"ARRAY{k}"] for k in "XYZ"])
        longitude = np.arctan2(centre[1], centre[0])
        x, y, z = an.data["STABXYZ"].T
        an.data["STABXYZ"] = np.column_stack([x * np.cos(longitude) - y * np.sin(longitude), x * np.sin(longitude) + y * np.cos(longitude), z]) + centre
        for k in "XYZ":
            an.header[f"ARRAY{k}"] = 0.0
        hdus.append(fits.BinTableHDU.from_columns([fits.Column("TIME", "D", array=np.zeros(3)), fits.Column("REAL1", "2E", array=np.zeros((3, 2)))], name="AIPS CL"))
    return "vlba.uvfits"


def mwa_uvfits(folder, tiles=128):
    """Antennas with names of tiles, linear hands, and with `tiles` above 255 more antennas than the parameter BASELINE can hold."""
    names = [f"Tile{k + 11:04d}" for k in range(tiles)]
    pairs = [(a, b) for a in range(1, tiles + 1) for b in range(a, tiles + 1) if (a * b) % 7 == 0]
    uv = make("MWA", n=tiles, radius=1400.0, names=names, freqs=1.67e8 + 4e4 * np.arange(4), width=4e4, pols=("xx", "yy", "xy", "yx"), times=2,
              pairs=pairs, unit="Jy", autos=True, diameters=np.full(tiles, 4.4))  # fmt: skip
    uv.write_uvfits(os.path.join(folder, "mwa.uvfits"))
    return "mwa.uvfits"


def mwa_256_uvfits(folder):
    return mwa_uvfits(folder, 288)


def ata_uvh5(folder):
    """Antenna names such as 1c, antenna numbers with gaps, one dish of another diameter; numbers of samples and visibilities in double precision; gzip."""
    names = ["1a", "1c", "1e", "1h", "1k", "2a", "2b", "2h", "3c", "3d"]
    uv = make("ATA", n=10, radius=150.0, names=names, numbers=[1, 3, 5, 8, 11, 17, 18, 24, 300, 301], diameters=[6.1] * 9 + [6.25],
              freqs=3.0e9 + 5e5 * np.arange(5), width=5e5, pols=("xx", "yy", "xy", "yx"), unit="uncalib")  # fmt: skip
    path = os.path.join(folder, "ata.uvh5")
    uv.data_array = uv.data_array.astype(np.complex128)
    uv.write_uvh5(path, data_compression="gzip", data_write_dtype="c16")
    with h5py.File(path, "a") as f:
        samples = f["Data/nsamples"][()]
        del f["Data/nsamples"]
        f["Data/nsamples"] = samples.astype(float)
    return "ata.uvh5"


def old_ata_uvh5(folder):
    """The same set in the first version of UVH5: one phase centre in keywords, a fourth axis, one width for all channels."""
    ata_uvh5(folder)
    with h5py.File(os.path.join(folder, "ata.uvh5"), "a") as f:
        for name in ("visdata", "flags", "nsamples"):
            whole = f[f"Data/{name}"]
            values, dtype = whole[()], whole.dtype
            del f[f"Data/{name}"]
            f.create_dataset(f"Data/{name}", data=values[:, None], dtype=dtype)
        h = f["Header"]
        for name in ("phase_center_catalog", "phase_center_id_array", "Nphase", "version", "channel_width", "phase_center_app_ra",
                     "phase_center_app_dec", "phase_center_frame_pa"):  # fmt: skip
            if name in h:
                del h[name]
        frequencies = h["freq_array"][()]
        del h["freq_array"]
        h["freq_array"], h["channel_width"] = frequencies[None], 5e5
        h["phase_type"], h["phase_center_ra"], h["phase_center_dec"] = np.bytes_("phased"), SKY[0][1], SKY[0][2]
        h["phase_center_epoch"], h["phase_center_frame"], h["object_name"] = 2000.0, np.bytes_("icrs"), np.bytes_(SKY[0][0])
    return "ata.uvh5"


def hera_uvh5(folder):
    """A drift scan with integer visibilities, and with antennas that have no data."""
    uv = make("HERA", n=9, radius=70.0, numbers=[0, 1, 11, 12, 23, 24, 36, 320, 350], names=[f"HH{k}" for k in (0, 1, 11, 12, 23, 24, 36, 320, 350)],
              freqs=1.2e8 + 1e5 * np.arange(6), width=1e5, pols=("xx", "yy", "xy", "yx"), cat_type="unprojected", autos=True, unit="uncalib",
              pairs=[(a, b) for a in (0, 1, 11, 12, 23) for b in (0, 1, 11, 12, 23) if a <= b])  # fmt: skip
    uv.data_array = np.round(100 * uv.data_array)
    uv.nsample_array[:] = 1
    uv.write_uvh5(os.path.join(folder, "hera.uvh5"), data_write_dtype=np.dtype([("r", "<i4"), ("i", "<i4")]))
    return "hera.uvh5"


def driftscan_uvh5(folder):
    """A set phased to a direction that is fixed to the Earth."""
    uv = make("HERA", n=6, radius=90.0, freqs=1.5e8 + 1e5 * np.arange(3), width=1e5, pols=("xx", "yy"), cat_type="driftscan")
    uv.write_uvh5(os.path.join(folder, "drift.uvh5"))
    return "drift.uvh5"


def windows_uvh5(folder):
    """Spectral windows of unequal lengths with the numbers 7 and 4; three phase centres."""
    freqs = np.concatenate([2.0e9 + 1e6 * np.arange(3), 3.0e9 + 2e6 * np.arange(5)])
    uv = make("VLA", freqs=freqs, width=np.repeat([1e6, 2e6], [3, 5]), spw=[7] * 3 + [4] * 5, centers=3, times=6)
    uv.write_uvh5(os.path.join(folder, "windows.uvh5"), data_compression="lzf")
    return "windows.uvh5"


KINDS = [vla_ms, sma_ms, vlba_uvfits, mwa_uvfits, mwa_256_uvfits, ata_uvh5, old_ata_uvh5, hera_uvh5, driftscan_uvh5, windows_uvh5]
