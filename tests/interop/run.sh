#!/usr/bin/env bash
# Install the peers (once; below $PEERS, default ~/.cache/cittert-peers) and let them judge what we write.
set -euo pipefail
HERE=$(cd "$(dirname "$0")" && pwd)
ROOT=$(cd "$HERE/../.." && pwd)
export PEERS=${PEERS:-$HOME/.cache/cittert-peers}
SHARED=${CITTERT_SHARED:-$ROOT/../shared}
if [ ! -f "$PEERS/ready-1" ]; then
  bash "$SHARED/peers/setup.sh"
  # casatasks needs six without saying so; pytest runs the tests.
  "$PEERS/venv/bin/python" -m pip --disable-pip-version-check -q install six pytest
  touch "$PEERS/ready-1"
fi
. "$PEERS/env.sh"
export CITTERT_SHARED=$SHARED CITTERT=${CITTERT:-$ROOT/target/release/cittert}
cd "$HERE"
exec "$CITTERT_PY" -m pytest -q -p no:cacheprovider "$@" .
