// Pictures of models in the viewers of other programs, in a browser:
//   node viewers.mjs FOLDER CAMERA VIEWER:FILE:DB:DB...
// All files are in FOLDER, which has npm/node_modules and gets the pictures as VIEWER-FILE.png. VIEWER is spark, playcanvas, or
// rendered, whose FILE is a picture. Prints the PSNR against the first file of the same viewer, and against the first of all; one
// below its DB is a failure.
import { createServer } from 'http';
import { readFile } from 'fs/promises';
import { createRequire } from 'module';
import { basename, dirname, join, normalize, resolve } from 'path';
import { fileURLToPath } from 'url';

const [given, camera, ...models] = process.argv.slice(2), folder = resolve(given);
const puppeteer = createRequire(join(folder, 'npm/'))('puppeteer-core');
const page = join(dirname(fileURLToPath(import.meta.url)), 'viewers.html');
const TYPES = { html: 'text/html', js: 'text/javascript', mjs: 'text/javascript', json: 'application/json', png: 'image/png', wasm: 'application/wasm' };
const server = createServer(async (request, answer) => {
    const path = normalize(new URL(request.url, 'http://localhost').pathname);
    try {
        const bytes = await readFile(path === '/' ? page : join(folder, path));
        const ending = path === '/' ? 'html' : path.split('.').pop();
        answer.writeHead(200, { 'content-type': TYPES[ending] ?? 'application/octet-stream', 'content-length': bytes.length });
        answer.end(bytes);
    } catch {
        answer.writeHead(404).end();
    }
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));
const browser = await puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
});
const tab = await browser.newPage(), complaints = [];
tab.on('pageerror', (error) => complaints.push(error.message));
tab.on('console', (message) => message.type() === 'error' && complaints.push(message.text()));
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
await tab.waitForFunction('window.ready');
let failed = 0;
for (const entry of models) {
    const [viewer, model, ...least] = entry.split(':');
    const name = `picture of ${basename(model)} in ${viewer === 'rendered' ? 'labelgs' : viewer}`.padEnd(44);
    try {
        const found = await tab.evaluate((...args) => window.compare(...args), viewer, `/${model}`, `/${camera}`);
        await (await tab.$('canvas')).screenshot({ path: join(folder, `${viewer}-${basename(model)}.png`) });
        const bad = found.some((value, at) => value < Number(least[at]));
        const [own, ours] = found.map((value) => value.toFixed(1));
        console.log(name, `${own} dB from the PLY there, ${ours} dB from labelgs; ${bad ? `FAILED, at least ${least}` : 'passed'}`);
        failed |= bad;
    } catch (error) {
        console.log(name, `FAILED: ${String(error?.message ?? error).split('\n')[0]}; ${complaints.join('; ')}`);
        failed = 1;
    }
}
await browser.close();
server.close();
process.exit(failed);
