import { existsSync, mkdirSync } from "node:fs";
import assert from "node:assert/strict";
import { basename, join } from "node:path";
import { after } from "node:test";

import { kPatience_ms, program } from "./program.mjs";

/** CTest shows a test that ends so as skipped. */
const kSkipped = 77;
// The one without windows needs a third less of the processor.
const kPrograms = ["/usr/bin/chromium-headless-shell", "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(kSkipped);
}

const executable = process.env.CHROMIUM ?? kPrograms.find((path) => existsSync(path));
if (!executable) skip("no Chromium here (package chromium-headless-shell)");
if (!existsSync(program)) skip(`no program ${program}; SENTREE_PROGRAM names one`);
let chromium;
try {
  ({ chromium } = await import("playwright-core"));
} catch {
  skip("playwright-core is not installed (npm ci in web/)");
}

let launched = null;

/** One browser for all tests of a file. */
export async function browser() {
  launched ??= chromium.launch({
    executablePath: executable,
    args: ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--force-color-profile=srgb", "--font-render-hinting=none"],
  });
  return launched;
}
after(async () => {
  const started = await launched;
  for (const context of started?.contexts() ?? []) for (const page of context.pages()) await keep_picture(page);
  await started?.close();
});

const pictures = process.env.SENTREE_PICTURES;
let pictured = 0;

/** How the page looks where a case ends, in the folder SENTREE_PICTURES, if that is given. */
export async function keep_picture(page) {
  if (!pictures || page.isClosed()) return;
  mkdirSync(pictures, { recursive: true });
  pictured += 1;
  await page.screenshot({ path: join(pictures, `${basename(process.argv[1], ".mjs")}-${pictured}.png`) });
}

/** A line that says that the network is gone, which tests of lost connections expect. */
const kOfNetwork = /ERR_CONNECTION_REFUSED|WebSocket connection to|ERR_CONNECTION_RESET|net::ERR_/;

/**
 * The page in a browser context of its own. Whatever the page writes to the console as an error, and every exception,
 * is a failure: `errors()` has them, `close()` asserts that there are none.
 */
export async function open_page(url, { width = 1440, height = 900, theme = "light", lost_connections = false, motion = "reduce" } = {}) {
  const context = await (await browser()).newContext({ viewport: { width, height }, colorScheme: theme, reducedMotion: motion, deviceScaleFactor: 1 });
  const page = await context.newPage();
  page.setDefaultTimeout(kPatience_ms);
  const errors = [];
  page.on("console", (message) => {
    if (message.type() !== "error" && message.type() !== "warning") return;
    if (lost_connections && kOfNetwork.test(message.text())) return;
    errors.push(message.text());
  });
  page.on("pageerror", (error) => errors.push(String(error.stack ?? error)));
  await page.goto(url);
  await page.locator("#panel-timeline").waitFor();
  return {
    page,
    errors: () => errors,
    async close() {
      await keep_picture(page);
      await context.close();
      assert.deepEqual(errors, [], "the page wrote errors to the console");
    },
  };
}

/** Waits until `check` in Node returns true. */
export async function until(check, what) {
  const end = Date.now() + kPatience_ms;
  for (;;) {
    const value = await check();
    if (value) return value;
    if (Date.now() > end) throw new Error(`still not so: ${what}`);
    await new Promise((settle) => setTimeout(settle, 50));
  }
}

/** Sends one operation from inside the page, over a connection of its own; the value of the answer. */
export function operate(page, op, args = {}) {
  return page.evaluate(
    ([name, given]) =>
      new Promise((settle, fail) => {
        const socket = new WebSocket(`ws://${location.host}/api/ws`);
        // A program that begins again closes it, also before it has answered.
        socket.onerror = socket.onclose = () => fail(new Error("no connection"));
        socket.onopen = () => socket.send(JSON.stringify({ op: name, id: 1, ...given }));
        socket.onmessage = (event) => {
          const message = JSON.parse(event.data);
          if (message.type !== "answer") return;
          socket.close();
          if (message.ok) settle(message.value);
          else fail(new Error(message.error));
        };
      }),
    [op, args],
  );
}

/** The first message of type `type` that the program sends to a new page. */
export function first_message(page, type) {
  return page.evaluate(
    (wanted) =>
      new Promise((settle, fail) => {
        const socket = new WebSocket(`ws://${location.host}/api/ws`);
        // A program that begins again closes it, also before it has answered.
        socket.onerror = socket.onclose = () => fail(new Error("no connection"));
        socket.onmessage = (event) => {
          const message = JSON.parse(event.data);
          if (message.type !== wanted) return;
          socket.close();
          settle(message);
        };
      }),
    type,
  );
}

/** The state of the present. */
export const state_of = (page) => first_message(page, "state");

/** Opens a tab of the panel that steers. */
export const open_tab = (page, name) => page.getByRole("tab", { name, exact: false }).click();

/** Scale and offset of the map. */
export const view_of = async (page) => (await page.getByTestId("map").getAttribute("data-view")).split(" ").map(Number);

/** Where a point of the world is in the window. */
export async function place(page, [x, y]) {
  const box = await page.getByTestId("map").boundingBox();
  const [scale, dx, dy] = await view_of(page);
  return [box.x + scale * x + dx, box.y + dy - scale * y];
}

/** Interventions, as the program keeps them. */
export const interventions = async (page) =>
  (await operate(page, "messages", { limit: 500, filter: { name: "scenario.injection" } })).messages.map((message) => JSON.stringify(message));

export const text = async (page, id) => (await page.getByTestId(id).innerText()).replace(/\s+/g, " ");

/** By monitor: its verdict as the page says it, in words and in the shape's label. */
export async function verdicts(page) {
  const rows = await page.locator("[data-monitor]").evaluateAll((found) =>
    found.map((row) => [row.dataset.monitor, row.querySelector(".verdict-word")?.textContent, row.querySelector(".verdict-sign")?.getAttribute("aria-label")]),
  );
  for (const [name, word, sign] of rows) assert.equal(word, sign, `word and shape of ${name} differ`);
  return Object.fromEntries(rows.map(([name, word]) => [name, word]));
}

/** Run time in nanoseconds as the header shows it. */
export async function shown_time(page) {
  const parts = (await text(page, "clock")).split(":").map(Number);
  return Math.round(parts.reduce((sum, part) => sum * 60 + part, 0) * 1e3) * 1e6;
}

/**
 * What stands out of the box that it is drawn in, so that it cannot be seen or lies over the box's edge: at the right of
 * any box that cuts off, below those that do not scroll.
 */
export const sticks_out = (page) =>
  page.evaluate(() => {
    const kTolerance_px = 1.5;
    const named = (element) => `${element.tagName.toLowerCase()}.${element.getAttribute("class") ?? ""}`;
    const found = [];
    for (const element of document.querySelectorAll("body *")) {
      const { width, height, right, bottom } = element.getBoundingClientRect();
      // Editors see to their lines themselves, and pictures that do not fit are moved.
      if (!element.checkVisibility() || width === 0 || height === 0 || element.closest(".cm-editor, .picture:not(.chart-sketch)")) continue;
      const { position } = getComputedStyle(element);
      const is_box = (other) => other.tagName === "svg" || getComputedStyle(other).overflow !== "visible";
      let box = element.parentElement;
      while (box && !is_box(box)) box = box.parentElement;
      if (!box || position === "fixed") continue;
      const { overflowX, overflowY, paddingRight, textOverflow } = getComputedStyle(box);
      if (textOverflow === "ellipsis") continue;
      const scrolls = (overflow) => overflow === "auto" || overflow === "scroll";
      const edge = box.getBoundingClientRect();
      // What is placed by hand may lie over the padding.
      const inner = box.tagName === "svg" || position !== "static" ? edge.right : edge.left + box.clientLeft + box.clientWidth - parseFloat(paddingRight);
      const over = right - inner;
      const below = bottom - edge.bottom;
      const who = `${named(element)} “${(element.textContent ?? "").slice(0, 40)}” in ${named(box)}`;
      if (over > kTolerance_px && !(scrolls(overflowX) && !scrolls(overflowY))) found.push(`${who}: ${over.toFixed(0)} px at the right`);
      if (below > kTolerance_px && !scrolls(overflowY) && box.tagName !== "svg") found.push(`${who}: ${below.toFixed(0)} px below`);
    }
    return found;
  });
