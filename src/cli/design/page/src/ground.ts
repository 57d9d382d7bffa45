// The ground of a site: coast lines and meridians as seen from above, or a small map of the world with the place of the site.

import land from 'world-atlas/land-110m.json';
import { css } from './maps';
import type { Layout } from './state';

const EARTH_M = 6371000;
/** Below this half width the coast lines, which are simplified to some tens of kilometres, would mislead. */
const COASTS_FROM_M = 60_000;

type Line = [number, number][];

/** The coast lines: pairs of longitude and latitude, degrees. Each arc holds whole numbers, the first absolute and the others differences. */
const coasts: Line[] = (land.arcs as number[][][]).map((arc) => {
  const { scale, translate } = land.transform;
  let [x, y] = [0, 0];
  return arc.map(([dx, dy]) => {
    x += dx;
    y += dy;
    return [x * scale[0] + translate[0], y * scale[1] + translate[1]];
  });
});

const graticule: Line[] = [];
for (let lon = -180; lon < 180; lon += 15) graticule.push(Array.from({ length: 81 }, (_, k) => [lon, -80 + 2 * k]));
for (let lat = -75; lat <= 75; lat += 15) graticule.push(Array.from({ length: 181 }, (_, k) => [-180 + 2 * k, lat]));

interface Size {
  w: number;
  h: number;
  scale: number; // pixels of a metre
}

export function drawGround(g: CanvasRenderingContext2D, layout: Layout, view: { x: number; y: number; half: number }, size: Size) {
  const site = layout.site;
  if (!site) return;
  if (view.half >= COASTS_FROM_M) fromAbove(g, site, view, size);
  else inset(g, site, size);
}

function fromAbove(g: CanvasRenderingContext2D, site: NonNullable<Layout['site']>, view: { x: number; y: number }, { w, h, scale }: Size) {
  const rad = Math.PI / 180;
  const [sin0, cos0] = [Math.sin(site.latitude_deg * rad), Math.cos(site.latitude_deg * rad)];
  const stroke = (lines: Line[]) => {
    g.beginPath();
    for (const line of lines) {
      let pen = false;
      for (const [lon, lat] of line) {
        const d = (lon - site.longitude_deg) * rad;
        const [s, c] = [Math.sin(lat * rad), Math.cos(lat * rad)];
        if (sin0 * s + cos0 * c * Math.cos(d) <= 0) {
          pen = false; // Behind the Earth.
          continue;
        }
        const x = w / 2 + (EARTH_M * c * Math.sin(d) - view.x) * scale;
        const y = h / 2 - (EARTH_M * (cos0 * s - sin0 * c * Math.cos(d)) - view.y) * scale;
        if (pen) g.lineTo(x, y);
        else g.moveTo(x, y);
        pen = true;
      }
    }
    g.stroke();
  };
  g.lineWidth = devicePixelRatio;
  g.strokeStyle = css('--line');
  stroke(graticule);
  g.beginPath();
  g.arc(w / 2 - view.x * scale, h / 2 + view.y * scale, EARTH_M * scale, 0, 2 * Math.PI);
  g.stroke();
  g.strokeStyle = css('--coast');
  stroke(coasts);
}

function inset(g: CanvasRenderingContext2D, site: NonNullable<Layout['site']>, { w, h }: Size) {
  const width = Math.min(150 * devicePixelRatio, w / 3);
  const height = width / 2;
  const [x0, y0] = [w - width - 6 * devicePixelRatio, h - height - 6 * devicePixelRatio];
  const px = (lon: number) => x0 + ((lon + 180) / 360) * width;
  const py = (lat: number) => y0 + ((90 - lat) / 180) * height;
  g.strokeStyle = css('--line');
  g.lineWidth = devicePixelRatio;
  g.strokeRect(x0, y0, width, height);
  g.strokeStyle = css('--coast');
  g.lineWidth = 0.75 * devicePixelRatio;
  g.beginPath();
  for (const line of coasts) {
    line.forEach(([lon, lat], k) => {
      if (k && Math.abs(lon - line[k - 1][0]) < 180) g.lineTo(px(lon), py(lat));
      else g.moveTo(px(lon), py(lat));
    });
  }
  g.stroke();
  g.fillStyle = css('--second');
  g.beginPath();
  const lon = ((((site.longitude_deg + 180) % 360) + 360) % 360) - 180;
  g.arc(px(lon), py(site.latitude_deg), 3.5 * devicePixelRatio, 0, 2 * Math.PI);
  g.fill();
}
