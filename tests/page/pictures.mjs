// Takes the pictures of README.md from the page: node pictures.mjs FOLDER, with CREASED_BIN.
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';
import { openBrowser, openPage, Service, until } from './bench.mjs';

const folder = process.argv[2] ?? 'client/web/pictures';
const bin = process.env.CREASED_BIN ?? 'build/release/bin';
mkdirSync(folder, { recursive: true });
const service = await new Service(bin).start();
const browser = await openBrowser();

/** Waits until two pictures in a row are the same, and keeps the last. */
async function take(page, name) {
  await page.mouse.move(1, 1);
  for (let last; ; ) {
    const picture = await page.screenshot({ path: join(folder, `${name}.png`) });
    if (last?.equals(picture)) return;
    last = picture;
  }
}
const done = (page) => page.locator('#result .figures').waitFor({ timeout: 300_000 });
const scrollTo = (page, selector) => page.locator(selector).evaluate((element) => element.scrollIntoView({ block: 'start' }));

async function ofPart() {
  const page = await openPage(browser, service.url);
  await page.getByRole('button', { name: /machined part/ }).click();
  await done(page);
  await take(page, 'result');
  await page.getByRole('button', { name: 'After', exact: true }).click();
  await page.locator('#parameters > summary').click();
  await page.getByLabel('Preset').selectOption('Bilateral filter');
  await page.getByRole('button', { name: 'Smooth again' }).click();
  await page.getByRole('columnheader', { name: 'right' }).waitFor({ timeout: 300_000 });
  await page.getByLabel('Colour by').selectOption('difference');
  await page.locator('.panel').evaluate((panel) => panel.scrollTo(0, 0));
  await take(page, 'compared');
  await page.context().close();
}

async function ofScan() {
  const page = await openPage(browser, service.url, { colorScheme: 'dark' });
  await page.getByRole('button', { name: /A scan/ }).click();
  const midway = () => page.evaluate(() => document.querySelectorAll('.curve').length >= 2 && document.querySelector('.run progress').value > 0.4);
  await until('half of the job', midway, 300);
  await page.screenshot({ path: join(folder, 'running.png') });
  await done(page);
  await page.getByRole('button', { name: 'After', exact: true }).click();
  await page.getByLabel('Colour by').selectOption('curvature');
  await scrollTo(page, '#look');
  await take(page, 'coloured');
  await page.context().close();
}

try {
  await ofPart();
  await ofScan();
} finally {
  await browser.close();
  await service.remove();
}
