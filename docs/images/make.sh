#!/usr/bin/env bash
# Makes the pictures of the README: `make pictures`. The program is $CITTERT.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
program=$(realpath "${CITTERT:-$root/target/release/cittert}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$root"

"$program" -q run docs/examples/airport.toml -o "$work/demo"
"$program" plot "$work/demo/scene.fits" "$work/demo/dirty.fits" "$work/demo/mem-model.fits" \
  --title "Scene at 94 GHz" --title "Dirty image of 96 elements" --title "Maximum entropy" -o "$here/demo.png" --overwrite

"$program" -q run docs/examples/blind-selfcal.toml -o "$work/blind"
"$program" plot "$work/blind/mem-image.fits" "$work/blind/corrupted-image.fits" "$work/blind/selfcal-image.fits" \
  --like "$work/blind/scene.fits" --title "Without errors" --title "Random antenna phases" --title "After self-calibration" \
  -o "$here/blind-selfcal.png" --overwrite
