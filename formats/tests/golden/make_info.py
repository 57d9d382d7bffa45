"""Golden values of tests/golden/info.json: what pyuvdata says of the visibility files of the shared data.

    python make_info.py FOLDER_OF_VISIBILITIES > info.json

Made with pyuvdata 3.2.8 and numpy. The files are public data sets; their sources are listed in the README beside them.
"""
import json
import sys
import warnings
from pathlib import Path

import numpy as np
from pyuvdata import UVData
from pyuvdata.utils import polnum2str

warnings.simplefilter("ignore")
out = {}
for path in sorted(Path(sys.argv[1]).glob("*.uv*")):
    uv = UVData.from_file(path, check_autos=False, fix_autos=False)
    centre = list(uv.phase_center_catalog.values())[0]
    names = ["I" if p == 1 else polnum2str(p).upper() for p in uv.polarization_array]
    good = ~uv.flag_array
    rows = [0, uv.Nblts // 2, uv.Nblts - 1]
    out[path.name] = {
        "telescope": uv.telescope.name,
        "antenna_names": [str(n) for n in uv.telescope.antenna_names],
        "n_antennas_data": int(uv.Nants_data),
        "n_blts": int(uv.Nblts),
        "n_bls": int(uv.Nbls),
        "n_times": int(uv.Ntimes),
        "polarizations": names,
        "freq_hz": [float(f) for f in (uv.freq_array[0], uv.freq_array[-1])],
        "n_freqs": int(uv.Nfreqs),
        "channel_width_hz": float(uv.channel_width[0]),
        "integration_s": float(uv.integration_time.mean()),
        "unit": uv.vis_units,
        "phase_center": [centre["cat_name"], centre["cat_type"], centre["cat_frame"], float(centre["cat_lon"]), float(centre["cat_lat"])],
        "flagged_fraction": float(uv.flag_array.mean()),
        "n_unflagged": {n: int(good[..., k].sum()) for k, n in enumerate(names)},
        "mean_abs_unflagged": {
            n: float(np.abs(uv.data_array[..., k].astype(complex))[good[..., k]].mean()) for k, n in enumerate(names)
        },
        # A few rows whole: antenna numbers, time, uvw, and the first channel and polarisation.
        "rows": [
            [int(uv.ant_1_array[r]), int(uv.ant_2_array[r]), float(uv.time_array[r])]
            + [float(u) for u in uv.uvw_array[r]]
            + [float(uv.data_array[r, 0, 0].real), float(uv.data_array[r, 0, 0].imag), float(uv.nsample_array[r, 0, 0])]
            for r in rows
        ],
        "site": [float(x) for x in (uv.telescope.location.lat.rad, uv.telescope.location.lon.rad, uv.telescope.location.height.value)],
        "last_antenna_enu": [float(x) for x in uv.telescope.get_enu_antpos()[-1]],
    }
json.dump(out, sys.stdout, indent=1)
