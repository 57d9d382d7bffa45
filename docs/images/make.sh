#!/usr/bin/env bash
# Makes the pictures of the README and of the page on display: `make pictures`. The program is $CITTERT.
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

# The frame rate, and the panels of a film.
flight=(film docs/examples/airport-flight.toml --overwrite)
"$program" -q "${flight[@]}" --size 512 --tsys 600K --detectors 32 --rates 1,2,5,10,20,25,30,40,50,100 --target 366,162,10 -o "$work/rates.csv"
cp "$work/rates.png" "$root/docs/algorithms/img/frame-rate.png"
"$program" -q "${flight[@]}" --size 256 --sensor docs/examples/airport-camera.toml --rate 5 --exposures 9 --frames 1 \
  --show truth,filled,array --layout mm-golden --bandwidth 8GHz --channels 4 --array-image mem -o docs/algorithms/img/film-panels.png
"$program" -q scene render docs/examples/apron.toml --scene-size 256 --scene-cell 0.4mrad -o "$work/apron.fits"
"$program" -q simulate --layout mm-y --scene "$work/apron.fits" --freq 94GHz --bandwidth 8GHz --channels 4 --integration 1s --noise --seed 1 -o "$work/apron.uvh5"
"$program" -q mem "$work/apron.uvh5" --size 256 --cell 0.4mrad -o "$work/apron"
"$program" -q sensor "$work/apron.fits" --config docs/examples/sensor.toml --no-png -o "$work/sensor"
"$program" plot "$work/apron.fits" "$work/sensor-image.fits" "$work/apron-image.fits" --like "$work/apron.fits" \
  --title "Scene at 94 GHz" --title "Filled aperture, 1 s" --title "Interferometer, 1 s" -o "$here/sensor.png" --overwrite

# The runway in fog from 1 km, through three apertures of both kinds: the study of the landing.
cat >"$work/landing.toml" <<END
scene = "$root/phenomenology/scenes/runway-fog-1.toml"
frames_per_second = 10
key = [
  { time_s = 0, position_m = [-1000, 0, 68.13], look_at_m = [0, 9, 22.72] },
  { time_s = 5, position_m = [-650, 0, 49.79], look_at_m = [350, 9, 4.38] },
]
END
for aperture in 0.3:2.5 0.6:2.5 1:1.25; do
  size=${aperture%:*} pitch=${aperture#*:}
  sed "s/0.6m/${size}m/; s/2.5mrad/${pitch}mrad/" docs/examples/landing-camera.toml >"$work/camera.toml"
  "$program" -q layout optimize --elements 64 --aperture "${size}m" --spacing 21mm --restarts 2 --seed 1 --diameter 20mm --tsys 600K \
    -o "$work/array-$size.toml" >/dev/null
  # A film holds its command line, which should not name the folders of this machine.
  (cd "$work" && "$program" -q film landing.toml --mode full --size 256 --frames 1 --sensor camera.toml --black 266K --white 282K \
    --show truth,filled,array --layout "array-$size.toml" --bandwidth 8GHz --channels 8 --array-image mem -o "landing-${size}m.png" --overwrite)
  cp "$work/landing-${size}m.png" "$here"
done

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
