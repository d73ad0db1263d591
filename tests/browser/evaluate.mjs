// node evaluate.mjs TASK: opens pages in Chromium, at addresses one after the other, and evaluates code in each.
//
// TASK is JSON: {library, executable, visits: [{file, hash, codes}]}. Writes a JSON list on stdout,
// for each visit the values of its codes (null for none), and behind them its console messages, if any.
import { launch } from "./drivers.mjs";

const { library, executable, visits } = JSON.parse(process.argv[2]);
const READY = "document.documentElement.dataset.ready || document.documentElement.dataset.error || ''";
const browser = await launch("chromium", { library, executable });
const found = [];
for (const { file, hash, codes } of visits) {
  const page = await browser.open(file, hash);
  while (!(await page.run(READY))) await new Promise((done) => setTimeout(done, 20));
  const values = [];
  for (const code of codes) values.push((await page.run(code)) ?? null);
  found.push([...values, ...(page.words.length ? [page.words.join("\n")] : [])]);
  await page.close();
}
await browser.close();
process.stdout.write(JSON.stringify(found), () => process.exit(0));
