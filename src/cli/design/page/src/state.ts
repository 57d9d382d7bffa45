// What the page shows. The server gets it as sections of options, with the names of the command line.

import { signal, computed, batch } from '@preact/signals';

export interface Antenna {
  name: string;
  position_m: [number, number, number];
  [more: string]: unknown;
}

export interface Layout {
  name: string;
  frame: string;
  antenna: Antenna[];
  site?: { latitude_deg: number; longitude_deg: number; altitude_m: number };
  source?: string;
  [more: string]: unknown;
}

export interface Observation {
  freq: number; // GHz
  bandwidth: number; // GHz
  channels: number;
  declination: number; // deg, for a site
  from: number; // h
  to: number; // h
  integration: number; // s, for a site
  time: number; // s, without a site
  tsys: number; // K, 0 for no noise
  element: string; // layout, none, airy, gaussian or cos^N
  diameter: number; // m, of an airy element
  width: number; // deg, of a gaussian element
}

export interface Imaging {
  size: number;
  weighting: string;
  robust: number;
  fit: boolean; // pixels that cover the scene
}

export interface SceneChoice {
  file: string;
  size: number;
  min: number; // K
  max: number; // K
  width: number; // deg, of a picture
  pixels: number; // columns of a picture
}

/** A stroke of the brush over a scene that is painted by hand: places in 0 to 1 from the upper left, radius, and brightness in 0 to 1. */
export interface Stroke {
  at: number[];
  radius: number;
  bright: number;
}

export interface Errors {
  phase: number; // deg
  amplitude: number; // %
  position: number; // wavelengths / 100
  atmosphere: number; // deg between antennas that are `apart` apart
  apart: number; // m
  failed: number; // %
  selfcal: boolean;
  amplitudes: boolean;
  seed: number;
}

export const layout = signal<Layout>({ name: 'empty', frame: 'boresight', antenna: [] });
export const observation = signal<Observation>({
  freq: 94, bandwidth: 2, channels: 4, declination: 45, from: -2, to: 2, integration: 300, time: 10, tsys: 0, element: 'layout', diameter: 0.01, width: 20,
});
export const imaging = signal<Imaging>({ size: 256, weighting: 'uniform', robust: 0, fit: true });
export const scene = signal<SceneChoice>({ file: '', size: 256, min: 200, max: 300, width: 5, pixels: 256 });
export const strokes = signal<Stroke[]>([]);
/** Zones in which no antenna may stand: their corners, m. */
export const zones = signal<[number, number][][]>([]);
export const errors = signal<Errors>({ phase: 0, amplitude: 0, position: 0, atmosphere: 0, apart: 1, failed: 0, selfcal: false, amplitudes: false, seed: 1 });
export const method = signal<'none' | 'clean' | 'mem' | 'both'>('mem');
/** The pixel of the scene, rad, once it is known. */
export const sceneCell = signal<{ file: string; size: number; span: number } | null>(null);

export const isSite = computed(() => layout.value.frame !== 'boresight');
export const wavelength = computed(() => 0.299792458 / observation.value.freq);

type Section = Record<string, string | number | boolean>;

function number(v: number): string {
  return String(v);
}

/** The state as sections of options. Only what differs from the defaults of the program is in it. */
export function sections(): Record<string, unknown> {
  const o = observation.value;
  const e = errors.value;
  const i = imaging.value;
  const s = scene.value;
  const simulate: Section = { freq: `${number(o.freq)}GHz`, bandwidth: `${number(o.bandwidth)}GHz` };
  if (o.channels > 1) simulate.channels = o.channels;
  if (o.tsys > 0) simulate.tsys = `${o.tsys}K`;
  if (o.element !== 'layout') simulate.element = o.element;
  if (o.element === 'airy') simulate['element-diameter'] = `${o.diameter}m`;
  if (o.element === 'gaussian') simulate['element-width'] = `${o.width}deg`;
  if (isSite.value) {
    simulate['phase-center'] = `180deg,${o.declination}deg`;
    simulate['hour-angle'] = `${o.from}h,${o.to}h`;
    simulate.integration = `${o.integration}s`;
    simulate['elevation-limit'] = '5deg';
  } else if (o.time !== 10) {
    simulate.integration = `${o.time}s`;
  }
  const image: Section = { size: i.size };
  if (i.weighting !== 'uniform') image.weighting = i.weighting;
  if (i.weighting === 'briggs') image.robust = i.robust;
  const known = sceneCell.value;
  if (i.fit && s.file && known && known.file === sceneKey()) image.cell = `${fittingCell(known.span, i.size)}rad`;
  const out: Record<string, unknown> = { layout: layout.value, simulate, image, seed: e.seed };
  if (s.file) {
    const of: Section = { file: s.file };
    if (/\.toml$/i.test(s.file)) of['scene-size'] = s.size;
    if (/\.png$/i.test(s.file)) {
      of['scene-cell'] = `${(s.width * Math.PI) / 180 / s.pixels}rad`;
      of['scene-min'] = `${s.min}K`;
      of['scene-max'] = `${s.max}K`;
    }
    out.scene = of;
  }
  const corrupt: Section = {};
  if (e.phase > 0) corrupt['phase-rms'] = `${e.phase}deg`;
  if (e.amplitude > 0) corrupt['amp-rms'] = e.amplitude / 100;
  if (e.position > 0) corrupt['position-rms'] = `${(e.position / 100) * wavelength.value}m`;
  if (e.atmosphere > 0) {
    corrupt.troposphere = `${e.atmosphere}deg`;
    corrupt['troposphere-baseline'] = `${e.apart}m`;
  }
  if (e.failed > 0) {
    corrupt.dropout = e.failed / 100;
    corrupt['dropout-length'] = '1000h';
    corrupt['dropout-noticed'] = true;
  }
  if (Object.keys(corrupt).length) out.corrupt = corrupt;
  if (e.selfcal) out.selfcal = e.amplitudes ? { mode: 'amp-phase', solint: 'inf' } : { solint: 'inf' };
  if (method.value === 'clean' || method.value === 'both') out.clean = {};
  if (method.value === 'mem' || method.value === 'both') out.mem = {};
  return out;
}

/** Width of the layout along the wider of its axes, m. */
function widest(): number {
  const a = layout.value.antenna;
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const { position_m: [x, y] } of a) {
    x0 = Math.min(x0, x);
    x1 = Math.max(x1, x);
    y0 = Math.min(y0, y);
    y1 = Math.max(y1, y);
  }
  return a.length ? Math.max(x1 - x0, y1 - y0) : 0;
}

/** Pixels that cover the scene, rad, made finer in steps of the square root of two until two and a half of them fit into a fringe of the longest baseline. */
function fittingCell(span: number, size: number): number {
  const most = wavelength.value / Math.max(widest(), 1e-6) / 2.5;
  let cell = span / size;
  for (let k = 0; k < 60 && cell > most; k++) cell /= Math.SQRT2;
  return cell;
}

/** What the pixels of the scene depend on. */
export function sceneKey(): string {
  const s = scene.value;
  return `${s.file} ${s.size} ${s.width} ${s.pixels}`;
}

// Undo and redo of the layout.
const past: Layout[] = [];
const future: Layout[] = [];
export const canUndo = signal(false);
export const canRedo = signal(false);

function told() {
  canUndo.value = past.length > 0;
  canRedo.value = future.length > 0;
}

/** Remember the layout before a change. */
export function remember(before: Layout = layout.value) {
  past.push(before);
  if (past.length > 200) past.shift();
  future.length = 0;
  told();
}

export function setLayout(next: Layout) {
  batch(() => {
    remember();
    layout.value = next;
    selected.value = new Set();
  });
}

export function undo() {
  const last = past.pop();
  if (!last) return;
  future.push(layout.value);
  batch(() => {
    layout.value = last;
    selected.value = new Set();
  });
  told();
}

export function redo() {
  const next = future.pop();
  if (!next) return;
  past.push(layout.value);
  batch(() => {
    layout.value = next;
    selected.value = new Set();
  });
  told();
}

export const selected = signal<Set<number>>(new Set());

/** A name that no antenna has. */
export function freshName(taken: Antenna[]): string {
  const names = new Set(taken.map((a) => a.name));
  for (let k = taken.length + 1; ; k++) if (!names.has(`A${k}`)) return `A${k}`;
}

/** All of the page for the permalink. */
export function snapshot() {
  return {
    layout: layout.value, observation: observation.value, imaging: imaging.value, scene: scene.value, errors: errors.value, method: method.value,
    zones: zones.value, strokes: strokes.value,
  };
}

export function restore(s: Partial<ReturnType<typeof snapshot>>) {
  batch(() => {
    if (s.layout?.antenna) layout.value = s.layout;
    if (s.observation) observation.value = { ...observation.value, ...s.observation };
    if (s.imaging) imaging.value = { ...imaging.value, ...s.imaging };
    if (s.scene) scene.value = { ...scene.value, ...s.scene };
    if (s.errors) errors.value = { ...errors.value, ...s.errors };
    if (s.method) method.value = s.method;
    if (s.zones) zones.value = s.zones;
    if (s.strokes) strokes.value = s.strokes;
  });
}
