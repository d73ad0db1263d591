// Chromium by playwright-core, Firefox by puppeteer-core, WebKit by WebKitWebDriver: all with the same few functions.
//
// launch(engine, {library, executable}) → {open(file, hash, isPhone), close()}; open → a page: {words, run(code),
// press(key), click(selector), shot(path), close()}. words: console messages, and requests beyond the file.
import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { createServer } from "node:net";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const SIZE = { width: 1100, height: 700 };
export const CHROMIUM_ARGS = [
  "--no-sandbox",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--no-first-run",
];
const FIREFOX_PREFERENCES = {
  "webgl.force-enabled": true,
  "ui.prefersReducedMotion": 1, // pages begin paused
};
// Codes of keys in WebDriver
const CODES = {
  ArrowLeft: "\uE012", ArrowRight: "\uE014", Home: "\uE011", End: "\uE010", PageUp: "\uE00E", PageDown: "\uE00F",
  Escape: "\uE00C", Shift: "\uE008",
};
const DRIVER_START_MS = 20000;

export function launch(engine, found) {
  return { chromium: launchChromium, firefox: launchFirefox, webkit: launchWebkit }[engine](found);
}

async function launchChromium({ library, executable }) {
  const { chromium, devices } = (await import(pathToFileURL(join(library, "index.js")))).default;
  const browser = await chromium.launch({ executablePath: executable, args: CHROMIUM_ARGS });
  return {
    async open(file, hash, isPhone) {
      const device = isPhone ? { ...devices["Pixel 7"], reducedMotion: "reduce" } : { viewport: SIZE };
      const context = await browser.newContext({ ...device, offline: true });
      const page = await context.newPage();
      const words = listen(page, file, (request) => request.url());
      await page.goto(pathToFileURL(file).href + hash);
      return {
        words,
        run: (code) => page.evaluate(code),
        press: (key) => page.keyboard.press(key),
        click: (selector) => page.locator(selector).first()[isPhone ? "tap" : "click"](),
        shot: (path) => page.screenshot({ path }),
        close: () => context.close(),
      };
    },
    close: () => browser.close(),
  };
}

async function launchFirefox({ library, executable }) {
  const puppeteer = createRequire(join(library, "package.json"))(library);
  const browser = await puppeteer.launch({
    browser: "firefox",
    executablePath: executable,
    headless: true,
    defaultViewport: null,
    args: [`--width=${SIZE.width}`, `--height=${SIZE.height}`],
    extraPrefsFirefox: FIREFOX_PREFERENCES,
  });
  return {
    async open(file, hash) {
      const page = await browser.newPage();
      const words = listen(page, file, (request) => request.url());
      await page.goto(pathToFileURL(file).href + hash);
      return {
        words,
        run: (code) => page.evaluate(code),
        async press(key) {
          const [last, ...held] = key.split("+").filter(Boolean).reverse();
          for (const each of held) await page.keyboard.down(each);
          await page.keyboard.press(last ?? "+");
          for (const each of held) await page.keyboard.up(each);
        },
        click: async (selector) => (await page.$(selector)).click(),
        shot: (path) => page.screenshot({ path }),
        close: () => page.close(),
      };
    },
    close: () => browser.close(),
  };
}

/** Messages and requests of a page of playwright or puppeteer, whose events have the same names. */
function listen(page, file, addressOf) {
  const words = [];
  page.on("console", (message) => words.push(`${message.type()}: ${message.text()}`));
  page.on("pageerror", (error) => words.push(`error: ${error.stack ?? error}`));
  page.on("request", (request) => {
    const url = addressOf(request);
    if (!/^(data|blob|about):/.test(url) && !url.startsWith(pathToFileURL(file).href)) words.push(`request: ${url}`);
  });
  return words;
}

async function launchWebkit({ library, executable }) {
  const port = await freePort();
  const env = { ...process.env, WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS: "1" }; // root has no sandbox
  const driver = spawn(library, [`--port=${port}`], { stdio: "ignore", env });
  process.on("exit", () => driver.kill());
  const call = async (method, path, body) => {
    const answer = await fetch(`http://127.0.0.1:${port}${path}`, { method, body: body && JSON.stringify(body) });
    const { value } = await answer.json();
    if (value?.error) throw new Error(`${path}: ${value.error}: ${value.message}`);
    return value;
  };
  const options = { binary: executable, args: ["--automation"] };
  const capabilities = { alwaysMatch: { browserName: "MiniBrowser", "webkitgtk:browserOptions": options } };
  await answers(() => call("GET", "/status"));
  const { sessionId } = await call("POST", "/session", { capabilities });
  const at = `/session/${sessionId}`;
  const run = (code) => call("POST", `${at}/execute/sync`, { script: `return (${code});`, args: [] });
  await call("POST", `${at}/window/rect`, SIZE);
  return {
    async open(file, hash) {
      await call("POST", `${at}/url`, { url: "about:blank" });
      await call("POST", `${at}/url`, { url: pathToFileURL(file).href + hash });
      const words = []; // WebDriver gives no console; the page's own errors are in its state
      return {
        words,
        run: (code) => run(code),
        async press(key) {
          const keys = key === "+" ? ["+"] : key.split("+");
          const codes = keys.map((each) => CODES[each] ?? each);
          const actions = [
            ...codes.map((value) => ({ type: "keyDown", value })),
            ...codes.reverse().map((value) => ({ type: "keyUp", value })),
          ];
          await call("POST", `${at}/actions`, { actions: [{ type: "key", id: "keys", actions }] });
        },
        async click(selector) {
          const element = await call("POST", `${at}/element`, { using: "css selector", value: selector });
          await call("POST", `${at}/element/${Object.values(element)[0]}/click`, {});
        },
        async shot(path) {
          writeFileSync(path, Buffer.from(await call("GET", `${at}/screenshot`), "base64"));
        },
        async close() {
          const asked = await run(`performance.getEntriesByType("resource").map((each) => each.name)`);
          words.push(...asked.filter((url) => !/^(data|blob):/.test(url)).map((url) => `request: ${url}`));
        },
      };
    },
    async close() {
      await call("DELETE", at).catch(() => null);
      driver.kill();
    },
  };
}

async function freePort() {
  const server = createServer();
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  const { port } = server.address();
  await new Promise((done) => server.close(done));
  return port;
}

async function answers(ask) {
  const end = Date.now() + DRIVER_START_MS;
  for (;;) {
    try {
      return await ask();
    } catch (error) {
      if (Date.now() > end) throw error;
      await new Promise((done) => setTimeout(done, 100));
    }
  }
}
