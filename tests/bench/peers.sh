#!/usr/bin/env bash
# Time cittert and its peers on the common workloads, and print a table of ratios.
# The script installs the peers and makes the workloads where they are missing. A peer that cannot be installed is left out.
#   CITTERT_WL=<dir>               folder of the workloads (default ~/.cache/cittert-peers/wl; about 1.3 GB)
#   peers.sh --only dirty,clean    some of: grid, dirty, hogbom, clark, clean
set -euo pipefail
HERE=$(cd "$(dirname "$0")" && pwd)
ROOT=$(cd "$HERE/../.." && pwd)
export PEERS=${PEERS:-$HOME/.cache/cittert-peers}
export CITTERT=${CITTERT:-${CARGO_TARGET_DIR:-$ROOT/target}/release/cittert}
export CITTERT_CORE=${CITTERT_CORE:-$(dirname "$CITTERT")/examples/core}
for program in "$CITTERT" "$CITTERT_CORE"; do
  [ -x "$program" ] || { echo "bench: there is no program $program: run \`make bench-peers\`" >&2; exit 1; }
done
[ -f "$PEERS/env.sh" ] || bash "$ROOT/tests/peers/setup.sh" || echo "bench: some peers could not be installed; they are left out" >&2
. "$PEERS/env.sh"
for w in a b c; do
  if [ ! -f "$CITTERT_WL/$w.uvh5" ]; then
    mkdir -p "$CITTERT_WL"
    "$CITTERT_PY" "$ROOT/tests/peers/workloads/make_workloads.py" "$w"
  fi
done
exec "$CITTERT_PY" "$HERE/peers.py" "$@"
