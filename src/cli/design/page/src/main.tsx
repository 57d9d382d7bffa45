// The page.

import './page.css';
import 'uplot/dist/uPlot.min.css';
import { render } from 'preact';
import { App } from './app';
import { connect } from './server';

render(<App />, document.getElementById('page')!);
connect();
