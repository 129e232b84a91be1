import { cpSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

import { browser, keep_picture, until } from "./browser.mjs";
import { example, kPatience_ms, scratch, serve } from "./program.mjs";

/** A copy of an example that may be changed. */
export function copy_of(name) {
  const folder = join(scratch(), name);
  cpSync(example(name), folder, { recursive: true });
  rmSync(join(folder, "runs"), { recursive: true, force: true });
  return folder;
}

export const serve_design = (folder, args = ["--at", "127.0.0.1:0"]) => serve(["studio", folder, ...args]);

/** The page of a project that is edited, with its tree shown. Errors of the page are failures, told by `close`. */
export async function open_design(url, { width = 1440, height = 900, file, may_edit = true } = {}) {
  const context = await (await browser()).newContext({ viewport: { width, height }, reducedMotion: "reduce", deviceScaleFactor: 1 });
  const page = await context.newPage();
  page.setDefaultTimeout(kPatience_ms);
  const errors = [];
  page.on("console", (message) => message.type() === "error" && !/WebSocket connection to|ERR_CONNECTION|net::ERR_/.test(message.text()) && errors.push(message.text()));
  page.on("pageerror", (error) => errors.push(String(error.stack ?? error)));
  await page.goto(url);
  if (may_edit) await page.locator(".design").waitFor();
  if (file) await page.locator(`[data-file="${file}"]`).first().click();
  return {
    page,
    async close() {
      await keep_picture(page);
      await context.close();
      if (errors.length > 0) throw new Error(`the page wrote errors:\n${errors.join("\n")}`);
    },
  };
}

/** The files of a folder and what is in them, but for what the studio keeps for itself. */
export function contents(folder, below = "") {
  const found = {};
  for (const entry of readdirSync(join(folder, below), { withFileTypes: true })) {
    if (entry.name === ".sentree") continue;
    const path = below === "" ? entry.name : `${below}/${entry.name}`;
    if (entry.isDirectory()) Object.assign(found, contents(folder, path));
    else found[path] = readFileSync(join(folder, path), "latin1");
  }
  return found;
}

export const node = (page, name) => page.locator(`[data-testid=design-tree] [data-name="${name}"]`);

/** A word of a line of the text is selected, as by a double click. */
export async function select_word(page, line, word) {
  const found = page.locator(".cm-line", { hasText: line }).first();
  // Only the lines that are to be seen are there.
  const scroller = page.locator(".cm-scroller");
  await scroller.evaluate((element) => (element.scrollTop = 0));
  await until(async () => (await found.count()) > 0 || (await scroller.evaluate((element) => void (element.scrollTop += element.clientHeight / 2))), `a line with ${line}`);
  await found.scrollIntoViewIfNeeded();
  const at = await found.evaluate((element, wanted) => {
    const walker = document.createTreeWalker(element, 4) /* texts */;
    for (let text = walker.nextNode(); text; text = walker.nextNode()) {
      const begin = text.data.indexOf(wanted);
      if (begin < 0) continue;
      const range = document.createRange();
      range.setStart(text, begin);
      range.setEnd(text, begin + wanted.length);
      const box = range.getBoundingClientRect();
      return { x: box.left + box.width / 2, y: box.top + box.height / 2 };
    }
    return null;
  }, word);
  if (!at) throw new Error(`no ${word} in the line with ${line}`);
  await page.mouse.dblclick(at.x, at.y);
}

/** Everything that was done is checked and run. */
export const settled = (page) => until(async () => (await page.getByTestId("shadow").getAttribute("data-current")) === "true", "the shadow run is that of the texts");

export async function drag(page, from, to) {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move((from.x + to.x) / 2, (from.y + to.y) / 2, { steps: 4 });
  await page.mouse.move(to.x, to.y, { steps: 4 });
}

export async function middle(locator) {
  await locator.scrollIntoViewIfNeeded();
  const box = await locator.boundingBox();
  return { x: box.x + box.width / 2, y: box.y + box.height / 2, box };
}

/** Texts of a tree's nodes that cross the outline they are in, or lie outside of it. */
export const crossing = (page, picture = "design-tree") =>
  page.getByTestId(picture).evaluate((svg) => {
    const shown = (text) => getComputedStyle(text).display !== "none";
    const crosses = (node, text) => {
      const [shape, box, scale] = [node.querySelector(".shape").getBoundingClientRect(), text.getBoundingClientRect(), text.getScreenCTM()];
      // Of the letters, not of the line.
      const half = parseFloat(getComputedStyle(text).fontSize) * Math.hypot(scale.a, scale.b) * 0.36;
      const above = Math.abs((box.top + box.bottom - shape.top - shape.bottom) / 2) + half;
      const part = Math.min((2 * above) / shape.height, 1);
      const room = node.querySelector("ellipse.shape") ? shape.width * Math.sqrt(1 - part * part) : shape.width;
      return box.width > room || above > shape.height / 2;
    };
    return [...svg.querySelectorAll(".node")].flatMap((node) => [...node.querySelectorAll("text.name, text.detail")].filter((text) => shown(text) && crosses(node, text)).map(({ textContent }) => textContent));
  });

/** What axe-core finds serious or worse in the page as it is now. */
export async function serious(page) {
  // The page's content policy admits no inline script; the text is evaluated by the driver.
  if (!(await page.evaluate(() => "axe" in window))) await page.evaluate(readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8"));
  const found = await page.evaluate(async () => (await window.axe.run()).violations.map(({ id, impact, nodes }) => ({ id, impact, where: nodes.map(({ target }) => target.join(" ")).slice(0, 3) })));
  return found.filter(({ impact }) => impact === "serious" || impact === "critical");
}

export const undo_name = (page) => page.getByTestId("undo").getAttribute("data-name");

/** The recharge example in design mode, in a folder of its own, with its first picture and its first run. */
export async function design_of_recharge(prepare = () => {}) {
  const folder = copy_of("recharge");
  prepare(folder);
  const program = await serve_design(folder);
  const opened = await open_design(program.url);
  await node(opened.page, "Root").waitFor();
  await opened.page.locator('[data-palette="Fallback"]').waitFor();
  await settled(opened.page);
  return { folder, program, ...opened };
}
