// Where layouts come from and where they go: built-in ones, generators, files.

import { batch } from '@preact/signals';
import { useEffect, useRef, useState } from 'preact/hooks';
import { Choice, Group, NumberField } from './fields';
import { Places, fitView, reach } from './editor';
import { drop, hello, tell } from './server';
import { isSite, layout, observation, scene, selected, setLayout, zones } from './state';

/** Options that a kind may take, with the range of their sliders. Those that are off have the value of the kind. */
const OPTIONS: Record<string, { label: string; min: number; max: number; first: number; whole?: boolean }> = {
  arms: { label: 'Arms', min: 1, max: 12, first: 3, whole: true },
  exponent: { label: 'Exponent', min: 0.3, max: 3, first: 1.716 },
  rings: { label: 'Rings', min: 1, max: 12, first: 3, whole: true },
  columns: { label: 'Columns', min: 1, max: 64, first: 8, whole: true },
  turns: { label: 'Turns', min: -3, max: 3, first: 0.5 },
  inner: { label: 'Inner radius', min: 0.01, max: 0.9, first: 0.1 },
  seed: { label: 'Seed', min: 1, max: 100, first: 1, whole: true },
};

function Generators() {
  const h = hello.value!;
  const [kind, setKind] = useState('fermat');
  const [elements, setElements] = useState(64);
  const [aperture, setAperture] = useState(1);
  const [diameter, setDiameter] = useState(0);
  const [rotation, setRotation] = useState(0);
  const [more, setMore] = useState<Record<string, number>>({});
  const first = useRef(true);
  const of = h.kinds.find((k) => k.name === kind)!;
  const make = () => {
    const out: Record<string, unknown> = { kind, elements, aperture: `${aperture}m` };
    if (diameter > 0) out.diameter = `${diameter}m`;
    if (rotation) out.rotation = `${rotation}deg`;
    for (const name of of.options) if (more[name] !== undefined) out[name] = more[name];
    tell({ do: 'make', make: out });
  };
  // A moved slider makes the layout anew; opening the panel does not.
  useEffect(() => {
    if (first.current) first.current = false;
    else make();
  }, [kind, elements, aperture, diameter, rotation, more]);
  return (
    <Group title="Generate">
      <Choice
        label="Kind"
        value={kind}
        of={h.kinds.map((k) => [k.name, k.name] as const)}
        set={(k) => {
          setMore({});
          setKind(k);
        }}
        hint={of.about}
      />
      <p class="about">{of.about}.</p>
      <NumberField label="Antennas" value={elements} min={3} max={256} whole log set={(n) => setElements(Math.max(2, n))} />
      <NumberField label="Longest baseline" unit="m" value={aperture} min={0.05} max={5000} log set={setAperture} />
      <NumberField label="Diameter" unit="m" value={diameter} min={0} max={25} slider={false} set={(v) => setDiameter(Math.max(0, v))} hint="0 states none" />
      <NumberField label="Rotation" unit="°" value={rotation} min={-180} max={180} step={1} set={setRotation} />
      {of.options.map((name) => {
        const o = OPTIONS[name];
        return o && <NumberField key={name} {...o} value={more[name] ?? o.first} set={(v) => setMore({ ...more, [name]: v })} />;
      })}
      <button type="button" onClick={make}>
        Generate
      </button>
    </Group>
  );
}

export function choose(accept: string, then: (file: File) => void) {
  const input = document.createElement('input');
  input.type = 'file';
  input.accept = accept;
  input.onchange = () => input.files?.[0] && then(input.files[0]);
  input.click();
}

function scaleAll(factor: number) {
  const l = layout.value;
  const { x, y } = reach.value;
  setLayout({
    ...l,
    ...(typeof l.aperture_m === 'number' ? { aperture_m: l.aperture_m * factor } : {}),
    antenna: l.antenna.map((a) => {
      const [px, py, pz] = a.position_m;
      return { ...a, position_m: [x + (px - x) * factor, y + (py - y) * factor, pz * factor] };
    }),
  });
  fitView();
}

export function LayoutPanel() {
  const h = hello.value;
  const [format, setFormat] = useState('toml');
  if (!h) return null;
  const load = (name: string) => {
    const b = h.builtin.find((x) => x.name === name);
    if (!b) return;
    tell({ do: 'builtin', name });
    const freq = b.freq_hz / 1e9;
    batch(() => {
      observation.value = { ...observation.value, freq, bandwidth: Number((freq / 50).toPrecision(2)) };
      zones.value = [];
      // The scenes that are seen from nearby are far too wide for an array on the Earth.
      if (!isSite.value && !/^mm-/.test(name)) scene.value = { ...scene.value, file: '' };
    });
  };
  const site = layout.value.site;
  const toSite = () => {
    const { site: _, ...rest } = layout.value;
    setLayout(isSite.value ? { ...rest, frame: 'boresight' } : { ...rest, frame: 'enu', site: { latitude_deg: 34.0788, longitude_deg: -107.6183, altitude_m: 2115 } });
  };
  const place = (part: Partial<NonNullable<typeof site>>) => site && setLayout({ ...layout.value, site: { ...site, ...part } });
  return (
    <>
      <Group title="Layout">
        <div class="field">
          <label for="layout-name">Name</label>
          <input id="layout-name" type="text" value={layout.value.name} onChange={(e) => (layout.value = { ...layout.value, name: e.currentTarget.value || 'layout' })} />
        </div>
        <div class="field">
          <label for="builtin">Built-in</label>
          <select
            id="builtin"
            value=""
            onChange={(e) => {
              load(e.currentTarget.value);
              e.currentTarget.value = '';
            }}
          >
            <option value="">choose …</option>
            {h.builtin.map((b) => (
              <option key={b.name} value={b.name} title={b.about}>
                {b.name}
              </option>
            ))}
          </select>
        </div>
        <div class="buttons">
          <button type="button" onClick={() => choose('.toml,.cfg,.txt,.csv,.ant', async (f) => drop({ name: f.name, bytes: await f.arrayBuffer() }, 'layout'))}>
            Load …
          </button>
          <button type="button" onClick={() => tell({ do: 'save', format, layout: layout.value })}>
            Save as
          </button>
          <select aria-label="Format of the saved layout" value={format} onChange={(e) => setFormat(e.currentTarget.value)}>
            {h.formats.map((f) => (
              <option key={f.name} value={f.name}>
                {f.name} (.{f.extension})
              </option>
            ))}
          </select>
          <button
            type="button"
            onClick={() => {
              setLayout({ ...layout.value, name: 'empty', antenna: [] });
              selected.value = new Set();
            }}
          >
            Empty
          </button>
          <button type="button" onClick={() => scaleAll(0.8)} title="Every place times 0.8 about the centre">
            Shrink
          </button>
          <button type="button" onClick={() => scaleAll(1.25)} title="Every place times 1.25 about the centre">
            Grow
          </button>
        </div>
      </Group>
      <Generators />
      <Group title="Frame">
        <p class="about">{isSite.value ? 'East, north and up at a site on the Earth.' : 'The plane of an aperture, seen along the boresight.'}</p>
        {site && (
          <>
            <NumberField label="Latitude" unit="°" value={site.latitude_deg} min={-90} max={90} step={0.5} set={(latitude_deg) => place({ latitude_deg })} />
            <NumberField label="Longitude" unit="°" value={site.longitude_deg} min={-180} max={180} step={0.5} set={(longitude_deg) => place({ longitude_deg })} />
            <NumberField label="Altitude" unit="m" value={site.altitude_m} min={0} max={6000} slider={false} set={(altitude_m) => place({ altitude_m })} />
          </>
        )}
        <button type="button" onClick={toSite}>
          {isSite.value ? 'Make it a boresight array' : 'Place it on the Earth'}
        </button>
      </Group>
      <Group title={selected.value.size ? 'Selected antennas' : 'Antennas'}>
        <Places />
      </Group>
    </>
  );
}
