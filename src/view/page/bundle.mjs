// SPDX-License-Identifier: BSD-3-Clause
// Makes one HTML file of the page's sources and its npm packages.
// Usage: DYOP_PAGE_MODULES=node_modules node bundle.mjs OUT VERSION
import {createRequire} from 'node:module';
import fs from 'node:fs';
import path from 'node:path';

const here = import.meta.dirname;
const modules = path.resolve(process.env.DYOP_PAGE_MODULES);
const [out, version] = process.argv.slice(2);
const esbuild = createRequire(path.join(modules, 'x.js'))('esbuild');

const built = await esbuild.build({
  entryPoints: {script: path.join(here, 'main.js'), style: path.join(here, 'style.css')},
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2022',
  write: false,
  outdir: 'out',
  nodePaths: [modules],
  legalComments: 'inline',
  logLevel: 'warning',
});
const text = (name) => built.outputFiles.find((file) => file.path.endsWith(name)).text;
const fill = (page, place, content) => {
  if (!page.includes(place)) throw new Error(`index.html has no ${place}`);
  return page.replace(place, () => content);
};
let page = fs.readFileSync(path.join(here, 'index.html'), 'utf8');
page = fill(page, '/*style*/', text('style.css').replaceAll('</style', '<\\/style'));
page = fill(page, '/*script*/', text('script.js').replaceAll('</script', '<\\/script'));
page = fill(page, '%version%', version);
// The licence texts of the packages that are in the page, as their licences ask.
const notices = ['three', 'uplot'].map((name) => {
  const folder = path.join(modules, name);
  const packed = JSON.parse(fs.readFileSync(path.join(folder, 'package.json'), 'utf8'));
  return `${name} ${packed.version}\n\n${fs.readFileSync(path.join(folder, 'LICENSE'), 'utf8').trim()}\n`;
});
const escaped = (words) => words.replaceAll('&', '&amp;').replaceAll('<', '&lt;');
page = fill(page, '<!--notices-->', escaped(notices.join('\n\n')));
fs.mkdirSync(path.dirname(out), {recursive: true});
fs.writeFileSync(out, page);
