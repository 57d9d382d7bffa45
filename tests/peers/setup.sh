#!/bin/bash
# Install the peers (WSClean, CASA, ducc0, pyuvdata, ehtim) on a Debian 12 machine. It is safe to run this script again.
#   PEERS=<dir> ./setup.sh        (default ~/.cache/cittert-peers)   then:  . $PEERS/env.sh
# Packages come from the sources that apt and pip are configured to use. The script fetches nothing else.
set -euo pipefail
PEERS=${PEERS:-$HOME/.cache/cittert-peers}
SUDO=; [ "$(id -u)" = 0 ] || SUDO=sudo
mkdir -p "$PEERS"

need=()
for p in wsclean casacore-tools casacore-data casacore-data-igrf time git python3-venv libgfortran5; do
  dpkg -s "$p" >/dev/null 2>&1 || need+=("$p")
done
if [ ${#need[@]} -gt 0 ]; then
  $SUDO apt-get update -qq
  DEBIAN_FRONTEND=noninteractive $SUDO apt-get install -y --no-install-recommends "${need[@]}"
fi

# casatools has wheels for Python 3.10 to 3.13 only. Debian 12 has Python 3.11.
PYTHON=${PYTHON:-$(command -v python3.11 || command -v python3)}
[ -x "$PEERS/venv/bin/python" ] || "$PYTHON" -m venv "$PEERS/venv"
PIP="$PEERS/venv/bin/python -m pip --disable-pip-version-check -q"
INSTALLED=$($PIP freeze)
# The versions with which the tests' tolerances were set. Packages are installed one at a time, so that one failure does not stop the others.
for p in numpy==2.3.5 scipy==1.17.1 astropy==8.0.2 h5py==3.16.0 numba==0.62.1 matplotlib==3.11.2 python-casacore==3.8.1 \
         ducc0==0.42.0 pyuvdata==3.2.8 pyuvsim==1.4.2 hdf5plugin==7.1.0 six==1.17.0 pytest==9.2.0 casaconfig==1.5.2 casatools==6.7.0.31 casatasks==6.7.0.31 ehtim==1.3.2 playwright==1.56.0; do
  n=${p%%==*}
  grep -qixF "$p" <<<"$INSTALLED" || $PIP install "$p" || $PIP install "$n" || echo "setup: $n NOT installed" >&2
done

# CASA must work without a network. The wheel of python-casacore carries a complete set of measures data. Debian's casacore-data
# lacks the table IERSeop2000, and casatools refuses to import without it.
DATA=$("$PEERS/venv/bin/python" -c 'import casacore, os; print(os.path.join(os.path.dirname(casacore.__file__), "data"))')
cat > "$PEERS/casasiteconfig.py" <<EOF
datapath = ['$DATA']
measurespath = '$DATA'
measures_auto_update = False
data_auto_update = False
nologger = True
nogui = True
agg = True
nologfile = True
casaconfig_verbose = 0
EOF
cat > "$PEERS/env.sh" <<EOF
export PEERS=$PEERS
export CITTERT_PY=$PEERS/venv/bin/python
export CASASITECONFIG=$PEERS/casasiteconfig.py
export CITTERT_WL=\${CITTERT_WL:-$PEERS/wl} CITTERT_WORK=\${CITTERT_WORK:-$PEERS/scratch} CITTERT_RES=\${CITTERT_RES:-$PEERS/results}
# The threads of CASA and of ehtim (OpenBLAS) wait actively for each other. On two shared cores that makes them up to 14 times slower.
# They use one thread unless a run sets another number.
export OMP_NUM_THREADS=\${OMP_NUM_THREADS:-1} OPENBLAS_NUM_THREADS=\${OPENBLAS_NUM_THREADS:-1} MPLBACKEND=Agg
EOF
. "$PEERS/env.sh"
cd "$PEERS"
wsclean --version | grep -m1 version
"$CITTERT_PY" - <<'EOF'
import importlib
for m in ("casatools", "casatasks", "ducc0", "pyuvdata", "ehtim", "casacore", "astropy"):
    try:
        k = importlib.import_module(m)
        print(m, getattr(k, "__version__", "") or getattr(k, "version_string", lambda: "ok")())
    except Exception as e:
        print(m, "FAILS:", type(e).__name__, e)
EOF
