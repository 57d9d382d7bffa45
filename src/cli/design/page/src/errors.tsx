// Errors of the antennas, and what self-calibration makes of them.

import { Group, NumberField, Switch } from './fields';
import { short } from './maps';
import { closures, gains } from './server';
import { errors } from './state';

interface Dots {
  values: number[];
  kind: 'true' | 'solved';
}

/** Values of the antennas, or of triangles, as dots from left to right. */
export function DotPlot({ title, unit, rows, low, high, names }: { title: string; unit: string; rows: Dots[]; low: number; high: number; names: string[] }) {
  const [w, h, left, top] = [260, 92, 34, 4];
  const x = (k: number) => left + ((k + 0.5) / Math.max(1, names.length)) * (w - left - 4);
  const y = (v: number) => top + (1 - (v - low) / (high - low || 1)) * (h - 2 * top);
  const r = names.length > 100 ? 1.2 : names.length > 40 ? 1.8 : 2.6;
  return (
    <figure class="dots">
      <figcaption>{title}</figcaption>
      <svg viewBox={`0 0 ${w} ${h}`} role="img" aria-label={`${title}, ${names.length} values from ${short(low)} to ${short(high)} ${unit}`}>
        {[low, (low + high) / 2, high].map((v) => (
          <g key={v}>
            <line x1={left} x2={w} y1={y(v)} y2={y(v)} class="rule" />
            <text x={left - 3} y={y(v) + 3} class="tick">
              {short(v)}
              {unit}
            </text>
          </g>
        ))}
        {rows.map((row) =>
          row.values.map((v, k) => (
            <circle key={k} cx={x(k)} cy={y(Math.max(low, Math.min(high, v)))} r={row.kind === 'true' ? r + 0.8 : r} class={row.kind}>
              <title>{`${names[k]}: ${short(v)}${unit}`}</title>
            </circle>
          )),
        )}
      </svg>
    </figure>
  );
}

const degrees = (all: number[]) => all.map((v) => (v * 180) / Math.PI);

function Gains() {
  const g = gains.value;
  if (!g?.true && !g?.solved) return null;
  const rows = (of: (t: { phase_rad: number[]; amplitude: number[] }) => number[]): Dots[] => [
    ...(g.true ? [{ values: of(g.true), kind: 'true' as const }] : []),
    ...(g.solved ? [{ values: of(g.solved), kind: 'solved' as const }] : []),
  ];
  const amplitudes = rows((t) => t.amplitude);
  const most = Math.max(1.1, ...amplitudes.flatMap((r) => r.values)) * 1.02;
  const least = Math.min(0.9, ...amplitudes.flatMap((r) => r.values)) * 0.98;
  return (
    <Group title="Gains of the antennas">
      <p class="about">
        <i class="key ring" /> true{' '}
        {g.solved && (
          <>
            <i class="key dot" /> solved
          </>
        )}
      </p>
      <DotPlot title="Phase" unit="°" rows={rows((t) => degrees(t.phase_rad))} low={-180} high={180} names={g.names} />
      <DotPlot title="Amplitude" unit="" rows={amplitudes} low={least} high={most} names={g.names} />
      {g.solved && (
        <p class="about" data-gains={g.accepted ? 'accepted' : 'refused'}>
          {g.accepted ? 'The solution was accepted' : 'The solution was not accepted: it does not make the image better'}
          {g.deconvolver ? ` (model by ${g.deconvolver})` : ''}.
          {g.left ? ` What is left: ${short((g.left.rms_phase_rad * 180) / Math.PI)}° rms in phase, ${short(100 * g.left.rms_amplitude)} % in amplitude.` : ''}
        </p>
      )}
    </Group>
  );
}

function Closures() {
  const c = closures.value;
  if (!c?.names.length) return null;
  return (
    <Group title="Closure phases">
      <p class="about">
        <i class="key ring" /> without errors <i class="key dot" /> with them, before calibration. The sum of the phases around three antennas does not depend on the
        phases of the antennas.
      </p>
      <DotPlot
        title={`${c.names.length} triangles`}
        unit="°"
        rows={[
          { values: degrees(c.true_rad), kind: 'true' },
          { values: degrees(c.observed_rad), kind: 'solved' },
        ]}
        low={-180}
        high={180}
        names={c.names}
      />
    </Group>
  );
}

export function ErrorsPanel() {
  const e = errors.value;
  const set = (change: Partial<typeof e>) => (errors.value = { ...errors.value, ...change });
  return (
    <>
      <Group title="Errors of the antennas">
        <NumberField label="Phase" unit="°" value={e.phase} min={0} max={120} step={1} set={(v) => set({ phase: Math.max(0, v) })} />
        <NumberField label="Amplitude" unit="%" value={e.amplitude} min={0} max={50} step={1} set={(v) => set({ amplitude: Math.max(0, v) })} />
        <NumberField label="Position" unit="λ/100" value={e.position} min={0} max={50} step={0.5} set={(v) => set({ position: Math.max(0, v) })} />
        <NumberField label="Atmosphere" unit="°" value={e.atmosphere} min={0} max={180} step={1} set={(v) => set({ atmosphere: Math.max(0, v) })} hint="Rms phase between two antennas of the distance below" />
        {e.atmosphere > 0 && <NumberField label="… at a distance of" unit="m" value={e.apart} min={0.1} max={10000} log set={(v) => set({ apart: v > 0 ? v : 1 })} />}
        <NumberField label="Failed antennas" unit="%" value={e.failed} min={0} max={60} step={1} set={(v) => set({ failed: Math.min(95, Math.max(0, v)) })} />
        <NumberField label="Seed" value={e.seed} min={1} max={100} whole set={(v) => set({ seed: Math.max(1, v) })} hint="Another seed draws other errors of the same size" />
        <button type="button" onClick={() => set({ phase: 0, amplitude: 0, position: 0, atmosphere: 0, failed: 0 })}>
          No errors
        </button>
      </Group>
      <Group title="Self-calibration">
        <Switch label="Self-calibrate" on={e.selfcal} set={(selfcal) => set({ selfcal })} />
        <Switch label="Amplitudes too" on={e.amplitudes} set={(amplitudes) => set({ amplitudes })} />
      </Group>
      <Gains />
      <Closures />
    </>
  );
}
