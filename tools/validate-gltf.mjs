// Runs the Khronos glTF validator on files: node validate-gltf.mjs FILE...
// Prints one line per file and every error and warning; exit code 1 if any file has an error.
import { readFile } from 'node:fs/promises';
import { dirname, resolve } from 'node:path';
import { validateBytes } from 'gltf-validator';

const files = process.argv.slice(2);
if (files.length === 0) {
  console.error('usage: node validate-gltf.mjs FILE...');
  process.exit(2);
}
let failed = false;
for (const file of files) {
  try {
    const { issues } = await validateBytes(new Uint8Array(await readFile(file)), {
      uri: file,
      maxIssues: 100,
      externalResourceFunction: async (uri) =>
        new Uint8Array(await readFile(resolve(dirname(file), decodeURIComponent(uri)))),
    });
    failed ||= issues.numErrors > 0;
    console.log(`${file}: ${issues.numErrors} errors, ${issues.numWarnings} warnings, ${issues.numInfos} infos`);
    for (const { severity, code, message, pointer } of issues.messages) {
      if (severity < 2) console.log(`  ${severity === 0 ? 'error' : 'warning'} ${code} at ${pointer}: ${message}`);
    }
  } catch (error) {
    failed = true;
    console.log(`${file}: ${error}`);
  }
}
process.exit(failed ? 1 : 0);
