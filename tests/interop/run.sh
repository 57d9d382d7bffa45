#!/usr/bin/env bash
# Install the peers (once, below $PEERS, by default ~/.cache/cittert-peers), then let them judge the files that cittert writes.
# The program under test is $CITTERT, built with `--features ms,mpi`; `make interop` builds it. Arguments go to pytest.
# The tests over real public visibilities read the folder $CITTERT_DATA, which holds visibilities/.
set -euo pipefail
HERE=$(cd "$(dirname "$0")" && pwd)
ROOT=$(cd "$HERE/../.." && pwd)
export CITTERT_DATA=${CITTERT_DATA:-$ROOT/../shared/data}
export PEERS=${PEERS:-$HOME/.cache/cittert-peers}

fail() {
  echo "interop: $1" >&2
  exit 1
}

[ -d "$CITTERT_DATA/visibilities" ] || fail "there is no folder $CITTERT_DATA/visibilities: set CITTERT_DATA to the folder that holds visibilities/"
[ "${1:-}" != --check ] || exit 0
CITTERT_DATA=$(cd "$CITTERT_DATA" && pwd)
export CITTERT=${CITTERT:-${CARGO_TARGET_DIR:-$ROOT/target}/release/cittert}
[ -x "$CITTERT" ] || fail "there is no program $CITTERT: run \`make interop\`, or set CITTERT to one built with --features ms,mpi"
# This example writes a small file of every kind.
export CITTERT_SAMPLES=${CITTERT_SAMPLES:-$(dirname "$CITTERT")/examples/samples}
[ -x "$CITTERT_SAMPLES" ] || fail "there is no program $CITTERT_SAMPLES: run \`make interop\`, or build the example samples of cittert-formats"

# Names of the modules and programs that are not installed.
MODULES="pyuvdata pyuvsim ducc0 casatools casatasks casacore ehtim astropy h5py hdf5plugin pytest six playwright"
missing() {
  if [ ! -f "$PEERS/env.sh" ]; then
    echo "everything"
    return
  fi
  . "$PEERS/env.sh"
  command -v wsclean >/dev/null || echo wsclean
  "$CITTERT_PY" -c 'import importlib.util, sys; print(*(m for m in sys.argv[1:] if importlib.util.find_spec(m) is None))' $MODULES
}
# The file ready-3 says that the present version of setup.sh has installed everything. A failed download is tried again.
if [ ! -f "$PEERS/ready-3" ]; then
  for attempt in 1 2 3; do
    if bash "$ROOT/tests/peers/setup.sh"; then
      [ -z "$(missing | xargs)" ] && touch "$PEERS/ready-3" && break
    fi
    echo "interop: the installation of the other programs failed (attempt $attempt of 3)" >&2
    sleep 5
  done
fi
LACKING=$(missing | xargs)
[ -z "$LACKING" ] || fail "could not install: $LACKING. The network is the most frequent cause: run the command again, and it continues where it stopped"
. "$PEERS/env.sh"
cd "$HERE"
exec "$CITTERT_PY" -m pytest -q -p no:cacheprovider "$@" .
