// The same on the command line.

import { Group } from './fields';
import { commands, download, hello } from './server';
import { scene, strokes } from './state';
import { painting } from './scenes';

export function copy(text: string, button: HTMLButtonElement) {
  void navigator.clipboard.writeText(text).then(() => {
    const was = button.textContent;
    button.textContent = 'Copied';
    setTimeout(() => (button.textContent = was), 1200);
  });
}

export function CommandsPanel() {
  const c = commands.value;
  if (!c) return <p class="about">The commands follow once the hand rests.</p>;
  const all = c.steps.map((s) => s.line).join('\n');
  return (
    <>
      <Group title="The same on the command line">
        <p class="about">Save the layout beside them, and these commands make what this page shows.</p>
        <div class="buttons">
          <button type="button" onClick={() => download('layout.toml', c.layout)}>
            Save layout.toml
          </button>
          <button type="button" onClick={() => download('design.sh', c.script)} title="A script that writes the files and makes all images in an empty folder">
            Save as a script
          </button>
          <button type="button" onClick={(e) => copy(all, e.currentTarget)}>
            Copy all
          </button>
        </div>
        {c.needs.map((n) => (
          <p class="about" key={n.name}>
            {n.text !== null ? (
              <button type="button" onClick={() => download(n.name, n.text!)}>
                Save {n.name}
              </button>
            ) : strokes.value.length && n.name === scene.value.file ? (
              <button type="button" onClick={() => void painting().then((bytes) => download(n.name, bytes))}>
                Save {n.name}
              </button>
            ) : (
              `${n.name} is the file that you gave to this page.`
            )}
          </p>
        ))}
        <ol class="commands">
          {c.steps.map((s) => (
            <li key={s.line}>
              <b>{s.what}</b>
              <pre data-output={s.output || 'figures'}>{s.line}</pre>
            </li>
          ))}
        </ol>
      </Group>
      <Group title="As one run">
        <div class="buttons">
          <button type="button" onClick={() => download('run.toml', c.run)}>
            Save run.toml
          </button>
          <button type="button" onClick={(e) => copy(c.run, e.currentTarget)}>
            Copy
          </button>
        </div>
        <pre class="run">{c.run}</pre>
        <p class="about">
          Then <code>cittert run run.toml -o out</code> writes the images and a report.
        </p>
      </Group>
      <p class="about">
        cittert {hello.value?.version}. <a href="licences.txt">Licences of this page</a>
      </p>
    </>
  );
}
