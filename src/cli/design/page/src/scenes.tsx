// The scene: a shipped one, a dropped file, or a picture that is painted by hand.

import { useEffect, useRef, useState } from 'preact/hooks';
import { Choice, Group, NumberField } from './fields';
import { choose } from './layouts';
import { drop, hello, moving, scenes } from './server';
import { reach } from './editor';
import { scene, strokes, wavelength, type Stroke } from './state';
import { greyPng, pngColumns } from './png';

/** The width of 64 fringes of the longest baseline, degrees. */
function fieldDeg(): number {
  return Math.min(60, (64 * wavelength.value * 180) / Math.PI / (2 * reach.value.r));
}

const PAINTED = 'painted.png';
const SIDE = 256;

/** Send a file that was chosen or dropped as the scene. */
export async function takeScene(file: File) {
  const bytes = await file.arrayBuffer();
  if (/\.png$/i.test(file.name)) scene.value = { ...scene.value, pixels: pngColumns(bytes) ?? SIDE };
  drop({ name: file.name, bytes }, 'scene');
}

/** Brightness of the painted picture, 0 to 255: each stroke covers what is under it. */
export function painted(all: Stroke[]): Uint8Array {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = SIDE;
  const g = canvas.getContext('2d')!;
  g.fillStyle = '#000';
  g.fillRect(0, 0, SIDE, SIDE);
  for (const s of all) trace(g, s, SIDE);
  const rgba = g.getImageData(0, 0, SIDE, SIDE).data;
  return Uint8Array.from({ length: SIDE * SIDE }, (_, k) => rgba[4 * k]);
}

function trace(g: CanvasRenderingContext2D, s: Stroke, side: number) {
  const grey = Math.round(255 * s.bright);
  g.strokeStyle = g.fillStyle = `rgb(${grey},${grey},${grey})`;
  g.lineWidth = 2 * s.radius * side;
  g.lineCap = g.lineJoin = 'round';
  g.beginPath();
  if (s.at.length === 2) g.arc(s.at[0] * side, s.at[1] * side, s.radius * side, 0, 2 * Math.PI);
  for (let k = 0; k < s.at.length; k += 2) {
    if (k) g.lineTo(s.at[k] * side, s.at[k + 1] * side);
    else if (s.at.length > 2) g.moveTo(s.at[0] * side, s.at[1] * side);
  }
  if (s.at.length === 2) g.fill();
  else g.stroke();
}

/** The file of the painting. */
export function painting(): Promise<Uint8Array> {
  return greyPng(SIDE, SIDE, painted(strokes.value));
}

async function sendPainting() {
  const bytes = await painting();
  scene.value = { ...scene.value, pixels: SIDE };
  drop({ name: PAINTED, bytes: bytes.buffer as ArrayBuffer }, 'scene');
}

function Painter() {
  const ref = useRef<HTMLCanvasElement>(null);
  const drawing = useRef<Stroke | null>(null);
  const sent = useRef(0);
  const [radius, setRadius] = useState(6);
  const [bright, setBright] = useState(100);
  const all = strokes.value;
  const draw = () => {
    const g = ref.current!.getContext('2d')!;
    g.fillStyle = '#000';
    g.fillRect(0, 0, SIDE, SIDE);
    for (const s of [...strokes.value, ...(drawing.current ? [drawing.current] : [])]) trace(g, s, SIDE);
  };
  useEffect(draw, [all]);
  const at = (e: PointerEvent): [number, number] => {
    const box = ref.current!.getBoundingClientRect();
    const place = (v: number) => Math.round(v * 1000) / 1000;
    return [place((e.clientX - box.left) / box.width), place((e.clientY - box.top) / box.height)];
  };
  const change = (next: Stroke[]) => {
    strokes.value = next;
    clearTimeout(sent.current);
    sent.current = window.setTimeout(() => void sendPainting(), 30);
  };
  return (
    <Group title="Paint">
      <canvas
        ref={ref}
        class="painter"
        width={SIDE}
        height={SIDE}
        role="img"
        aria-label="Scene that is painted by hand: drag to paint"
        onPointerDown={(e) => {
          ref.current!.setPointerCapture(e.pointerId);
          drawing.current = { at: at(e), radius: radius / 200, bright: bright / 100 };
          draw();
        }}
        onPointerMove={(e) => {
          const d = drawing.current;
          if (!d) return;
          const p = at(e);
          const n = d.at.length;
          if (Math.hypot(p[0] - d.at[n - 2], p[1] - d.at[n - 1]) > 0.004) d.at.push(...p);
          draw();
        }}
        onPointerUp={() => {
          const d = drawing.current;
          drawing.current = null;
          if (d) change([...strokes.value, d]);
        }}
      />
      <NumberField label="Brush" unit="%" value={radius} min={1} max={40} set={setRadius} hint="Width, in parts of the picture" />
      <NumberField label="Brightness" unit="%" value={bright} min={0} max={100} set={(v) => setBright(Math.max(0, Math.min(100, v)))} hint="0 is the lowest temperature, 100 the highest" />
      <div class="buttons">
        <button type="button" disabled={!all.length} onClick={() => change(all.slice(0, -1))}>
          Undo stroke
        </button>
        <button type="button" disabled={!all.length} onClick={() => change([])}>
          Clear
        </button>
      </div>
    </Group>
  );
}

/** A link that shows a painting sends it anew, since the program keeps no files. */
export function restorePainting() {
  if (scene.value.file === PAINTED && strokes.value.length) void sendPainting();
}

export function ScenePanel() {
  const s = scene.value;
  const set = (change: Partial<typeof s>) => (scene.value = { ...scene.value, ...change });
  const picture = /\.png$/i.test(s.file);
  return (
    <>
      <Group title="Scene">
        <Choice label="Shown" value={s.file} of={[['', 'one point'] as const, ...scenes.value.map((n) => [n, n] as const)]} set={(file) => set({ file })} />
        <button type="button" onClick={() => choose('.png,.fits,.fit,.csv,.toml', (f) => void takeScene(f))}>
          Load …
        </button>
        <p class="about">Or drop a FITS image, a grey PNG, a source list (CSV) or a scene description (TOML) anywhere on the page.</p>
        {/\.toml$/i.test(s.file) && (
          <Choice label="Rendered with" value={String(s.size)} of={['64', '128', '256', '512', '1024'].map((v) => [v, `${v} × ${v} pixels`] as const)} set={(v) => set({ size: Number(v) })} />
        )}
        {picture && (
          <>
            <button type="button" onClick={() => set({ width: Number(fieldDeg().toPrecision(3)) })} title="As wide as 64 beams">
              Width to suit the array
            </button>
            <NumberField label="Width" unit="°" value={s.width} min={1e-8} max={90} log set={(width) => set({ width: width > 0 ? width : 1 })} />
            <NumberField label="Black is" unit="K" value={s.min} min={0} max={400} step={1} set={(min) => set({ min })} />
            <NumberField label="White is" unit="K" value={s.max} min={0} max={400} step={1} set={(max) => set({ max })} />
          </>
        )}
      </Group>
      {hello.value && <Painter />}
    </>
  );
}

/** Dropped files are layouts by their ending, else scenes. A TOML file is what its text says. */
export async function dropped(e: DragEvent) {
  e.preventDefault();
  moving.value = false;
  for (const file of e.dataTransfer?.files ?? []) {
    const text = /\.(toml|txt|csv)$/i.test(file.name) ? (await file.slice(0, 200_000).text()) : '';
    const places = /\.(cfg|ant|txt)$/i.test(file.name) || /^\s*\[\[antenna\]\]/m.test(text) || /^\s*(name|number)[^\n]*,\s*(e|east|x)\b/im.test(text);
    if (places) drop({ name: file.name, bytes: await file.arrayBuffer() }, 'layout');
    else await takeScene(file);
  }
}
