// SPDX-License-Identifier: BSD-3-Clause
// Validates a glTF file: check_gltf.mjs MODULES FILE, with the folder of the npm packages. The exit
// code is 1 if there is an error or a warning.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';

const [modules, file] = process.argv.slice(2);
const validator = createRequire(modules + '/')('gltf-validator');
const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(file)));
for (const issue of issues.messages) console.log(`${issue.code} ${issue.pointer}: ${issue.message}`);
process.exit(issues.numErrors + issues.numWarnings > 0 ? 1 : 0);
