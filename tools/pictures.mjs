// Pictures of the viewer in use, by a browser without a window:
//   node pictures.mjs NPM ADDRESS VIEW LABEL FOLDER
// NPM is a folder with puppeteer-core. Shows VIEW, selects LABEL and writes viewer.jpg, the whole page, into FOLDER.
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
await settle();
await page.evaluate(`labelgs.views.snapped(labelgs.rig.views.findIndex(({ name }) => name.startsWith(${JSON.stringify(view)})))`);
await settle();
await page.evaluate(`labelgs.labels.select([${Number(label)}])`);
await settle();
await page.screenshot({ path: join(folder, 'viewer.jpg'), quality: 88 });
await browser.close();
