// Two designs beside each other: A was kept, B is what the page shows now.

import { useEffect, useRef, useState } from 'preact/hooks';
import { signal, useSignalEffect } from '@preact/signals';
import { Choice, Group } from './fields';
import { ROWS, type Figures } from './figures';
import { FLOOR_DB, ImageMap, decibel, paint, range } from './maps';
import { busy, figures, hello, pictures, reporting, tell, type Picture } from './server';
import { layout, observation, restore, sections, setLayout, snapshot, imaging, type Layout } from './state';

export interface Kept {
  state: ReturnType<typeof snapshot>;
  layout: Layout;
  pictures: Record<string, Picture>;
  figures: Figures | null;
}

export const kept = signal<Kept | null>(null);
export const shown = signal('psf');

export function keep() {
  kept.value = { state: snapshot(), layout: layout.value, pictures: pictures.value, figures: figures.value };
}

/** Show a design, keep it as A once everything of it is there, and show another one. */
export async function openPair(a: Kept['state'], b: Kept['state']) {
  restore(a);
  for (let quiet = 0; quiet < 3; quiet = hello.value && !busy.value && figures.value ? quiet + 1 : 0) await new Promise((done) => setTimeout(done, 100));
  keep();
  restore(b);
}

/** A becomes what the page shows, and what it showed becomes A. */
function swap() {
  const a = kept.value;
  if (!a) return;
  keep();
  setLayout(a.layout);
  restore(a.state);
}

const NAMES: Record<string, string> = { psf: 'Beam', dirty: 'Dirty image', clean: 'CLEAN', mem: 'Maximum entropy' };

export function ComparePanel() {
  const a = kept.value;
  const of = a ? Object.keys(NAMES).filter((n) => a.pictures[n] && pictures.value[n]) : [];
  const options = () => {
    const section = sections().scene as Record<string, unknown> | undefined;
    return { freq: `${observation.value.freq}GHz`, ...(section ? { scene: section, size: Math.min(512, imaging.value.size) } : {}) };
  };
  return (
    <>
      <Group title="Compare two designs">
        <p class="about">A is a design that you keep. B is what the page shows now: go on changing it.</p>
        <div class="buttons">
          <button type="button" class="main" disabled={busy.value} onClick={keep}>
            Keep this as A
          </button>
          <button type="button" disabled={!a} onClick={swap}>
            Exchange A and B
          </button>
          <button type="button" disabled={!a} onClick={() => (kept.value = null)}>
            Forget A
          </button>
        </div>
        {a && of.length > 0 && <Choice label="Image" value={of.includes(shown.value) ? shown.value : of[0]} of={of.map((n) => [n, NAMES[n]] as const)} set={(v) => (shown.value = v)} />}
      </Group>
      {a && (
        <>
          <Group title="Report">
            <p class="about">The report of <code>cittert layout compare</code>: figures, beams, and images of the same scene by every method. It takes a minute or so.</p>
            <button
              type="button"
              disabled={reporting.value}
              onClick={() => {
                reporting.value = true;
                tell({ do: 'report', a: a.layout, b: layout.value, options: options() });
              }}
            >
              {reporting.value ? 'Making the report …' : 'Make the report'}
            </button>
            <div class="buttons">
              <button type="button" onClick={() => tell({ do: 'save', format: 'toml', layout: { ...a.layout, name: 'a' } })}>
                Save a.toml
              </button>
              <button type="button" onClick={() => tell({ do: 'save', format: 'toml', layout: { ...layout.value, name: 'b' } })}>
                Save b.toml
              </button>
            </div>
            <pre data-output="comparison">{command(options())}</pre>
          </Group>
        </>
      )}
    </>
  );
}

/** The same on the command line. */
function command(options: { freq: string; scene?: Record<string, unknown>; size?: number }): string {
  const words = [`--freq=${options.freq}`];
  for (const [k, v] of Object.entries(options.scene ?? {})) words.push(k === 'file' ? `--scene=${v}` : `--${k}=${v}`);
  if (options.size) words.push(`--size=${options.size}`);
  return ['cittert layout compare a.toml b.toml', ...words, '-o comparison'].join(' ');
}

/** The figures of A and B, which stand in the place of those of the page. */
export function CompareTable() {
  const [a, b] = [kept.value?.figures, figures.value];
  if (!a || !b) return <p class="about">The figures follow once the hand rests.</p>;
  const rows = ROWS.filter(([key]) => typeof a[key] === 'number' && typeof b[key] === 'number');
  return (
    <section class="figures" aria-label="Figures of A and B">
      <table class="compare" aria-label="Figures of A and B">
        <thead>
          <tr>
            <th scope="col" />
            <th scope="col">A</th>
            <th scope="col">B</th>
            <th scope="col">change</th>
          </tr>
        </thead>
        <tbody>
          {rows.map(([key, words, show]) => {
            const [x, y] = [a[key] as number, b[key] as number];
            const db = key.endsWith('_db');
            const change = db ? `${y >= x ? '+' : ''}${(y - x).toFixed(2)} dB` : x === y ? '0 %' : x === 0 ? '' : `${y >= x ? '+' : ''}${(((y - x) / Math.abs(x)) * 100).toFixed(1)} %`;
            return (
              <tr key={key}>
                <th scope="row">{words}</th>
                <td>{show(x)}</td>
                <td>{show(y)}</td>
                <td>{change}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </section>
  );
}

/** One map of which A shows on the left of the slider and B on the right. */
function Wipe({ a, b, beam }: { a: Picture; b: Picture; beam: boolean }) {
  const ref = useRef<HTMLCanvasElement>(null);
  const [at, setAt] = useState(50);
  const draw = () => {
    const canvas = ref.current;
    if (!canvas) return;
    const [low, high] = beam ? [FLOOR_DB, 0] : range(b.data);
    const place = beam ? (v: number) => (decibel(v) - low) / (high - low) : (v: number) => (v - low) / (high - low || 1);
    paint(canvas, b, 'inferno', place);
    paint(canvas, a, 'inferno', place, at / 100);
  };
  useEffect(draw);
  useEffect(() => {
    const seen = new ResizeObserver(draw);
    seen.observe(ref.current!);
    return () => seen.disconnect();
  }, [a, b, at]);
  return (
    <figure class="map wide" data-map="wipe">
      <figcaption>
        <b>A | B</b>
        <span>A on the left of the slider, B on the right</span>
      </figcaption>
      <div class="square">
        <canvas ref={ref} role="img" aria-label={`A on the left ${at} % of the map, B on the rest`} />
      </div>
      <input type="range" min={0} max={100} value={at} aria-label="Where A ends and B begins, percent" onInput={(e) => setAt(Number(e.currentTarget.value))} />
    </figure>
  );
}

/** B minus A on the pixels of B; null where their pixels differ. */
function difference(a: Picture, b: Picture): Picture | null {
  const same = a.columns === b.columns && a.rows === b.rows && Math.abs(a.cell_rad / b.cell_rad - 1) < 1e-9 && a.unit === b.unit;
  return same ? { ...b, name: 'difference', data: b.data.map((v, k) => v - a.data[k]) } : null;
}

export function CompareMaps() {
  const a = kept.value!;
  const [pair, setPair] = useState<{ a: Picture; b: Picture; beam: boolean; less: Picture | null } | null>(null);
  useSignalEffect(() => {
    const k = kept.value;
    const names = Object.keys(NAMES).filter((n) => k?.pictures[n] && pictures.value[n]);
    const name = names.includes(shown.value) ? shown.value : names[0];
    if (!k || !name) return setPair(null);
    const [x, y] = [k.pictures[name], pictures.value[name]];
    setPair({ a: x, b: y, beam: name === 'psf', less: difference(x, y) });
  });
  if (!pair) return <main class="maps" aria-label="Comparison" />;
  const name = pair.beam ? 'psf' : 'compare';
  return (
    <main class="maps two" aria-label="Comparison">
      <ImageMap name={name} title={`A: ${a.layout.name}`} picture={pair.a} key={`a${name}`} />
      <ImageMap name={name} title={`B: ${layout.value.name}`} picture={pair.b} key={`b${name}`} />
      <Wipe a={pair.a} b={pair.b} beam={pair.beam} />
      {pair.less ? (
        <ImageMap name="difference" title="Difference, B − A" picture={pair.less} two />
      ) : (
        <figure class="map">
          <figcaption>
            <b>Difference</b>
            <span />
          </figcaption>
          <p class="about">The pixels of A and B differ in number or size, so that no difference can be shown. Give both the same pixels and aperture.</p>
        </figure>
      )}
    </main>
  );
}
