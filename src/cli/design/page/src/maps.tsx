// Maps: images in the colours of the project, the u-v plane, and the cut through the beam.

import { useEffect, useRef, useState } from 'preact/hooks';
import { useComputed, useSignalEffect } from '@preact/signals';
import uPlot from 'uplot';
import { colors, coverage, pictures, type Picture } from './server';
import { wavelength } from './state';

export function angle(rad: number, digits = 3): string {
  const deg = (rad * 180) / Math.PI;
  const [v, unit] = Math.abs(deg) >= 0.1 ? [deg, '°'] : Math.abs(deg) * 60 >= 0.1 ? [deg * 60, '′'] : [deg * 3600, '″'];
  return `${Number(v.toPrecision(digits))}${unit}`;
}

function short(v: number): string {
  return Math.abs(v) >= 1e4 || (v !== 0 && Math.abs(v) < 1e-2) ? v.toExponential(1) : String(Number(v.toPrecision(3)));
}

/** Lowest and highest value of the middle 99.8 %, so that one bright pixel does not darken the rest. */
export function range(data: Float32Array): [number, number] {
  const step = Math.max(1, Math.floor(data.length / 20000));
  const picked = new Float32Array(Math.ceil(data.length / step));
  let count = 0;
  for (let k = 0; k < data.length; k += step) if (Number.isFinite(data[k])) picked[count++] = data[k];
  const some = picked.subarray(0, count).sort();
  const at = (q: number) => some[Math.min(some.length - 1, Math.max(0, Math.round(q * (some.length - 1))))] ?? 0;
  return [at(0.001), at(0.999)];
}

const scratch = document.createElement('canvas');

/** Draw an image into a canvas, the rows from the bottom up. `value` turns a number into a place from 0 to 1. Only the left `part` is drawn. */
export function paint(canvas: HTMLCanvasElement, p: Picture, map: string, value: (v: number) => number, part = 1) {
  const lut = colors[map];
  if (!lut) return;
  scratch.width = p.columns;
  scratch.height = p.rows;
  const context = scratch.getContext('2d')!;
  const out = context.createImageData(p.columns, p.rows);
  const pixels = new Uint32Array(out.data.buffer);
  const packed = new Uint32Array(256);
  for (let k = 0; k < 256; k++) packed[k] = 0xff000000 | (lut[3 * k + 2] << 16) | (lut[3 * k + 1] << 8) | lut[3 * k];
  let k = 0;
  for (let row = p.rows - 1; row >= 0; row--) {
    for (let column = 0; column < p.columns; column++, k++) {
      const x = value(p.data[row * p.columns + (p.sky ? p.columns - 1 - column : column)]);
      pixels[k] = packed[x <= 0 ? 0 : x >= 1 ? 255 : (x * 255) | 0];
    }
  }
  context.putImageData(out, 0, 0);
  const target = canvas.getContext('2d')!;
  const side = Math.max(1, Math.round(canvas.clientWidth * devicePixelRatio));
  if (canvas.width !== side) canvas.width = canvas.height = side;
  target.imageSmoothingEnabled = p.columns > side;
  const width = Math.round(part * p.columns);
  if (width > 0) target.drawImage(scratch, 0, 0, width, p.rows, 0, 0, (side * width) / p.columns, side);
}

export const FLOOR_DB = -40;

export function decibel(v: number): number {
  return 10 * Math.log10(Math.max(Math.abs(v), 1e-9));
}

function Bar({ map, low, high, unit }: { map: string; low: string; high: string; unit: string }) {
  const ref = useRef<HTMLCanvasElement>(null);
  useEffect(() => {
    const c = ref.current!.getContext('2d')!;
    const lut = colors[map];
    for (let k = 0; lut && k < 256; k++) {
      c.fillStyle = `rgb(${lut[3 * k]},${lut[3 * k + 1]},${lut[3 * k + 2]})`;
      c.fillRect(k, 0, 1, 1);
    }
  }, [map, colors[map]]);
  return (
    <div class="bar">
      <span>{low}</span>
      <canvas ref={ref} width={256} height={1} aria-hidden="true" />
      <span>
        {high} {unit}
      </span>
    </div>
  );
}

interface MapProps {
  name: string;
  title: string;
  about?: string;
  like?: string; // The picture whose range of colours this one shares.
  note?: string;
  /** What is wrong with the picture. It stands in it. */
  warning?: string;
  picture?: Picture;
  two?: boolean;
}

export function ImageMap({ name, title, about, like, note, warning, picture, two }: MapProps) {
  const ref = useRef<HTMLCanvasElement>(null);
  const [hover, setHover] = useState('');
  const [scale, setScale] = useState<{ low: number; high: number; unit: string }>({ low: 0, high: 1, unit: '' });
  const beam = name === 'psf';
  // A map is drawn anew only where its own picture is new, or the one whose colours it shares.
  const mine = useComputed(() => pictures.value[name]);
  const other = useComputed(() => (like ? pictures.value[like] : undefined));
  const map = two ? 'red-blue' : 'inferno';
  const draw = () => {
    const p = picture ?? mine.value;
    if (!p || !ref.current) return;
    let [low, high] = beam ? [FLOOR_DB, 0] : range((other.value?.unit === p.unit ? other.value : p).data);
    if (two) {
      high = Math.max(Math.abs(low), Math.abs(high));
      low = -high;
    }
    const width = high - low || 1;
    paint(ref.current, p, map, beam ? (v) => (decibel(v) - low) / width : (v) => (v - low) / width);
    if (scale.low !== low || scale.high !== high || scale.unit !== p.unit) setScale({ low, high, unit: beam ? 'dB' : p.unit === '1' ? '' : p.unit });
  };
  useSignalEffect(draw);
  useEffect(() => {
    draw();
    const seen = new ResizeObserver(draw);
    seen.observe(ref.current!);
    return () => seen.disconnect();
  }, [picture, like]);
  const over = (e: PointerEvent) => {
    const p = picture ?? mine.value;
    if (!p) return;
    const box = ref.current!.getBoundingClientRect();
    const x = (e.clientX - box.left) / box.width;
    const y = (e.clientY - box.top) / box.height;
    const column = Math.min(p.columns - 1, Math.floor((p.sky ? 1 - x : x) * p.columns));
    const row = Math.min(p.rows - 1, Math.floor((1 - y) * p.rows));
    const v = p.data[row * p.columns + column];
    const at = (k: number, n: number) => angle((k - Math.floor(n / 2)) * p.cell_rad);
    setHover(`${at(column, p.columns)}, ${at(row, p.rows)}: ${beam ? `${decibel(v).toFixed(1)} dB` : `${short(v)} ${p.unit}`}`);
  };
  const p = picture ?? mine.value;
  return (
    <figure class="map" data-map={name}>
      <figcaption>
        <b>{title}</b>
        <span title={note}>{hover || note || (p ? `${angle(p.cell_rad * p.columns)} wide` : '')}</span>
      </figcaption>
      <div class="square">
        <canvas ref={ref} role="img" aria-label={about ?? title} onPointerMove={over} onPointerLeave={() => setHover('')} />
        {!p && <p class="none">…</p>}
        {warning && <p class="warning" role="status" title={(p?.missed as string) ?? warning}>{warning}</p>}
      </div>
      <Bar map={map} low={short(scale.low)} high={short(scale.high)} unit={scale.unit} />
    </figure>
  );
}

// Canvases need colours as numbers, and those of the sheet depend on light and dark: an element that nobody sees resolves them.
const probe = document.createElement('i');
const resolved = new Map<string, string>();
const forget = () => resolved.clear();
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', forget);
addEventListener('cittert-theme', forget);

export function css(name: string): string {
  const known = resolved.get(name);
  if (known) return known;
  if (!probe.isConnected) {
    probe.hidden = true;
    document.body.append(probe);
  }
  probe.style.color = `var(${name})`;
  const color = getComputedStyle(probe).color;
  resolved.set(name, color);
  return color;
}

/** Draw a dot at each point and opposite to it, from its place at the lowest frequency to that at the highest. A canvas takes tens of milliseconds for
 * thousands of short lines; this adds their squares up in an array. */
function stamps(g: CanvasRenderingContext2D, side: number, uv: Float32Array, [low, high]: [number, number]) {
  const n = uv.length / 2;
  const dot = Math.max(devicePixelRatio, Math.min(3 * devicePixelRatio, side / Math.sqrt(n) / 6));
  const most = n > 20000 ? 0.35 : 0.75;
  const cover = new Float32Array(side * side);
  const half = side / 2;
  const stamp = (x: number, y: number) => {
    const [left, top] = [half + x - dot / 2, half + y - dot / 2];
    for (let row = Math.max(0, Math.floor(top)); row < Math.min(side, top + dot); row++) {
      const high = Math.min(row + 1, top + dot) - Math.max(row, top);
      for (let column = Math.max(0, Math.floor(left)); column < Math.min(side, left + dot); column++) {
        const part = high * (Math.min(column + 1, left + dot) - Math.max(column, left));
        const at = row * side + column;
        cover[at] += most * part * (1 - cover[at]);
      }
    }
  };
  for (let k = 0; k < n; k++) {
    const x = uv[2 * k];
    const y = -uv[2 * k + 1];
    const steps = Math.max(1, Math.ceil((Math.sqrt(x * x + y * y) * (high - low)) / dot));
    for (let i = 0; i < steps; i++) {
      const f = low + ((i + 0.5) / steps) * (high - low);
      stamp(x * f, y * f);
      stamp(-x * f, -y * f);
    }
  }
  const [r, green, b] = (css('--accent').match(/[\d.]+/g) ?? ['0', '0', '0']).map(Number);
  const color = (b << 16) | (green << 8) | r;
  const image = new ImageData(side, side);
  const pixels = new Uint32Array(image.data.buffer);
  for (let k = 0; k < cover.length; k++) pixels[k] = (Math.round(255 * cover[k]) << 24) | color;
  scratch.width = scratch.height = side;
  scratch.getContext('2d')!.putImageData(image, 0, 0);
  g.drawImage(scratch, 0, 0);
}

/** The u-v plane: both halves of each baseline, and a streak for the band. */
export function UvMap() {
  const ref = useRef<HTMLCanvasElement>(null);
  const [told, setTold] = useState('');
  const draw = () => {
    const c = coverage.value;
    const canvas = ref.current;
    if (!c || !canvas) return;
    const side = Math.max(1, Math.round(canvas.clientWidth * devicePixelRatio));
    if (canvas.width !== side) canvas.width = canvas.height = side;
    const g = canvas.getContext('2d')!;
    g.fillStyle = css('--map');
    g.fillRect(0, 0, side, side);
    const low = c.freq_hz[0] / 299792458;
    const high = c.freq_hz[c.freq_hz.length - 1] / 299792458;
    let most = 0;
    for (let k = 0; k < c.data.length; k++) most = Math.max(most, Math.abs(c.data[k]));
    most *= high * 1.06;
    if (!(most > 0)) return;
    const half = side / 2;
    const scale = half / most;
    g.strokeStyle = css('--line');
    g.lineWidth = devicePixelRatio;
    g.beginPath();
    g.moveTo(half, 0);
    g.lineTo(half, side);
    g.moveTo(0, half);
    g.lineTo(side, half);
    g.stroke();
    stamps(g, side, c.data, [scale * low, scale * high]);
    setTold(`${c.rows.toLocaleString('en')} baselines, ±${short(most / 1.06)} λ`);
  };
  useSignalEffect(draw);
  useEffect(() => {
    const seen = new ResizeObserver(draw);
    seen.observe(ref.current!);
    const theme = matchMedia('(prefers-color-scheme: dark)');
    theme.addEventListener('change', draw);
    addEventListener('cittert-theme', draw);
    return () => {
      seen.disconnect();
      theme.removeEventListener('change', draw);
      removeEventListener('cittert-theme', draw);
    };
  }, []);
  return (
    <figure class="map" data-map="uv">
      <figcaption>
        <b>u-v coverage</b>
        <span>{told}</span>
      </figcaption>
      <div class="square">
        <canvas ref={ref} role="img" aria-label={`u-v coverage: ${told}`} />
      </div>
    </figure>
  );
}

/** Largest and mean square of the beam on rings around its centre, dB. */
function rings(p: Picture): { radius: number[]; peak: number[]; rms: number[] } {
  const centre = Math.floor(p.columns / 2);
  const middle = Math.floor(p.rows / 2);
  const count = Math.floor(p.columns / 2);
  const top = new Float64Array(count);
  const sum = new Float64Array(count);
  const of = new Float64Array(count);
  for (let row = 0; row < p.rows; row++) {
    for (let column = 0; column < p.columns; column++) {
      const [y, x] = [row - middle, column - centre];
      const r = Math.round(Math.sqrt(x * x + y * y));
      if (r >= count) continue;
      const v = Math.abs(p.data[row * p.columns + column]);
      if (v > top[r]) top[r] = v;
      sum[r] += v * v;
      of[r] += 1;
    }
  }
  const radius = Array.from({ length: count }, (_, r) => (r * p.cell_rad * 180) / Math.PI);
  return { radius, peak: Array.from(top, (v) => Math.max(FLOOR_DB - 10, decibel(v))), rms: Array.from(sum, (v, r) => Math.max(FLOOR_DB - 10, 5 * Math.log10(v / (of[r] || 1) + 1e-12))) };
}

export function Cut() {
  const ref = useRef<HTMLDivElement>(null);
  const beam = useComputed(() => pictures.value.psf);
  const plot = useRef<uPlot | null>(null);
  useSignalEffect(() => {
    const p = beam.value;
    if (!p || !ref.current) return;
    const r = rings(p);
    const data: uPlot.AlignedData = [r.radius, r.peak, r.rms];
    if (plot.current) {
      plot.current.setData(data);
      return;
    }
    const ink = () => css('--soft');
    const axis = { stroke: ink, grid: { stroke: () => css('--line'), width: 1 }, ticks: { show: false }, font: '11px system-ui', size: 34 };
    plot.current = new uPlot(
      {
        width: ref.current.clientWidth,
        height: ref.current.clientHeight,
        cursor: { drag: { x: false, y: false } },
        legend: { show: false },
        scales: { x: { time: false }, y: { range: [FLOOR_DB, 0] } },
        axes: [{ ...axis, size: 26, values: (_, v) => v.map((x) => `${Number(x.toPrecision(3))}°`) }, axis],
        series: [{}, { stroke: () => css('--accent'), width: 1.5 }, { stroke: () => css('--second'), width: 1.5, dash: [4, 3] }],
      },
      data,
      ref.current,
    );
    const seen = new ResizeObserver(() => ref.current && plot.current?.setSize({ width: ref.current.clientWidth, height: ref.current.clientHeight }));
    seen.observe(ref.current);
    const again = () => plot.current?.redraw();
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', again);
    addEventListener('cittert-theme', again);
  });
  return (
    <figure class="map" data-map="cut">
      <figcaption>
        <b>Cut through the beam</b>
        <span>
          <i class="key" /> largest <i class="key second" /> rms, dB
        </span>
      </figcaption>
      <div class="cut" ref={ref} role="img" aria-label="Largest and rms side lobe against the distance from the centre of the beam" />
    </figure>
  );
}

export function inWavelengths(m: number): string {
  return `${short(m / wavelength.value)} λ`;
}
export { short };
