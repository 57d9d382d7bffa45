// The page as a whole: a bar, the panel on the left, the editor, and the maps.

import { useEffect } from 'preact/hooks';
import { effect, signal } from '@preact/signals';
import { CompareMaps, ComparePanel, CompareTable, kept } from './compare';
import { CommandsPanel, copy } from './commands';
import { Editor, globalKey } from './editor';
import { ErrorsPanel } from './errors';
import { FiguresTable } from './figures';
import { LayoutPanel } from './layouts';
import { openLink, permalink } from './link';
import { Cut, ImageMap, UvMap, short } from './maps';
import { ObservePanel } from './observe';
import { OptimisePanel } from './optimise';
import { ScenePanel, dropped, restorePainting } from './scenes';
import { arrivals, busy, connected, hello, moving, pictures, problem, type Picture } from './server';
import { canRedo, canUndo, layout, method, redo, snapshot, undo } from './state';

const PANELS = [
  ['layout', 'Layout', LayoutPanel],
  ['observe', 'Observe', ObservePanel],
  ['scene', 'Scene', ScenePanel],
  ['errors', 'Errors', ErrorsPanel],
  ['optimise', 'Optimise', OptimisePanel],
  ['compare', 'Compare', ComparePanel],
  ['commands', 'Commands', CommandsPanel],
] as const;
export const panel = signal<string>('layout');

function Tabs() {
  const go = (e: KeyboardEvent) => {
    const step = e.key === 'ArrowRight' ? 1 : e.key === 'ArrowLeft' ? -1 : 0;
    if (!step) return;
    const k = PANELS.findIndex(([name]) => name === panel.value);
    panel.value = PANELS[(k + step + PANELS.length) % PANELS.length][0];
    document.getElementById(`tab-${panel.value}`)?.focus();
  };
  return (
    <div class="tabs" role="tablist" aria-label="Panels" onKeyDown={go}>
      {PANELS.map(([name, text]) => (
        <button
          key={name}
          id={`tab-${name}`}
          type="button"
          role="tab"
          aria-selected={panel.value === name}
          aria-controls="panel"
          tabIndex={panel.value === name ? 0 : -1}
          onClick={() => (panel.value = name)}
        >
          {text}
        </button>
      ))}
    </div>
  );
}

type Theme = 'system' | 'light' | 'dark';
const theme = signal<Theme>((localStorage.getItem('theme') as Theme) || 'system');
effect(() => {
  const root = document.documentElement;
  if (theme.value === 'system') root.removeAttribute('data-theme');
  else root.dataset.theme = theme.value;
  localStorage.setItem('theme', theme.value);
  dispatchEvent(new Event('cittert-theme'));
});

function Bar() {
  const state = connected.value !== 'open' ? 'The program does not answer; trying again …' : busy.value ? 'computing …' : 'up to date';
  return (
    <header>
      <h1>cittert design</h1>
      <span class="name">{layout.value.name}</span>
      <button type="button" onClick={undo} disabled={!canUndo.value} title="Undo (Control Z)">
        Undo
      </button>
      <button type="button" onClick={redo} disabled={!canRedo.value} title="Redo (Control Y)">
        Redo
      </button>
      <span class={`state ${connected.value === 'open' ? '' : 'lost'}`} role="status" data-state={connected.value !== 'open' ? 'lost' : busy.value ? 'busy' : 'idle'}>
        {state}
      </span>
      <button type="button" onClick={(e) => copy(location.href, e.currentTarget)} title="The address holds the whole state of the page">
        Copy link
      </button>
      <label>
        <span class="hidden">Colours of the page</span>
        <select value={theme.value} onChange={(e) => (theme.value = e.currentTarget.value as Theme)}>
          <option value="system">as the system</option>
          <option value="light">light</option>
          <option value="dark">dark</option>
        </select>
      </label>
    </header>
  );
}

function score(p: Picture | undefined): string {
  if (!p) return '';
  const s = p.scores as { nrmse: number; ssim: number } | null | undefined;
  const seconds = p.seconds as number | undefined;
  return [p.missed && 'not converged', s && `error ${short(100 * s.nrmse)} %`, s && `SSIM ${s.ssim.toFixed(2)}`, seconds !== undefined && `${seconds.toFixed(2)} s`].filter(Boolean).join(', ');
}

/** What to do about a picture that did not converge. */
function missed(p: Picture | undefined): string {
  return p?.missed ? 'It does not fit the data: calibrate the errors, or let the image cover the scene.' : '';
}

function Maps() {
  const p = pictures.value;
  const m = method.value;
  const beam = p.psf?.beam_rad as number[] | undefined;
  return (
    <main class={`maps ${m === 'both' ? 'four' : ''}`} aria-label="Maps">
      <UvMap />
      <ImageMap
        name="psf"
        title="Beam"
        about="Dirty beam in decibels"
        note={beam && `${short((beam[0] * 180) / Math.PI)}° × ${short((beam[1] * 180) / Math.PI)}°`}
      />
      <Cut />
      {p.truth && <ImageMap name="truth" title="Scene" about="The scene as it is" />}
      <ImageMap name="dirty" title={p.dirty?.calibrated ? 'Dirty, self-calibrated' : 'Dirty image'} />
      {(m === 'clean' || m === 'both') && <ImageMap name="clean" title="CLEAN" like="truth" note={score(p.clean)} />}
      {(m === 'mem' || m === 'both') && <ImageMap name="mem" title="Maximum entropy" like="truth" note={score(p.mem)} warning={missed(p.mem)} />}
    </main>
  );
}

/** The address follows the state once the hand rests. */
function useLink() {
  useEffect(() => {
    let timer = 0;
    let own = '';
    const stop = effect(() => {
      snapshot();
      kept.value;
      if (!hello.value || moving.value) return;
      clearTimeout(timer);
      timer = window.setTimeout(async () => {
        own = `#${await permalink()}`;
        history.replaceState(null, '', own);
      }, 300);
    });
    const changed = () => {
      if (location.hash !== own)
        void openLink().then(() => {
          arrivals.value++;
          restorePainting();
        });
    };
    addEventListener('hashchange', changed);
    return () => {
      stop();
      removeEventListener('hashchange', changed);
    };
  }, []);
}

export function App() {
  useLink();
  useEffect(() => {
    const over = (e: DragEvent) => e.preventDefault();
    const drop = (e: DragEvent) => void dropped(e);
    addEventListener('keydown', globalKey);
    addEventListener('dragover', over);
    addEventListener('drop', drop);
    return () => {
      removeEventListener('keydown', globalKey);
      removeEventListener('dragover', over);
      removeEventListener('drop', drop);
    };
  }, []);
  useEffect(() => {
    if (hello.value) restorePainting();
  }, [hello.value]);
  const Shown = PANELS.find(([name]) => name === panel.value)![2];
  return (
    <>
      <Bar />
      {problem.value && (
        <p class="problem" role="alert">
          {problem.value}
          <button type="button" aria-label="Close the message" onClick={() => (problem.value = null)}>
            ×
          </button>
        </p>
      )}
      <div class="page">
        <aside>
          <Tabs />
          <div id="panel" class="panel" role="tabpanel" aria-labelledby={`tab-${panel.value}`}>
            <Shown />
          </div>
        </aside>
        <div class="middle">
          <Editor />
          {panel.value === 'compare' && kept.value ? <CompareTable /> : <FiguresTable />}
        </div>
        {panel.value === 'compare' && kept.value ? <CompareMaps /> : <Maps />}
      </div>
    </>
  );
}
