// Pictures of the viewer in use, by a browser without a window:
//   node pictures.mjs NPM ADDRESS VIEW LABEL FOLDER
// NPM is a folder with puppeteer-core. Shows VIEW, selects LABEL, removes it with and without filling, and writes viewer.jpg (the
// whole page), selected.jpg, removed.jpg and filled.jpg (the stage) into FOLDER.
import { createRequire } from 'module';
import { join, resolve } from 'path';

const [npm, address, view, label, folder] = process.argv.slice(2);
const puppeteer = createRequire(join(resolve(npm), 'node_modules/'))('puppeteer-core');
const TIMEOUT_MS = 600_000;
const browser = await puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox'],
    protocolTimeout: TIMEOUT_MS,
});
const page = await browser.newPage();
await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: 'dark' }]);
await page.setViewport({ width: 1440, height: 810 });
page.on('pageerror', (error) => {
    console.error(error.message);
    process.exitCode = 1;
});
await page.goto(address);

const until = (condition) => page.waitForFunction(condition, { timeout: TIMEOUT_MS });
/** Waits for a still picture of what was asked last. */
const settle = async () => {
    await new Promise((done) => setTimeout(done, 1500));
    await until('window.labelgs?.stage.frame && labelgs.stage.asked === null && labelgs.stage.isStill && !labelgs.stage.isDirty');
};
const shoot = async (name, clip) => page.screenshot({ path: join(folder, `${name}.jpg`), quality: 88, clip });
const box = async () => page.evaluate(`(({ x, y, width, height }) => ({ x, y, width, height }))(labelgs.stage.box.getBoundingClientRect())`);
const changes = (count) => until(`labelgs.edits.state.changes.length === ${count}`);

await settle();
await page.evaluate(`labelgs.views.snapped(labelgs.rig.views.findIndex(({ name }) => name.startsWith(${JSON.stringify(view)})))`);
await settle();
await page.evaluate(`labelgs.labels.select([${Number(label)}])`);
await settle();
await shoot('viewer');
await shoot('selected', await box());
await page.click('#act-remove');
await changes(1);
await settle();
await shoot('removed', await box());
await page.evaluate(`document.querySelector('#edit-undo').click()`);
await changes(0);
await page.evaluate(`labelgs.labels.select([${Number(label)}])`);
await page.click('#act-fill');
await changes(1);
await settle();
await shoot('filled', await box());
await browser.close();
