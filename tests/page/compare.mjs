// Compares pictures of the page with those in references/. What is compared are means of squares of pixels, which the
// smoothing of edges and letters hardly changes, whatever else the machine does.
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import pixelmatch from 'pixelmatch';
import { PNG } from 'pngjs';
import { until } from './bench.mjs';

const references = join(import.meta.dirname, 'references');
const taking = process.env.CREASED_TAKE_REFERENCES === 'yes';
const kSquare = 4;
// How far a colour may be off, from 0 to 1, and the share of squares that may be further off.
const kColour = 0.05, kShare = 0.001;
// One font wherever the tests run, and nothing that tells one run from another.
const kStyle = `:root { font-family: 'DejaVu Sans' } .recent { display: none } .figures tbody:last-child tr:last-child td { visibility: hidden }`;

/** A picture at a quarter of its width and height. */
export function reduced({ width, height, data }) {
  const small = new PNG({ width: Math.floor(width / kSquare), height: Math.floor(height / kSquare) });
  for (let y = 0; y < small.height; ++y) {
    for (let x = 0; x < small.width; ++x) {
      for (let channel = 0; channel < 4; ++channel) {
        let sum = 0;
        for (let j = 0; j < kSquare; ++j) {
          for (let i = 0; i < kSquare; ++i) sum += data[4 * ((kSquare * y + j) * width + kSquare * x + i) + channel];
        }
        small.data[4 * (y * small.width + x) + channel] = Math.round(sum / kSquare ** 2);
      }
    }
  }
  return small;
}

/** The page, once two pictures in a row are the same. */
async function settled(page) {
  // The policy of the page forbids elements of style, not sheets that a script makes.
  await page.evaluate((text) => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(text);
    document.adoptedStyleSheets = [sheet];
  }, kStyle);
  let last;
  return until('the page comes to rest', async () => {
    const picture = await page.screenshot();
    const rests = last?.equals(picture);
    last = picture;
    return rests && picture;
  });
}

/** Whether a picture is like another of a quarter of its size, the share of squares that are not, and where these are. */
export function compare(whole, reference) {
  const picture = reduced(whole), { width, height } = reference;
  if (picture.width !== width || picture.height !== height) return { alike: false, share: 1, where: picture };
  const where = new PNG({ width, height });
  const count = pixelmatch(picture.data, reference.data, where.data, width, height, { threshold: kColour, includeAA: true });
  const share = count / (width * height);
  return { alike: share <= kShare, share, where };
}

/** Keeps a picture of the page in `folder`, and throws where it differs from its reference. */
export async function lookAt(page, folder, name) {
  const bytes = await settled(page);
  await page.evaluate(() => { document.adoptedStyleSheets = []; });
  writeFileSync(join(folder, `${name}.png`), bytes);
  const picture = PNG.sync.read(bytes), file = join(references, `${name}.png`);
  if (taking) {
    mkdirSync(references, { recursive: true });
    writeFileSync(file, PNG.sync.write(reduced(picture)));
    return;
  }
  if (!existsSync(file)) throw new Error(`${file} is missing; tests/run.sh references takes it`);
  const { alike, share, where } = compare(picture, PNG.sync.read(readFileSync(file)));
  if (alike) return;
  const shown = join(folder, `${name}-difference.png`);
  writeFileSync(shown, PNG.sync.write(where));
  throw new Error(`${(100 * share).toFixed(2)} % of ${name}.png is not as in ${file}: see ${shown}. If it should be so, look at the picture and run tests/run.sh references`);
}
