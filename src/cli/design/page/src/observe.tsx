// The observation and its image.

import { Choice, Group, NumberField, Switch } from './fields';
import { imaging, isSite, layout, method, observation } from './state';

const SIZES = ['64', '128', '256', '512', '1024', '2048'] as const;

export function ObservePanel() {
  const o = observation.value;
  const i = imaging.value;
  const set = (change: Partial<typeof o>) => (observation.value = { ...observation.value, ...change });
  const image = (change: Partial<typeof i>) => (imaging.value = { ...imaging.value, ...change });
  const power = /^cos\^(.+)$/.exec(o.element)?.[1];
  return (
    <>
      <Group title="Band">
        <NumberField label="Frequency" unit="GHz" value={o.freq} min={0.05} max={400} log set={(freq) => set({ freq })} />
        <NumberField label="Bandwidth" unit="GHz" value={o.bandwidth} min={0.0001} max={40} log set={(bandwidth) => set({ bandwidth })} />
        <NumberField label="Channels" value={o.channels} min={1} max={32} whole set={(channels) => set({ channels: Math.max(1, channels) })} />
      </Group>
      <Group title="Time">
        {isSite.value ? (
          <>
            <NumberField label="Declination" unit="°" value={o.declination} min={-90} max={90} step={1} set={(declination) => set({ declination })} />
            <NumberField label="From hour angle" unit="h" value={o.from} min={-12} max={12} step={0.1} set={(from) => set({ from, to: Math.max(from, o.to) })} />
            <NumberField label="To hour angle" unit="h" value={o.to} min={-12} max={12} step={0.1} set={(to) => set({ to, from: Math.min(to, o.from) })} />
            <NumberField label="Integration" unit="s" value={o.integration} min={10} max={3600} log set={(integration) => set({ integration })} />
            <button type="button" onClick={() => set({ from: 0, to: Number((o.integration / 3600).toPrecision(6)) })}>
              Snapshot at culmination
            </button>
            <p class="about">The array stands at latitude {layout.value.site?.latitude_deg.toFixed(3)}°. Antennas that see the source below 5° take no part.</p>
          </>
        ) : (
          <>
            <NumberField label="Time" unit="s" value={o.time} min={0.01} max={3600} log set={(time) => set({ time })} />
            <p class="about">One snapshot along the boresight.</p>
          </>
        )}
      </Group>
      <Group title="Receivers">
        <NumberField label="Tsys" unit="K" value={o.tsys} min={0} max={2000} step={10} set={(tsys) => set({ tsys: Math.max(0, tsys) })} hint="0 is without noise" />
        <Choice
          label="Element pattern"
          value={power === undefined ? o.element : 'cos'}
          of={[['layout', 'as the layout states'], ['none', 'none'], ['airy', 'Airy disc'], ['gaussian', 'Gaussian'], ['cos', 'power of a cosine']]}
          set={(v) => set({ element: v === 'cos' ? 'cos^2' : v })}
        />
        {o.element === 'airy' && <NumberField label="Diameter" unit="m" value={o.diameter} min={0.001} max={100} log set={(diameter) => set({ diameter })} />}
        {o.element === 'gaussian' && <NumberField label="Width at half" unit="°" value={o.width} min={0.01} max={90} log set={(width) => set({ width })} />}
        {power !== undefined && <NumberField label="Power" value={Number(power)} min={0.5} max={20} step={0.5} set={(n) => set({ element: `cos^${n}` })} />}
      </Group>
      <Group title="Image">
        <Choice label="Pixels" value={String(i.size)} of={SIZES.map((s) => [s, `${s} × ${s}`] as const)} set={(v) => image({ size: Number(v) })} />
        <Choice
          label="Weighting"
          value={i.weighting}
          of={[['natural', 'natural'], ['uniform', 'uniform'], ['briggs', 'Briggs']]}
          set={(weighting) => image({ weighting })}
        />
        {i.weighting === 'briggs' && <NumberField label="Robust" value={i.robust} min={-2} max={2} step={0.1} set={(robust) => image({ robust })} />}
        <Choice
          label="Deconvolution"
          value={method.value}
          of={[['none', 'none'], ['clean', 'CLEAN'], ['mem', 'maximum entropy'], ['both', 'CLEAN and maximum entropy']]}
          set={(v) => (method.value = v)}
        />
        <Switch label="Pixels cover the scene" on={i.fit} set={(fit) => image({ fit })} hint="Otherwise the program chooses them from the beam." />
      </Group>
    </>
  );
}
