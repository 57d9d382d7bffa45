#!/usr/bin/env bash
# Install the peers (once; below $PEERS, default ~/.cache/cittert-peers) and let them judge what we write.
# The program judged is $CITTERT, built with `--features ms`; `make interop` builds it.
set -euo pipefail
HERE=$(cd "$(dirname "$0")" && pwd)
ROOT=$(cd "$HERE/../.." && pwd)
export PEERS=${PEERS:-$HOME/.cache/cittert-peers}
SHARED=${CITTERT_SHARED:-$ROOT/../shared}

fail() {
  echo "interop: $1" >&2
  exit 1
}

export CITTERT=${CITTERT:-$ROOT/target/release/cittert}
[ -x "$CITTERT" ] || fail "there is no program $CITTERT: run \`make interop\`, or set CITTERT to one built with --features ms"
# Writes a small set of every kind: `cargo build --example samples -p cittert-formats`.
export CITTERT_SAMPLES=${CITTERT_SAMPLES:-$(dirname "$CITTERT")/examples/samples}
[ -x "$CITTERT_SAMPLES" ] || fail "there is no program $CITTERT_SAMPLES: run \`make interop\`, or build the example samples of cittert-formats"
[ -f "$SHARED/peers/setup.sh" ] || fail "there is no $SHARED/peers/setup.sh: set CITTERT_SHARED to the folder of shared data"

# A network that drops a download is tried again; what is still missing then is named.
MODULES="pyuvdata ducc0 casatools casatasks casacore ehtim astropy pytest"
missing() {
  if [ ! -f "$PEERS/env.sh" ]; then
    echo "everything"
    return
  fi
  . "$PEERS/env.sh"
  command -v wsclean >/dev/null || echo wsclean
  "$CITTERT_PY" -c 'import importlib.util, sys; print(*(m for m in sys.argv[1:] if importlib.util.find_spec(m) is None))' $MODULES
}
if [ ! -f "$PEERS/ready-1" ]; then
  for attempt in 1 2 3; do
    # casatasks needs six without saying so; pytest runs the tests.
    if bash "$SHARED/peers/setup.sh" && "$PEERS/venv/bin/python" -m pip --disable-pip-version-check -q install six pytest; then
      [ -z "$(missing | xargs)" ] && touch "$PEERS/ready-1" && break
    fi
    echo "interop: installing the other programs failed (attempt $attempt of 3)" >&2
    sleep 5
  done
fi
LACKING=$(missing | xargs)
[ -z "$LACKING" ] || fail "could not install: $LACKING. This is most often the network: run the command again; it goes on where it stopped"
. "$PEERS/env.sh"
export CITTERT_SHARED=$SHARED
cd "$HERE"
exec "$CITTERT_PY" -m pytest -q -p no:cacheprovider "$@" .
