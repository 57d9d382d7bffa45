// The editor of the layout: antennas are dragged, added, deleted and selected with a lasso; zones are drawn in which none may stand.

import { useEffect, useRef, useState } from 'preact/hooks';
import { batch, computed, signal, useSignalEffect } from '@preact/signals';
import { css, short } from './maps';
import { metres } from './figures';
import { arrivals, moving } from './server';
import { drawGround } from './ground';
import { freshName, isSite, layout, redo, remember, selected, setLayout, undo, zones, type Antenna, type Layout } from './state';

type Tool = 'move' | 'add' | 'zone';
export const tool = signal<Tool>('move');
/** Places are rounded to multiples of this, m; 0 for none. */
export const snap = signal(0);

/** The circle in which the antennas stand: centre and radius, m. */
export const reach = computed(() => {
  const a = layout.value.antenna;
  if (!a.length) return { x: 0, y: 0, r: 0.5 };
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const { position_m: [x, y] } of a) {
    x0 = Math.min(x0, x);
    x1 = Math.max(x1, x);
    y0 = Math.min(y0, y);
    y1 = Math.max(y1, y);
  }
  const [x, y] = [(x0 + x1) / 2, (y0 + y1) / 2];
  const r = Math.max(...a.map((p) => Math.hypot(p.position_m[0] - x, p.position_m[1] - y)));
  return { x, y, r: r || 0.5 };
});

interface View {
  x: number;
  y: number;
  half: number; // m from the centre to the edge
}
const view = signal<View>({ x: 0, y: 0, half: 1 });

export function fitView() {
  const c = reach.peek();
  const designed = layout.peek().aperture_m;
  const half = 1.12 * Math.max(c.r, typeof designed === 'number' ? designed / 2 : 0);
  view.value = { x: c.x, y: c.y, half };
}

function rounded(v: number): number {
  const g = snap.value;
  return g > 0 ? Number((Math.round(v / g) * g).toPrecision(12)) : Number(v.toPrecision(7));
}

function moved(from: Layout, which: Set<number>, dx: number, dy: number): Layout {
  const antenna = from.antenna.map((a, k) => {
    if (!which.has(k)) return a;
    const [x, y, z] = a.position_m;
    return { ...a, position_m: [rounded(x + dx), rounded(y + dy), z] as Antenna['position_m'] };
  });
  return { ...from, antenna };
}

export function add(x: number, y: number) {
  const l = layout.value;
  const like = l.antenna[l.antenna.length - 1];
  const made: Antenna = { ...(like ?? {}), name: freshName(l.antenna), position_m: [rounded(x), rounded(y), like ? like.position_m[2] : 0] };
  delete made.number;
  setLayout({ ...l, antenna: [...l.antenna, made] });
  selected.value = new Set([l.antenna.length]);
}

export function deleteSelected() {
  const which = selected.value;
  if (!which.size) return;
  const l = layout.value;
  setLayout({ ...l, antenna: l.antenna.filter((_, k) => !which.has(k)) });
}

function selectAll() {
  selected.value = new Set(layout.value.antenna.keys());
}

/** Keys of the editor. True where the key was one. */
function key(e: KeyboardEvent): boolean {
  const l = layout.value;
  const one = selected.value.size === 1 ? [...selected.value][0] : -1;
  const step = (snap.value || view.value.half / 100) * (e.shiftKey ? 10 : 1);
  const arrows: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const arrow = arrows[e.key];
  const control = e.ctrlKey || e.metaKey;
  if (arrow && selected.value.size) setLayoutKeeping(moved(l, selected.value, arrow[0] * step, arrow[1] * step));
  else if (e.key === 'Delete' || e.key === 'Backspace') deleteSelected();
  else if (control && e.key.toLowerCase() === 'a') selectAll();
  else if (e.key === 'Escape') selected.value = new Set();
  else if (!control && e.key === 'n' && l.antenna.length) selected.value = new Set([(one + 1) % l.antenna.length]);
  else if (!control && e.key === 'p' && l.antenna.length) selected.value = new Set([(one + l.antenna.length - (one < 0 ? 0 : 1)) % l.antenna.length]);
  else if (!control && e.key === 'a') add(view.value.x, view.value.y);
  else if (!control && (e.key === '+' || e.key === '=')) view.value = { ...view.value, half: view.value.half / 1.25 };
  else if (!control && e.key === '-') view.value = { ...view.value, half: view.value.half * 1.25 };
  else if (!control && e.key === '0') fitView();
  else return false;
  return true;
}

function setLayoutKeeping(next: Layout) {
  const kept = selected.value;
  batch(() => {
    setLayout(next);
    selected.value = kept;
  });
}

/** Undo and redo work everywhere but in a field of text. */
export function globalKey(e: KeyboardEvent) {
  if (!(e.ctrlKey || e.metaKey) || (e.target as HTMLElement).matches('input[type=number], input[type=text], textarea')) return;
  const k = e.key.toLowerCase();
  if (k === 'z' && !e.shiftKey) undo();
  else if (k === 'y' || (k === 'z' && e.shiftKey)) redo();
  else return;
  e.preventDefault();
}

type Drag =
  | { kind: 'antennas'; from: Layout; which: Set<number>; x: number; y: number; moved: boolean }
  | { kind: 'lasso'; points: [number, number][]; add: boolean }
  | { kind: 'pan'; view: View; px: number; py: number };

function inside(p: [number, number], corners: [number, number][]): boolean {
  let odd = false;
  for (let i = 0, j = corners.length - 1; i < corners.length; j = i++) {
    const [xi, yi] = corners[i];
    const [xj, yj] = corners[j];
    if (yi > p[1] !== yj > p[1] && p[0] < ((xj - xi) * (p[1] - yi)) / (yj - yi) + xi) odd = !odd;
  }
  return odd;
}

const REST_MS = 250;

export function Editor() {
  const ref = useRef<HTMLCanvasElement>(null);
  const drag = useRef<Drag | null>(null);
  const corners = useRef<[number, number][]>([]);
  const rest = useRef(0);
  const [told, setTold] = useState('');
  const [, again] = useState(0);

  // Where an antenna is on the screen, for tests.
  (window as unknown as { cittert: Record<string, unknown> }).cittert.screen = (k: number) => {
    const box = ref.current!.getBoundingClientRect();
    const [x, y] = layout.value.antenna[k].position_m;
    const scale = size() / (2 * view.value.half);
    return [box.left + box.width / 2 + (x - view.value.x) * scale, box.top + box.height / 2 - (y - view.value.y) * scale];
  };
  const size = () => {
    const canvas = ref.current!;
    return Math.min(canvas.clientWidth, canvas.clientHeight) || 1;
  };
  /** Metres of a place on the screen. */
  const place = (e: { clientX: number; clientY: number }): [number, number] => {
    const box = ref.current!.getBoundingClientRect();
    const { x, y, half } = view.value;
    const scale = (2 * half) / size();
    return [x + (e.clientX - box.left - box.width / 2) * scale, y - (e.clientY - box.top - box.height / 2) * scale];
  };
  const nearest = (p: [number, number], reachPx: number): number => {
    const within = (reachPx * 2 * view.value.half) / size();
    let best = -1;
    let most = Infinity;
    layout.value.antenna.forEach((a, k) => {
      const d = Math.hypot(a.position_m[0] - p[0], a.position_m[1] - p[1]) - (Number(a.diameter_m) || 0) / 2;
      if (d < within && d < most) {
        most = d;
        best = k;
      }
    });
    return best;
  };

  const draw = () => {
    const canvas = ref.current;
    if (!canvas) return;
    const ratio = devicePixelRatio;
    const [w, h] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== w || canvas.height !== h) {
      canvas.width = w;
      canvas.height = h;
    }
    const g = canvas.getContext('2d')!;
    const { x, y, half } = view.value;
    const scale = Math.min(w, h) / (2 * half);
    const px = (mx: number) => w / 2 + (mx - x) * scale;
    const py = (my: number) => h / 2 - (my - y) * scale;
    const [ink, soft, line, accent, warn] = ['--ink', '--soft', '--line', '--accent', '--second'].map(css);
    g.fillStyle = css('--map');
    g.fillRect(0, 0, w, h);
    if (isSite.value) drawGround(g, layout.value, { x, y, half }, { w, h, scale });
    // The grid to which places are rounded, where it is wide enough to be seen.
    if (snap.value * scale > 6 * ratio) {
      g.fillStyle = line;
      const step = snap.value;
      for (let gx = Math.ceil((x - w / 2 / scale) / step) * step; px(gx) < w; gx += step)
        for (let gy = Math.ceil((y - h / 2 / scale) / step) * step; py(gy) > 0; gy += step) g.fillRect(px(gx) - 1, py(gy) - 1, 2, 2);
    }
    // Axes through the origin, and the aperture.
    g.strokeStyle = line;
    g.lineWidth = ratio;
    g.beginPath();
    g.moveTo(px(0), 0);
    g.lineTo(px(0), h);
    g.moveTo(0, py(0));
    g.lineTo(w, py(0));
    g.stroke();
    const designed = layout.value.aperture_m;
    const circle = typeof designed === 'number' ? { x: 0, y: 0, r: designed / 2 } : reach.value;
    g.strokeStyle = soft;
    g.setLineDash([5 * ratio, 4 * ratio]);
    g.beginPath();
    g.arc(px(circle.x), py(circle.y), circle.r * scale, 0, 2 * Math.PI);
    g.stroke();
    g.setLineDash([]);
    // Zones in which no antenna may stand, hatched.
    const trace = (zone: [number, number][]) => {
      g.beginPath();
      zone.forEach(([zx, zy], k) => (k ? g.lineTo(px(zx), py(zy)) : g.moveTo(px(zx), py(zy))));
    };
    for (const zone of zones.value) {
      trace(zone);
      g.closePath();
      g.save();
      g.clip();
      g.strokeStyle = warn;
      g.globalAlpha = 0.5;
      g.beginPath();
      for (let k = -h; k < w; k += 8 * ratio) {
        g.moveTo(k, 0);
        g.lineTo(k + h, h);
      }
      g.stroke();
      g.restore();
      trace(zone);
      g.closePath();
      g.strokeStyle = warn;
      g.stroke();
    }
    if (corners.current.length) {
      trace(corners.current);
      g.strokeStyle = warn;
      g.stroke();
      g.fillStyle = warn;
      for (const [cx, cy] of corners.current) g.fillRect(px(cx) - 3 * ratio, py(cy) - 3 * ratio, 6 * ratio, 6 * ratio);
    }
    // Antennas.
    const all = layout.value.antenna;
    const chosen = selected.value;
    const small = (all.length > 500 ? 2 : all.length > 150 ? 3 : 4) * ratio;
    for (let k = 0; k < all.length; k++) {
      const a = all[k];
      const r = Math.max(small, (Number(a.diameter_m) || 0) * 0.5 * scale);
      g.beginPath();
      g.arc(px(a.position_m[0]), py(a.position_m[1]), r, 0, 2 * Math.PI);
      g.fillStyle = chosen.has(k) ? warn : accent;
      g.globalAlpha = r > 12 * ratio ? 0.5 : 1;
      g.fill();
      g.globalAlpha = 1;
      if (chosen.has(k)) {
        g.strokeStyle = ink;
        g.lineWidth = 1.5 * ratio;
        g.stroke();
      }
      if (chosen.has(k) && chosen.size <= 12) {
        g.fillStyle = ink;
        g.font = `${11 * ratio}px system-ui`;
        g.fillText(a.name, px(a.position_m[0]) + r + 3 * ratio, py(a.position_m[1]) - r);
      }
    }
    const d = drag.current;
    if (d?.kind === 'lasso' && d.points.length > 1) {
      g.beginPath();
      d.points.forEach(([lx, ly], k) => (k ? g.lineTo(px(lx), py(ly)) : g.moveTo(px(lx), py(ly))));
      g.closePath();
      g.strokeStyle = ink;
      g.lineWidth = ratio;
      g.setLineDash([3 * ratio, 3 * ratio]);
      g.stroke();
      g.setLineDash([]);
    }
    // A bar of a round length.
    const wanted = (w / 4 / scale) || 1;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const length = [5, 2, 1].map((m) => m * power).find((v) => v <= wanted) ?? power;
    g.fillStyle = g.strokeStyle = soft;
    g.lineWidth = 2 * ratio;
    g.beginPath();
    g.moveTo(10 * ratio, h - 10 * ratio);
    g.lineTo(10 * ratio + length * scale, h - 10 * ratio);
    g.stroke();
    g.font = `${11 * ratio}px system-ui`;
    g.fillText(metres(length), 10 * ratio, h - 15 * ratio);
    const names = isSite.value ? ['east', 'north'] : ['x', 'y'];
    g.fillText(names[0], w - g.measureText(names[0]).width - 5 * ratio, Math.min(h - 5 * ratio, Math.max(14 * ratio, py(0) - 4 * ratio)));
    g.fillText(names[1], Math.min(w - 40 * ratio, Math.max(4 * ratio, px(0) + 4 * ratio)), 13 * ratio);
  };
  useSignalEffect(draw);
  // A layout that came from elsewhere, or one that has left the window by far, is shown whole.
  useSignalEffect(() => {
    const { r, x, y } = reach.value;
    if (moving.peek()) return;
    const v = view.peek();
    const off = Math.max(Math.abs(x - v.x), Math.abs(y - v.y)) + r > 3 * v.half || r < 0.15 * v.half;
    if (off) fitView();
  });
  useSignalEffect(() => {
    arrivals.value;
    fitView();
  });
  useEffect(() => {
    const seen = new ResizeObserver(draw);
    seen.observe(ref.current!);
    const theme = matchMedia('(prefers-color-scheme: dark)');
    theme.addEventListener('change', draw);
    addEventListener('cittert-theme', draw);
    return () => {
      seen.disconnect();
      theme.removeEventListener('change', draw);
      removeEventListener('cittert-theme', draw);
    };
  }, []);

  const down = (e: PointerEvent) => {
    const p = place(e);
    ref.current!.setPointerCapture(e.pointerId);
    if (e.button === 1 || e.button === 2 || (e.button === 0 && e.altKey)) {
      drag.current = { kind: 'pan', view: view.value, px: e.clientX, py: e.clientY };
      e.preventDefault();
      return;
    }
    if (tool.value === 'zone') {
      const first = corners.current[0];
      const close = first && corners.current.length > 2 && Math.hypot(first[0] - p[0], first[1] - p[1]) < (14 * view.value.half) / size();
      if (close) {
        zones.value = [...zones.value, corners.current];
        corners.current = [];
      } else {
        corners.current = [...corners.current, [rounded(p[0]), rounded(p[1])]];
      }
      draw();
      again((k) => k + 1);
      return;
    }
    const hit = nearest(p, e.pointerType === 'touch' ? 22 : 9);
    if (tool.value === 'add' && hit < 0) {
      add(p[0], p[1]);
      return;
    }
    if (hit >= 0) {
      let which = selected.value;
      if (e.shiftKey) {
        which = new Set(which);
        if (which.has(hit)) which.delete(hit);
        else which.add(hit);
      } else if (!which.has(hit)) which = new Set([hit]);
      selected.value = which;
      drag.current = { kind: 'antennas', from: layout.value, which, x: p[0], y: p[1], moved: false };
      return;
    }
    drag.current = { kind: 'lasso', points: [p], add: e.shiftKey };
  };
  const move = (e: PointerEvent) => {
    const p = place(e);
    const d = drag.current;
    if (!d) {
      const hit = nearest(p, 9);
      const a = layout.value.antenna[hit];
      setTold(a ? `${a.name}: ${a.position_m.map(metres).join(', ')}` : `${metres(p[0])}, ${metres(p[1])}`);
      return;
    }
    if (d.kind === 'pan') {
      const scale = (2 * d.view.half) / size();
      view.value = { ...d.view, x: d.view.x - (e.clientX - d.px) * scale, y: d.view.y + (e.clientY - d.py) * scale };
    } else if (d.kind === 'lasso') {
      d.points.push(p);
      draw();
    } else {
      if (!d.moved) remember(d.from);
      d.moved = true;
      clearTimeout(rest.current);
      rest.current = window.setTimeout(() => (moving.value = false), REST_MS);
      batch(() => {
        moving.value = true;
        layout.value = moved(d.from, d.which, p[0] - d.x, p[1] - d.y);
      });
      const a = layout.value.antenna[[...d.which][0]];
      if (a) setTold(`${a.name}: ${a.position_m.map(metres).join(', ')}`);
    }
  };
  const up = () => {
    const d = drag.current;
    drag.current = null;
    if (d?.kind === 'lasso') {
      const found = new Set(d.add ? selected.value : []);
      if (d.points.length > 3) layout.value.antenna.forEach((a, k) => inside([a.position_m[0], a.position_m[1]], d.points) && found.add(k));
      selected.value = found;
      draw();
    }
    clearTimeout(rest.current);
    // A hand that goes on at once is not kept waiting for what is slow.
    if (d?.kind === 'antennas' && d.moved) rest.current = window.setTimeout(() => (moving.value = false), REST_MS / 2);
  };
  const wheel = (e: WheelEvent) => {
    e.preventDefault();
    const [px, py] = place(e);
    const v = view.value;
    const f = Math.exp(Math.max(-1, Math.min(1, e.deltaY / 400)));
    view.value = { x: px + (v.x - px) * f, y: py + (v.y - py) * f, half: v.half * f };
  };
  useEffect(() => {
    ref.current!.addEventListener('wheel', wheel, { passive: false });
  }, []);

  const count = layout.value.antenna.length;
  return (
    <section class="editor" aria-label="Layout editor">
      <div class="tools" role="toolbar" aria-label="Tools of the layout editor">
        {(
          [
            ['move', 'Move', 'Drag antennas; drag over empty ground to select with a lasso; shift adds to the selection'],
            ['add', 'Add', 'Click on the ground to add an antenna'],
            ['zone', 'Keep out', 'Click the corners of a zone in which no antenna may stand; click the first corner again to close it'],
          ] as const
        ).map(([name, text, about]) => (
          <button
            key={name}
            type="button"
            aria-pressed={tool.value === name}
            title={about}
            onClick={() => {
              tool.value = name;
              corners.current = [];
              draw();
            }}
          >
            {text}
          </button>
        ))}
        <button type="button" onClick={deleteSelected} disabled={!selected.value.size} title="Delete the selected antennas (Delete)">
          Delete
        </button>
        <button type="button" onClick={fitView} title="Show the whole layout (0)">
          Fit
        </button>
        {zones.value.length > 0 && (
          <button type="button" onClick={() => (zones.value = zones.value.slice(0, -1))} title="Remove the last zone">
            Remove zone
          </button>
        )}
        <label class="snap" title="Round places to multiples of this length; 0 does not round">
          Snap
          <input type="number" min="0" step="any" value={snap.value} onChange={(e) => (snap.value = Math.max(0, Number(e.currentTarget.value) || 0))} />m
        </label>
      </div>
      <div class="ground">
        <canvas
          ref={ref}
          tabIndex={0}
          role="application"
          aria-label={`Layout of ${count} antennas, ${selected.value.size} selected. N and P go through the antennas, arrows move the selected ones, A adds one, Delete deletes, Control A selects all, plus and minus zoom.`}
          onPointerDown={down}
          onPointerMove={move}
          onPointerUp={up}
          onPointerCancel={up}
          onPointerLeave={() => !drag.current && setTold('')}
          onContextMenu={(e) => e.preventDefault()}
          onKeyDown={(e) => key(e) && e.preventDefault()}
        />
      </div>
      <p class="told" aria-live="polite">
        {told || `${count} antennas${selected.value.size ? `, ${selected.value.size} selected` : ''}; ${tool.value === 'zone' && corners.current.length ? 'click the first corner to close the zone' : 'wheel zooms, right button pans'}`}
      </p>
    </section>
  );
}

const MOST_ROWS = 200;

/** The places of the selected antennas, or of all, as numbers. */
export function Places() {
  const l = layout.value;
  const which = selected.value.size ? [...selected.value].sort((a, b) => a - b) : [...l.antenna.keys()];
  const change = (k: number, part: Partial<Antenna>) => {
    const antenna = l.antenna.map((a, i) => {
      if (i !== k) return a;
      const next = { ...a, ...part };
      if (next.diameter_m === undefined) delete next.diameter_m;
      return next;
    });
    setLayoutKeeping({ ...l, antenna });
  };
  const number = (text: string, then: (v: number) => void) => {
    const v = Number(text);
    if (text.trim() !== '' && Number.isFinite(v)) then(v);
  };
  const axes = isSite.value ? ['east', 'north', 'up'] : ['x', 'y', 'z'];
  return (
    <div class="scroll places">
      <table aria-label="Places of the antennas">
        <thead>
          <tr>
            <th scope="col">name</th>
            {axes.map((a) => (
              <th scope="col" key={a}>
                {a}, m
              </th>
            ))}
            <th scope="col">Ø, m</th>
          </tr>
        </thead>
        <tbody>
          {which.slice(0, MOST_ROWS).map((k) => {
            const a = l.antenna[k];
            if (!a) return null;
            return (
              <tr key={k} class={selected.value.has(k) ? 'chosen' : ''}>
                <td>
                  <input aria-label="name" type="text" value={a.name} onChange={(e) => e.currentTarget.value && change(k, { name: e.currentTarget.value })} />
                </td>
                {a.position_m.map((v, c) => (
                  <td key={c}>
                    <input
                      aria-label={`${axes[c]} of ${a.name}`}
                      type="number"
                      step="any"
                      value={v}
                      onChange={(e) =>
                        number(e.currentTarget.value, (x) => {
                          const position_m = [...a.position_m] as Antenna['position_m'];
                          position_m[c] = x;
                          change(k, { position_m });
                        })
                      }
                    />
                  </td>
                ))}
                <td>
                  <input
                    aria-label={`diameter of ${a.name}`}
                    type="number"
                    min="0"
                    step="any"
                    value={a.diameter_m === undefined ? '' : short(Number(a.diameter_m))}
                    onChange={(e) => change(k, { diameter_m: Number(e.currentTarget.value) > 0 ? Number(e.currentTarget.value) : undefined })}
                  />
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
      {which.length > MOST_ROWS && <p class="about">The first {MOST_ROWS} of {which.length}: select some with the lasso to see the others.</p>}
    </div>
  );
}
