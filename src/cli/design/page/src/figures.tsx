// Figures of merit, as `layout show --json` has them.

import { angle, short } from './maps';
import { figures } from './server';

export type Figures = Record<string, unknown>;

/** The rows: key, words, and how a number is shown. All are shown to four digits. */
export const ROWS: [string, string, (v: number) => string][] = [
  ['n_baselines', 'Baselines', (v) => v.toLocaleString('en')],
  ['bmaj_rad', 'Beam, long', angle4],
  ['bmin_rad', 'Beam, short', angle4],
  ['psl_within_db', 'Highest side lobe', (v) => `${v.toFixed(2)} dB`],
  ['rms_sidelobe_within', 'Rms side lobe', digits],
  ['psl_db', '… to the horizon', (v) => `${v.toFixed(2)} dB`],
  ['longest_m', 'Longest baseline', metres],
  ['shortest_m', 'Shortest baseline', metres],
  ['largest_scale_rad', 'Largest scale', angle4],
  ['alias_free_field_rad', 'Field without aliases', angle4],
  ['uv_fill', 'u-v plane filled', (v) => `${digits(100 * v)} %`],
  ['redundancy', 'Redundancy', digits],
  ['radial_uniformity', 'Evenness, radial', digits],
  ['azimuthal_uniformity', 'Evenness, around', digits],
  ['largest_hole_m', 'Largest hole', metres],
  ['cable_m', 'Cables', metres],
  ['delta_t_k', 'Noise of the image', (v) => `${digits(v)} K`],
  ['point_source_jy', 'Noise, point source', (v) => `${digits(v)} Jy`],
];

function digits(v: number): string {
  return v !== 0 && (Math.abs(v) < 1e-3 || Math.abs(v) >= 1e6) ? v.toExponential(3) : String(Number(v.toPrecision(4)));
}

function angle4(rad: number): string {
  return angle(rad, 4);
}

export function metres(v: number): string {
  const [x, unit] = v >= 1000 ? [v / 1000, 'km'] : v >= 1 || v === 0 ? [v, 'm'] : v >= 0.01 ? [v * 100, 'cm'] : [v * 1000, 'mm'];
  return `${Number(x.toPrecision(4))} ${unit}`;
}

export function FiguresTable() {
  const f = figures.value;
  return (
    <section class="figures" aria-label="Figures of merit">
      {f ? (
        <dl>
          {ROWS.filter(([key]) => typeof f[key] === 'number').map(([key, words, show]) => (
            <div key={key} data-figure={key} title={`${key}: ${short(f[key] as number)}`}>
              <dt>{words}</dt>
              <dd>{show(f[key] as number)}</dd>
            </div>
          ))}
        </dl>
      ) : (
        <p class="about">The figures follow once the hand rests.</p>
      )}
    </section>
  );
}
