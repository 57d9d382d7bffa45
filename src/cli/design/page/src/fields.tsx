// Fields of the panels: numbers with sliders, choices and switches.

import type { ComponentChildren } from 'preact';
import { useId } from 'preact/hooks';
import { moving } from './server';

interface NumberProps {
  label: string;
  unit?: string;
  value: number;
  min: number;
  max: number;
  step?: number;
  log?: boolean; // A slider in equal ratios.
  whole?: boolean;
  slider?: boolean;
  hint?: string;
  set: (v: number) => void;
}

/** A number with its unit, and a slider over its useful range. The field takes numbers beyond the slider. */
export function NumberField({ label, unit, value, min, max, step, log, whole, slider = true, hint, set }: NumberProps) {
  const id = useId();
  const place = log ? Math.log(Math.max(value, min) / min) / Math.log(max / min) : value;
  const from = (x: number) => {
    const v = log ? min * (max / min) ** x : x;
    return whole ? Math.round(v) : Number(v.toPrecision(4));
  };
  const typed = (text: string) => {
    const v = Number(text);
    if (text.trim() !== '' && Number.isFinite(v)) set(whole ? Math.round(v) : v);
  };
  return (
    <div class="field" title={hint}>
      <label for={id}>{label}</label>
      <span class="value">
        <input id={id} type="number" value={value} step="any" onChange={(e) => typed(e.currentTarget.value)} />
        <span class="unit">{unit}</span>
      </span>
      {slider && (
        <input
          type="range"
          aria-label={`${label}, slider`}
          min={log ? 0 : min}
          max={log ? 1 : max}
          step={log ? 0.005 : (step ?? (whole ? 1 : (max - min) / 200))}
          value={place}
          onInput={(e) => {
            moving.value = true;
            set(from(Number(e.currentTarget.value)));
          }}
          onChange={() => (moving.value = false)}
        />
      )}
    </div>
  );
}

export function Choice<T extends string>(p: { label: string; value: T; of: readonly (readonly [T, string])[]; set: (v: T) => void; hint?: string }) {
  const id = useId();
  return (
    <div class="field" title={p.hint}>
      <label for={id}>{p.label}</label>
      <select id={id} value={p.value} onChange={(e) => p.set(e.currentTarget.value as T)}>
        {p.of.map(([v, text]) => (
          <option key={v} value={v}>
            {text}
          </option>
        ))}
      </select>
    </div>
  );
}

export function Switch(p: { label: string; on: boolean; set: (v: boolean) => void; hint?: string }) {
  return (
    <label class="switch" title={p.hint}>
      <input type="checkbox" checked={p.on} onChange={(e) => p.set(e.currentTarget.checked)} /> {p.label}
    </label>
  );
}

export function Group({ title, children }: { title: string; children: ComponentChildren }) {
  return (
    <fieldset>
      <legend>{title}</legend>
      {children}
    </fieldset>
  );
}
