import { NodeIO } from '@gltf-transform/core';
import { readFileSync } from 'fs';
const [path, ply] = process.argv.slice(2);
const document = await new NodeIO().read(path);
const primitive = document.getRoot().listMeshes()[0].listPrimitives()[0];
const bytes = readFileSync(ply), end = bytes.indexOf('end_header\n') + 11;
const header = bytes.subarray(0, end).toString();
const count = Number(header.match(/element vertex (\d+)/)[1]);
const columns = [...header.matchAll(/property float (\S+)/g)].map((found) => found[1]);
const value = (row, name) => bytes.readFloatLE(end + 4 * (row * columns.length + columns.indexOf(name)));
const attribute = (name) => primitive.getAttribute(name) ?? (() => { throw new Error(`lacks ${name}`) })();
const place = attribute('POSITION'), opacity = attribute('KHR_gaussian_splatting:OPACITY'), feature = attribute('_FEATURE_ID_0');
let bad = place.getCount() === count && feature.getCount() === count ? 0 : 1;
const labels = [...new Set(Array.from({ length: count }, (_, row) => value(row, 'label')))].filter((id) => id).sort((a, b) => a - b);
for (let row = 0; row < count; row++) {
    const at = place.getElement(row, []);
    bad += at[0] !== -value(row, 'x') || at[1] !== -value(row, 'y') || at[2] !== value(row, 'z');
    bad += Math.abs(opacity.getScalar(row) - 1 / (1 + Math.exp(-value(row, 'opacity')))) > 1e-6;
    bad += (feature.getScalar(row) ? labels[feature.getScalar(row) - 1] : 0) !== value(row, 'label');
}
console.log(`glb, ours read by gltf-transform`.padEnd(44), String(count).padStart(6), `Gaussians, ${labels.length} labels; ${bad ? bad + ' differ' : 'passed'}`);
process.exit(bad ? 1 : 0);
