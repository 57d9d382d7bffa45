// The search for a better layout.

import { signal } from '@preact/signals';
import { Group, NumberField, Switch } from './fields';
import { copy } from './commands';
import { keep } from './compare';
import { short } from './maps';
import { beginSearch, busy, download, hello, search, stopSearch } from './server';
import { isSite, layout, observation, remember, setLayout, zones, type Layout } from './state';

export interface Wanted {
  weights: Record<string, number>;
  attempts: number;
  spacing: number; // m
  grid: number; // m, 0 for none
  beam: number; // wavelengths over the aperture, 0 for any
  within: number;
  band: boolean;
  seed: number;
}
export const wanted = signal<Wanted>({ weights: { psl: 1 }, attempts: 64, spacing: 0, grid: 0, beam: 1.2, within: 30, band: false, seed: 1 });

/** The options of `layout optimize`. */
function design(): Record<string, string | number> {
  const w = wanted.value;
  const list = Object.entries(w.weights).map(([name, weight]) => (weight === 1 ? name : `${name}=${weight}`));
  const out: Record<string, string | number> = { objective: list.join(','), seed: w.seed, beam: w.beam, within: w.within };
  if (w.spacing > 0) out.spacing = `${w.spacing}m`;
  if (w.grid > 0) out['position-grid'] = `${w.grid}m`;
  const o = observation.value;
  out.freq = `${o.freq}GHz`;
  if (w.band && o.channels > 1) {
    out.bandwidth = `${o.bandwidth}GHz`;
    out.channels = o.channels;
  }
  return out;
}

/** The zones as the file of `--keep-out`. */
function zoneFile(): string {
  return zones.value.map((z) => z.map((c) => c.join(',')).join('\n')).join('\n\n') + '\n';
}

function command(): string {
  const words = Object.entries(design()).map(([k, v]) => `--${k}=${v}`);
  const out = zones.value.length ? ['--keep-out=keep-out.csv'] : [];
  return ['cittert layout optimize --start=layout.toml', ...words, `--restarts=${wanted.value.attempts}`, ...out, '-o optimized.toml'].join(' ');
}

function go(shown: Layout, from: Layout) {
  const attempts = wanted.value.attempts;
  beginSearch(shown, attempts, { do: 'optimise', layout: from, design: design(), attempts, keep_out: zones.value });
}

function begin() {
  const start = layout.value;
  remember(start);
  keep();
  go(start, start);
}

/** Search on from the best, with other random numbers. */
function again() {
  wanted.value = { ...wanted.value, seed: wanted.value.seed + 1 };
  const before = search.value?.start;
  const start = layout.value;
  remember(start);
  go(before ?? start, start);
}

function Progress() {
  const s = search.value;
  if (!s) return null;
  const finite = s.scores.filter(Number.isFinite);
  const [low, high] = [Math.min(...finite), Math.max(...finite)];
  const x = (k: number) => 34 + (k / Math.max(1, s.scores.length - 1)) * 220;
  const y = (v: number) => 6 + (1 - (v - low) / (high - low || 1)) * 68;
  return (
    <Group title={s.running ? 'Searching …' : 'Search'}>
      <p class="about" role="status" data-search={s.running ? 'running' : 'ended'} data-done={s.done} data-best={s.best}>
        Attempt {s.done} of {s.of}
        {Number.isFinite(s.best) ? `, best score ${short(s.best)}` : ''}.
      </p>
      <progress max={s.of} value={s.done} aria-label="Attempts done" />
      {finite.length > 1 && (
        <figure class="dots">
          <figcaption>Best score against the attempts; lower is better</figcaption>
          <svg viewBox="0 0 260 80" role="img" aria-label={`Best score from ${short(finite[0])} to ${short(low)}`}>
            <line x1="34" x2="256" y1={y(low)} y2={y(low)} class="rule" />
            <text x="31" y={y(low) + 3} class="tick">
              {short(low)}
            </text>
            {high > low && (
              <text x="31" y={y(high) + 6} class="tick">
                {short(high)}
              </text>
            )}
            <polyline class="curve" points={s.scores.map((v, k) => `${x(k)},${y(v)}`).join(' ')} />
          </svg>
        </figure>
      )}
      <div class="buttons">
        <button type="button" disabled={!s.running} onClick={stopSearch}>
          Stop
        </button>
        <button type="button" disabled={s.running} onClick={again} title="Search on from this layout with other random numbers">
          Continue
        </button>
        <button type="button" disabled={s.running} onClick={() => setLayout(s.start)}>
          Back to the start
        </button>
      </div>
      <p class="about">The start is kept as A: the panel Compare shows it beside the result.</p>
    </Group>
  );
}

export function OptimisePanel() {
  const h = hello.value;
  const w = wanted.value;
  const running = search.value?.running ?? false;
  if (!h) return null;
  const set = (change: Partial<Wanted>) => (wanted.value = { ...wanted.value, ...change });
  const weigh = (name: string, weight: number | null) => {
    const weights = { ...w.weights };
    if (weight === null) delete weights[name];
    else weights[name] = weight;
    set({ weights });
  };
  return (
    <>
      <Group title="Make small">
        {h.objectives.map((o) => (
          <div key={o.name} class="objective">
            <Switch label={o.about} on={w.weights[o.name] !== undefined} set={(on) => weigh(o.name, on ? 1 : null)} hint={`Objective ${o.name}`} />
            {w.weights[o.name] !== undefined && Object.keys(w.weights).length > 1 && (
              <NumberField label="weight" value={w.weights[o.name]} min={0.01} max={10} log slider={false} set={(v) => v > 0 && weigh(o.name, v)} />
            )}
          </div>
        ))}
      </Group>
      <Group title="Constraints">
        <NumberField label="Least distance" unit="m" value={w.spacing} min={0} max={1} slider={false} set={(v) => set({ spacing: Math.max(0, v) })} hint="Between two antennas; 0 for none" />
        <NumberField label="Places on a grid of" unit="m" value={w.grid} min={0} max={1} slider={false} set={(v) => set({ grid: Math.max(0, v) })} hint="0 for none" />
        <NumberField label="Widest beam" unit="λ/D" value={w.beam} min={0} max={3} slider={false} set={(v) => set({ beam: Math.max(0, v) })} hint="Full width at half of the maximum; 0 allows any" />
        <NumberField label="Side lobes within" unit="λ/D" value={w.within} min={2} max={1000} slider={false} set={(v) => set({ within: v })} hint="Distance from the centre to which side lobes count" />
        <Switch label="Beam of the whole band" on={w.band} set={(band) => set({ band })} />
        <p class="about">
          {zones.value.length ? `${zones.value.length} zones are kept clear.` : 'Draw zones with the tool Keep out, and no antenna will stand there.'} The number of
          antennas and the aperture are those of the layout.
        </p>
      </Group>
      <Group title="Effort">
        <NumberField label="Attempts" value={w.attempts} min={4} max={1000} log whole set={(v) => set({ attempts: Math.max(1, v) })} />
        <NumberField label="Seed" value={w.seed} min={1} max={100} whole slider={false} set={(v) => set({ seed: Math.max(1, v) })} />
        <button type="button" class="main" disabled={running || busy.value || !Object.keys(w.weights).length} onClick={begin}>
          Start
        </button>
        {isSite.value && <p class="about">The beam is that of a plane: stations that stand on no plane cannot be searched here.</p>}
      </Group>
      <Progress />
      <Group title="The same on the command line">
        <pre data-output="optimized.toml">{command()}</pre>
        <div class="buttons">
          <button type="button" onClick={(e) => copy(command(), e.currentTarget)}>
            Copy
          </button>
          {zones.value.length > 0 && (
            <button type="button" onClick={() => download('keep-out.csv', zoneFile())}>
              Save keep-out.csv
            </button>
          )}
        </div>
      </Group>
    </>
  );
}
