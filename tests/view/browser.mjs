// SPDX-License-Identifier: BSD-3-Clause
// Headless Chromium for the checks of pages, where drawing without a graphics card costs most of the
// time: their windows are small, and edges are not smoothed unless asked for.
import {createRequire} from 'node:module';
import os from 'node:os';
import path from 'node:path';

export const kLongest = 180000;  // milliseconds, for one answer of a loaded machine

// An npm package of the page's.
export const require = createRequire(path.join(path.resolve(process.env.DYOP_PAGE_MODULES), 'x.js'));

export function launch(chromium, {smoothsEdges = false} = {}) {
  return require('puppeteer-core').launch({
    executablePath: chromium,
    timeout: kLongest,
    protocolTimeout: kLongest,
    args: [...(os.userInfo().uid === 0 ? ['--no-sandbox'] : []), '--enable-unsafe-swiftshader',
           '--force-device-scale-factor=1', '--hide-scrollbars',
           ...(smoothsEdges ? [] : ['--webgl-antialiasing-mode=none'])],
  });
}
