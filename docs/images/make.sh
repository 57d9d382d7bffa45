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

# One sheet with a layout of each kind, five in a row.
sheet="$here/layouts.svg"
columns=5 width=200 height=215
kinds=("y 27" "t 28" "u 28" "cross 33" "mills-cross 41" "ring 36" "multi-ring 48" "reuleaux 36" "log-spiral 27" "fermat 64" "random 64" "poisson-disc 64"
  "golomb 28" "minimum-redundancy 28" "coprime 28" "hexagonal 37" "rectangular 49" "thinned-rectangular 48" "thinned-hexagonal 48" "difference-ring 14"
  "difference-line 14" "difference-grid 17" "sierpinski 81" "koch 48" "fractal 81")
rows=$(((${#kinds[@]} + columns - 1) / columns))
{
  echo "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 $((columns * width)) $((rows * height))\">"
  echo "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>"
  for i in "${!kinds[@]}"; do
    read -r kind elements <<<"${kinds[$i]}"
    "$program" -q layout make "$kind" --elements "$elements" --aperture 200m -o "$work/$kind.toml" >/dev/null
    left=$((i % columns * width)) top=$((i / columns * height))
    echo "<text x=\"$((left + width / 2))\" y=\"$((top + 16))\" font-family=\"sans-serif\" font-size=\"13\" text-anchor=\"middle\">$kind, $elements</text>"
    # Positions in metres around the mean become dots; y grows up.
    awk -v x0="$((left + width / 2))" -v y0="$((top + 16 + width / 2))" -F'[][,= ]+' \
      '/^position_m/ { printf "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"1.8\"/>\n", x0 + 0.75 * $2, y0 - 0.75 * $3 }' "$work/$kind.toml"
  done
  echo "</svg>"
} >"$sheet"
