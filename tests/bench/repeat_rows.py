"""Make a large set for memory tests: the rows of a small one N times, each time later. usage: repeat_rows.py IN.uvh5 OUT.uvh5 N

10 times workload b is 108 million visibilities of Stokes I."""
import sys

import h5py
import numpy as np


def main(source, target, n):
    with h5py.File(source, "r") as old, h5py.File(target, "w") as new:
        n_rows = int(old["Header/Nblts"][()])
        header = new.create_group("Header")
        span = float(np.ptp(old["Header/time_array"][:])) + 60.0 / 86400
        for name, item in old["Header"].items():
            rows = isinstance(item, h5py.Dataset) and item.ndim > 0 and item.shape[0] == n_rows
            if not rows:
                old.copy(item, header)
                continue
            values = np.concatenate([item[:]] * n)
            if name == "time_array":
                values += np.repeat(np.arange(n), n_rows) * span
            header.create_dataset(name, data=values)
        for name, factor in (("Nblts", n), ("Ntimes", n)):
            header[name][()] = int(header[name][()]) * factor
        data = new.create_group("Data")
        for name, item in old["Data"].items():
            values = item[:]
            out = data.create_dataset(name, (n * n_rows, *item.shape[1:]), dtype=item.dtype)
            for k in range(n):
                out[k * n_rows : (k + 1) * n_rows] = values


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
