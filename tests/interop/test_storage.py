"""cittert reads the same set from every kind of HDF5 storage: chunk shapes, filters, byte orders, chunk indices, chunked strings."""
import h5py
import numpy as np
import pytest
from kinds import make
from test_ms import strict

WAYS = {
    "gzip": dict(compression="gzip", chunks=(7, 2, 3)),
    "gzip, shuffled, with checksums": dict(compression="gzip", shuffle=True, fletcher32=True, chunks=(10, 4, 1)),
    "lzf": dict(compression="lzf", shuffle=True, chunks=(1, 4, 4)),
    "checksums alone": dict(fletcher32=True, chunks=(84, 1, 1)),
    "filters of other kinds": dict(compression="gzip", chunks=(16, 4, 4), others=True),
    "chunks without filters": dict(chunks=(9, 3, 1)),
    "chunks beyond the rows": dict(compression="gzip", chunks=(1000, 3, 4), maxshape=(None, 4, 4)),
    "big-endian": dict(compression="gzip", chunks=(50, 2, 2), order=">"),
    "double": dict(compression="lzf", chunks=(50, 2, 2), double=True),
}
ROWS = ("visdata", "flags", "nsamples")


def typed(values, order="<", double=False):
    if values.dtype == bool:
        return values
    kind = values.dtype.kind
    return values.astype(f"{order}{kind}{(2 if kind == 'c' else 1) * (8 if double else 4)}")


def stored(source, target, libver, chunks, others=False, **how):
    """Copy a UVH5 file and store its arrays in this way. With `others`, some arrays have filters that exist for some types only."""
    kinds = {k: how.pop(k) for k in ("order", "double") if k in how}
    with h5py.File(source) as old, h5py.File(target, "w", libver=libver) as new:
        old.copy("Header", new)
        for name in ROWS:
            szip = dict(compression="szip", compression_opts=("nn", 8)) if others and name == "nsamples" else {}
            new.create_dataset(f"Data/{name}", data=typed(old[f"Data/{name}"][()], **kinds), chunks=chunks, **how | szip)
        how.pop("maxshape", None)
        for name in ("uvw_array", "time_array", "ant_1_array", "freq_array", "antenna_positions", "antenna_names"):
            values = new[f"Header/{name}"][()]
            del new[f"Header/{name}"]
            small = dict(scaleoffset=0) if others and name == "ant_1_array" else how
            new.create_dataset(f"Header/{name}", data=values, chunks=tuple(max(1, n // 3) for n in values.shape), **small)


@pytest.mark.parametrize("libver", ["earliest", ("v110", "v110")], ids=["earliest", "v110"])
@pytest.mark.parametrize("way", WAYS)
def test_a_set_reads_the_same_however_it_is_stored(cittert, way, libver):
    uv = make("VLA")
    uv.flag_array[5:30, 1:3] = True
    uv.nsample_array[3::5] = 2.5
    uv.write_uvh5(cittert.path("x.uvh5"))
    stored(cittert.path("x.uvh5"), cittert.path("y.uvh5"), libver, **WAYS[way])
    with h5py.File(cittert.path("y.uvh5")) as f:
        assert f["Data/visdata"].chunks == WAYS[way]["chunks"]
    for back in ("z.uvh5", "z.uvfits"):
        # Without a compression, a file of the same format is a copy.
        cittert("convert", "y.uvh5", back, *(["--compression", "lzf"] if back.endswith("h5") else []))
        ours = strict("read_uvh5" if back.endswith("h5") else "read_uvfits", cittert.path(back))
        ours.reorder_blts(order="time", minor_order="baseline")
        uv.reorder_blts(order="time", minor_order="baseline")
        for name in ("data_array", "flag_array", "nsample_array", "ant_1_array", "ant_2_array"):
            assert np.array_equal(getattr(ours, name), getattr(uv, name)), (back, name)
        assert np.abs(ours.uvw_array - uv.uvw_array).max() < 1e-6 * np.abs(uv.uvw_array).max(), back
        assert np.abs(ours.time_array - uv.time_array).max() < 1e-8 and list(ours.telescope.antenna_names) == list(uv.telescope.antenna_names)


def test_chunks_that_were_never_written_read_as_the_fill_value(cittert):
    uv = make("VLA")
    uv.write_uvh5(cittert.path("x.uvh5"))
    with h5py.File(cittert.path("x.uvh5"), "a") as f:
        del f["Data/nsamples"]
        d = f.create_dataset("Data/nsamples", uv.data_array.shape, "f4", chunks=(8, 2, 4), compression="gzip", fillvalue=3.0)
        d[8:24, :2] = 1.0
        want = d[()]
    assert {1.0, 3.0} == set(np.unique(want))
    cittert("convert", "x.uvh5", "z.uvh5", "--compression", "none")
    assert np.array_equal(strict("read_uvh5", cittert.path("z.uvh5")).nsample_array, want)
