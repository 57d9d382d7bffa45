"""Everything that is in a file of visibilities, by its name: Measurement Sets as casacore sees them, HDF5 files as h5py does, FITS by bytes."""
import os

import h5py
import numpy as np
from casacore import tables


def as_bytes(value):
    """A value as bytes that differ where the value differs."""
    if isinstance(value, dict):
        return repr({k: as_bytes(v) for k, v in value.items()}).encode()
    array = np.asarray(value)
    return repr((str(array.dtype), array.shape, array.tolist() if array.dtype.kind in "OU" else array.tobytes())).encode()


def of_table(path, top, found):
    """Columns, keywords and descriptions of a table and of its subtables."""
    name = os.path.relpath(path, top) if path != top else "MAIN"
    with tables.table(path, ack=False) as t:
        found[f"{name}: rows"] = str(t.nrows()).encode()
        keywords = t.getkeywords()
        links = {k: v for k, v in keywords.items() if isinstance(v, str) and v.startswith("Table: ")}
        found[f"{name}: keywords"] = as_bytes({k: v for k, v in keywords.items() if k not in links})
        found[f"{name}: subtables"] = repr(sorted(links)).encode()
        for column in t.colnames():
            found[f"{name}.{column}: keywords"] = as_bytes(t.getcolkeywords(column))
            found[f"{name}.{column}: description"] = repr(sorted((k, repr(v)) for k, v in t.getcoldesc(column).items())).encode()
            try:
                cells = as_bytes(t.getcol(column))
            except RuntimeError:
                # Cells of different shapes, or without a value.
                cells = b"".join(as_bytes(t.getcell(column, r)) if t.iscelldefined(column, r) else b"-" for r in range(t.nrows()))
            found[f"{name}.{column}"] = cells
    for link in links.values():
        inner = link.removeprefix("Table: ")
        of_table(inner if os.path.isabs(inner) else os.path.join(path, inner), top, found)


def of_hdf5(path):
    """Datasets with their types, filters and attributes, and the attributes of groups."""
    found = {}

    def visit(name, item):
        found[f"{name}: attributes"] = as_bytes(dict(item.attrs))
        if isinstance(item, h5py.Dataset):
            found[f"{name}: storage"] = repr((item.dtype, item.shape, item.chunks, item.compression, item.compression_opts)).encode()
            found[name] = b"empty" if item.shape is None else as_bytes(item[()])

    with h5py.File(path) as f:
        visit("/", f)
        f.visititems(visit)
    return found


def of_fits(path):
    """The cards of the first header, and all bytes after it."""
    with open(path, "rb") as f:
        data = f.read()
    cards = [data[k : k + 80] for k in range(0, len(data), 80)]
    end = next(k for k, card in enumerate(cards) if card.rstrip() == b"END")
    rest = -(-80 * (end + 1) // 2880) * 2880
    history = [card for card in cards[:end] if card.startswith(b"HISTORY")]
    return {"cards": b"".join(c for c in cards[:end] if c not in history), "history": b"".join(history), "rest": data[rest:]}


def contents(path):
    path = str(path)
    if os.path.isdir(path):
        found = {}
        of_table(path, path, found)
        return found
    return of_hdf5(path) if h5py.is_hdf5(path) else of_fits(path)


def changed(before, after):
    """Names of all that differs."""
    return {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
