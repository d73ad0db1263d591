// node visit.mjs PLAYWRIGHT CHROMIUM [PAGE.html PAGE2.html …]: tries each page in Chromium, with keys, scrubber and touch.
//
// Writes a JSON list on stdout, for each page {file, ready_ms, words, faults, worst}: console messages and requests,
// checks that failed, and of two files [{clip, time, error}] at the times that the page names as the worst.
import { pathToFileURL } from "node:url";
import { basename, join } from "node:path";

const [playwright, executablePath, shots, ...files] = process.argv.slice(2);
const { chromium, devices } = (await import(pathToFileURL(join(playwright, "index.js")))).default;
const ARGS = [
  "--no-sandbox",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--no-first-run",
];
const READY_MS = 60000;
const PHONE = devices["Pixel 7"];
const browser = await chromium.launch({ executablePath, args: ARGS });

/** A page in a context without network. Words: everything it says or asks for. */
async function open(file, hash, device = { viewport: { width: 1100, height: 700 } }) {
  const context = await browser.newContext({ ...device, offline: true });
  const page = await context.newPage();
  const words = [];
  page.on("console", (message) => words.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => words.push(`error: ${error.stack}`));
  page.on("request", (request) => {
    const url = request.url();
    if (!/^(data|blob):/.test(url) && !url.startsWith(pathToFileURL(file).href)) words.push(`request: ${url}`);
  });
  const began = Date.now();
  await page.goto(pathToFileURL(file).href + hash);
  const isDone = () => document.documentElement.dataset.ready || document.documentElement.dataset.error;
  await page.waitForFunction(isDone, null, { timeout: READY_MS });
  return { page, words, ms: Date.now() - began, close: () => context.close() };
}

async function tryDesktop(file, faults) {
  const { page, words, ms, close } = await open(file, "#t=0&show=");
  const expect = (isTrue, fault) => isTrue || faults.push(fault);
  const get = (code) => page.evaluate(code);
  const time = () => get("player.state.time");
  const near = async (expected, what) => {
    const got = await time();
    expect(Math.abs(got - expected) < 2e-3, `${what}: ${got} instead of ${expected}`);
  };
  const press = async (key) => {
    await page.keyboard.press(key);
    await get("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))");
  };
  expect(!(await get("document.documentElement.dataset.error")), "does not load");
  const duration = await get("player.duration");
  const clips = await get("player.sides[0].clips.length");
  if (clips) {
    const at = (seconds) => Math.min(seconds, duration);
    await press("ArrowRight");
    await near(at(1 / 30), "ArrowRight");
    await press("Shift+ArrowRight");
    await near(at(at(1 / 30) + 1 / 3), "Shift+ArrowRight");
    await press("ArrowLeft");
    await press("Home");
    await near(0, "Home");
    const keys = await get("player.keys");
    await press(".");
    await near(keys.find((key) => key > 1e-5) ?? duration, "next key");
    await press(",");
    await press("End");
    await near(duration, "End");
    await press("Home");
    await press(" ");
    await page.waitForFunction(() => player.state.time > 0, null, { timeout: READY_MS });
    await press(" ");
    expect(!(await get("player.state.playing")), "pauses");
    await page.locator("#scrub input").fill("0.5");
    await near(duration / 2, "scrubber");
    const clip = await get("player.state.clip");
    await press("n");
    expect((await get("player.state.clip")) === (clip + 1) % clips, "next clip");
    await press("p");
    expect((await get("player.state.clip")) === clip, "clip before");
  }
  const shows = { s: "bones", w: "wire", o: "onion", c: "clay", g: "curves" };
  for (const [key, name] of Object.entries(shows)) {
    await press(key);
    expect(await get(`player.state.show.has("${name}")`), `${key} shows ${name}`);
    await press(key);
    expect(!(await get(`player.state.show.has("${name}")`)), `${key} hides ${name}`);
  }
  for (const [key, name, value] of [["l", "loop", "once"], ["u", "unit", "values"], ["-", "speed", 0.5], ["+", "speed", 1]]) {
    await press(key);
    expect((await get(`player.state.${name}`)) === value, `${key}: ${name}`);
  }
  await press("d");
  expect((await get("document.documentElement.dataset.theme")) === "dark", "dark");
  await press("f");
  await press("?");
  expect((await page.locator("dialog[open] kbd").count()) > 20, "sheet of keys");
  await press("Escape");
  const node = page.locator("[data-node]").first();
  if (await node.count()) {
    await node.click();
    expect((await get("player.state.node")) !== null, "chooses a node");
  }
  if (await get("player.sides.length > 1")) {
    await press("h");
    expect(await get(`player.state.show.has("heat")`), "heat");
    for (const side of ["a", "b", "both"]) {
      await press("b");
      expect((await get("player.state.side")) === side, `side ${side}`);
    }
  }
  const worst = await get(`(facts => player.sides.length < 2 ? [] : facts.panels.flatMap(panel => panel.rows)
    .filter(row => row.link).map(({link}) => {
      player.follow(link);
      return {clip: link.clip, time: link.time, error: player.worst().error};
    }))(JSON.parse(document.getElementById("facts").textContent))`);
  if (shots) await page.screenshot({ path: join(shots, basename(file).replace(/html$/, "png")) });
  await page.waitForFunction(() => location.hash.includes("theme=dark"), null, { timeout: READY_MS });
  await close();
  return { words, ready_ms: ms, worst };
}

async function tryPhone(file, faults) {
  const { page, words, close } = await open(file, "", PHONE);
  const expect = (isTrue, fault) => isTrue || faults.push(`phone: ${fault}`);
  const get = (code) => page.evaluate(code);
  await page.locator("#menu").tap();
  const clip = page.locator("[data-clip]").last();
  if (await clip.count()) {
    await clip.tap();
    expect((await get("player.state.clip")) === (await get("player.sides[0].clips.length")) - 1, "taps a clip");
    if (await get("player.state.playing")) await page.locator("#play").tap();
    expect(!(await get("player.state.playing")), "taps pause");
  } else await page.locator("#menu").tap();
  if (!(await get(`player.state.show.has("bones")`))) await page.locator("#show-bones").tap();
  expect(await get(`player.state.show.has("bones")`), "taps skeleton");
  await page.locator("#menu").tap();
  const small = await get(`[...document.querySelectorAll("button, select, summary, input")]
    .filter(each => each.checkVisibility() && each.getBoundingClientRect().height < 44)
    .map(each => each.id || each.textContent)`);
  expect(!small.length, `smaller than 44 px: ${small}`);
  expect(await get("document.documentElement.scrollWidth <= innerWidth"), "scrolls sideways");
  await close();
  return words;
}

const found = [];
for (const file of files) {
  const faults = [];
  try {
    const { words, ready_ms, worst } = await tryDesktop(file, faults);
    words.push(...(await tryPhone(file, faults)));
    found.push({ file, ready_ms, words, faults, worst });
  } catch (error) {
    found.push({ file, ready_ms: null, words: [], faults: [...faults, String(error)], worst: [] });
  }
}
await browser.close();
process.stdout.write(JSON.stringify(found));
