// The socket to the program, and what it has answered.

import { batch, effect, signal } from '@preact/signals';
import { layout, method, scene, sceneCell, sceneKey, sections, setLayout, observation, selected, type Layout } from './state';
import { openLink } from './link';

export interface Picture {
  name: string;
  columns: number;
  rows: number;
  cell_rad: number;
  unit: string;
  sky: boolean;
  data: Float32Array;
  [more: string]: unknown;
}

export interface Coverage {
  rows: number;
  freq_hz: number[];
  data: Float32Array;
}

export interface Hello {
  version: string;
  scenes: string[];
  kinds: { name: string; about: string; options: string[] }[];
  builtin: { name: string; about: string; freq_hz: number }[];
  formats: { name: string; extension: string }[];
  objectives: { name: string; about: string }[];
}

export interface Gains {
  names: string[];
  accepted?: boolean;
  deconvolver?: string;
  left?: { rms_phase_rad: number; rms_amplitude: number } | null;
  true: { phase_rad: number[]; amplitude: number[] } | null;
  solved?: { phase_rad: number[]; amplitude: number[] };
}

export interface Closures {
  names: string[];
  true_rad: number[];
  observed_rad: number[];
}

export interface Commands {
  steps: { what: string; line: string; output: string }[];
  run: string;
  script: string;
  layout: string;
  needs: { name: string; text: string | null }[];
}

export const connected = signal<'connecting' | 'open' | 'lost'>('connecting');
export const hello = signal<Hello | null>(null);
export const scenes = signal<string[]>([]);
export const problem = signal<string | null>(null);
export const busy = signal(false);
export const moving = signal(false);
export const coverage = signal<Coverage | null>(null);
export const pictures = signal<Record<string, Picture>>({});
export const figures = signal<Record<string, unknown> | null>(null);
export const gains = signal<Gains | null>(null);
export const closures = signal<Closures | null>(null);
export const commands = signal<Commands | null>(null);
export const search = signal<{ running: boolean; done: number; of: number; best: number; scores: number[]; start: Layout } | null>(null);
/** Counts layouts that came from elsewhere than the editor, so that it shows them whole. */
export const arrivals = signal(0);
/** Whether a report is being made. */
export const reporting = signal(false);
export const colors: Record<string, Uint8ClampedArray> = {};

/** The time of each state until its pictures were drawn, for measurements. */
export const timing = { sent: new Map<number, number>(), psf: [] as number[], dirty: [] as number[], mem: [] as number[] };
(window as unknown as Record<string, unknown>).cittert = { timing, pictures, figures, layout, busy, search };

let socket: WebSocket | null = null;
let seq = 0;
let live = 0; // The newest state whose quick pictures are there.
let waiting = false;
let wasSent = '';
let changed = 0; // When the hand changed what is not sent yet.

function table(hex: string): Uint8ClampedArray {
  return Uint8ClampedArray.from({ length: hex.length / 2 }, (_, k) => parseInt(hex.slice(2 * k, 2 * k + 2), 16));
}

export function tell(message: unknown) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

/** Send the state, unless the pictures of the one before are still on their way. */
function show() {
  if (!hello.value || socket?.readyState !== WebSocket.OPEN) return;
  if (live < seq) {
    waiting = true;
    return;
  }
  waiting = false;
  const state = sections();
  const text = JSON.stringify(state) + moving.value;
  if (text === wasSent) {
    changed = 0;
    return;
  }
  wasSent = text;
  seq += 1;
  busy.value = true;
  timing.sent.set(seq, changed || performance.now());
  changed = 0;
  if (timing.sent.size > 50) timing.sent.delete(timing.sent.keys().next().value!);
  tell({ do: 'show', seq, moving: moving.value, state });
}

function arrived(of: number) {
  live = Math.max(live, of);
  if (waiting) show();
}

/** Call `done` once what is drawn now is on the screen. */
function onScreen(of: number, into: number[]) {
  const sent = timing.sent.get(of);
  if (sent === undefined) return;
  requestAnimationFrame(() => {
    const channel = new MessageChannel();
    channel.port1.onmessage = () => {
      into.push(performance.now() - sent);
      if (into.length > 2000) into.shift();
    };
    channel.port2.postMessage(0);
  });
}

function binary(buffer: ArrayBuffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const data = new Float32Array(buffer, 4 + length);
  if (header.is === 'coverage') {
    coverage.value = { ...header, data };
    return;
  }
  const picture: Picture = { ...header, data };
  if (picture.name === 'truth') {
    const span = picture.cell_rad * picture.columns;
    const key = sceneKey();
    if (sceneCell.value?.file !== key || sceneCell.value.span !== span) sceneCell.value = { file: key, size: picture.columns, span };
  }
  const next = { ...pictures.value, [picture.name]: picture };
  // What the new state does not make is gone.
  if (picture.name === 'dirty' && !header.calibrated) {
    const m = method.value;
    if (m !== 'clean' && m !== 'both') delete next.clean;
    if (m !== 'mem' && m !== 'both') delete next.mem;
  }
  pictures.value = next;
  if (picture.name === 'psf') onScreen(header.seq, timing.psf);
  if (picture.name === 'mem') onScreen(header.seq, timing.mem);
  if (picture.name === 'dirty' && !header.calibrated) {
    onScreen(header.seq, timing.dirty);
    problem.value = null;
    arrived(header.seq);
  }
}

function message(m: Record<string, any>) {
  switch (m.is) {
    case 'hello':
      for (const [name, hex] of Object.entries(m.colors as Record<string, string>)) colors[name] = table(hex);
      scenes.value = m.scenes;
      if (!hello.value) {
        batch(() => {
          layout.value = m.layout;
          observation.value = { ...observation.value, freq: m.freq_hz / 1e9, bandwidth: Number((m.freq_hz / 5e10).toPrecision(2)) };
          scene.value = { ...scene.value, file: m.layout.frame === 'boresight' ? m.scene : 'points.csv' };
        });
        void openLink().then(() => {
          arrivals.value++;
          hello.value = m as Hello;
        });
      } else {
        seq = live = 0;
        wasSent = '';
        hello.value = { ...(m as Hello) };
      }
      break;
    case 'error':
      problem.value = m.text;
      // Some errors answer a message that is no state, such as a search with an option that is wrong.
      if (m.seq === undefined) {
        reporting.value = false;
        if (search.value?.running && !search.value.done) {
          rest(); // It did not begin.
        }
        break;
      }
      busy.value = false;
      arrived(m.seq);
      break;
    case 'done':
      arrived(m.seq);
      if (m.seq === seq && !waiting && !m.cancelled) busy.value = false;
      break;
    case 'layout':
      setLayout(m.layout);
      arrivals.value++;
      break;
    case 'scenes':
      scenes.value = m.scenes;
      wasSent = ''; // The file may have the name of an earlier one.
      scene.value = { ...scene.value, file: m.added };
      break;
    case 'figures':
      figures.value = m.figures;
      // The scene came before the figures, unless it is no image.
      if (pictures.value.truth && pictures.value.truth.seq !== m.seq) {
        const { truth: _, ...rest } = pictures.value;
        pictures.value = rest;
      }
      break;
    case 'gains':
      gains.value = m as Gains;
      break;
    case 'closures':
      closures.value = m as Closures;
      break;
    case 'commands':
      commands.value = m as never;
      break;
    case 'saved':
      download(m.name, m.text);
      if (m.lost.length) problem.value = `This format cannot hold ${m.lost.join(', ')}.`;
      break;
    case 'attempt': {
      const s = search.value;
      if (!s?.running || m.search !== number) break; // Of a search that was stopped.
      search.value = { ...s, done: m.done, of: m.of, best: m.best, scores: [...s.scores, m.best] };
      if (m.layout) {
        layout.value = { ...m.layout, name: s.start.name };
        selected.value = new Set();
      }
      break;
    }
    case 'report-ended':
      reporting.value = false;
      break;
    case 'search':
      number = m.search;
      break;
    case 'search-ended':
      if (m.search === number) rest();
      if (m.error) problem.value = m.error;
      break;
  }
}

/** The number of the newest search, as the program counts them. */
let number = 0;

function rest() {
  batch(() => {
    if (search.value) search.value = { ...search.value, running: false };
    moving.value = false;
  });
}

/** Begin a search. */
export function beginSearch(start: Layout, of: number, message: unknown) {
  batch(() => {
    search.value = { running: true, done: 0, of, best: NaN, scores: [], start };
    moving.value = true; // While the layout changes, only what is quick is computed.
  });
  tell(message);
}

export function stopSearch() {
  tell({ do: 'stop' });
  rest();
}

export function connect() {
  const address = new URL('socket', location.href.replace(/#.*/, ''));
  address.protocol = 'ws:';
  socket = new WebSocket(address);
  socket.binaryType = 'arraybuffer';
  socket.onopen = () => (connected.value = 'open');
  socket.onmessage = (e) => (typeof e.data === 'string' ? message(JSON.parse(e.data)) : binary(e.data));
  (window as unknown as { cittert: Record<string, unknown> }).cittert.disconnect = () => socket?.close(); // For tests.
  socket.onclose = () => {
    connected.value = 'lost';
    reporting.value = false;
    rest();
    setTimeout(connect, 1000);
  };
}

/** Send a dropped file. */
export function drop(file: { name: string; bytes: ArrayBuffer }, kind: 'scene' | 'layout') {
  if (file.bytes.byteLength > 100e6) {
    problem.value = `${file.name}: the file has ${(file.bytes.byteLength / 1e6).toFixed(0)} MB, and the page takes at most 100 MB: make it smaller first.`;
    return;
  }
  const header = new TextEncoder().encode(JSON.stringify({ kind, name: file.name }));
  const out = new Uint8Array(4 + header.length + file.bytes.byteLength);
  new DataView(out.buffer).setUint32(0, header.length, true);
  out.set(header, 4);
  out.set(new Uint8Array(file.bytes), 4 + header.length);
  socket?.send(out);
}

export function download(name: string, content: string | Uint8Array) {
  const a = document.createElement('a');
  a.href = URL.createObjectURL(new Blob([content as BlobPart], { type: typeof content === 'string' ? 'text/plain' : 'application/octet-stream' }));
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 1000);
}

// Any change of the state is sent with the next frame of the screen.
let asked = false;
effect(() => {
  sections();
  moving.value;
  hello.value;
  if (asked) return;
  asked = true;
  changed ||= performance.now();
  queueMicrotask(() => {
    asked = false;
    show();
  });
});
