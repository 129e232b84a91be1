// Every picture can be saved, and what is saved is what was shown.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { open_page } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

async function save(page, id, item) {
  await page.locator(`[data-view-of="${id}"]`).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("menuitem", { name: item }).click()]);
  return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
}

/** What a browser makes of an SVG document by itself, without the page's style sheets. */
const read_svg = (page, source) =>
  page.evaluate((svg) => {
    const parsed = new DOMParser().parseFromString(svg, "image/svg+xml");
    const all = [...parsed.querySelectorAll("*")];
    return {
      error: parsed.querySelector("parsererror")?.textContent ?? null,
      root: parsed.documentElement.tagName,
      texts: [...parsed.querySelectorAll("text")].map((text) => text.textContent),
      styled: all.filter((element) => element.hasAttribute("class") || element.hasAttribute("style") || element.tagName === "style").length,
      outside: all.filter((element) => /^https?:/.test(element.getAttribute("href") ?? "")).length,
      filled: [...parsed.querySelectorAll("rect, path, ellipse")].every((shape) => shape.hasAttribute("fill") || shape.hasAttribute("stroke")),
      images: parsed.querySelectorAll("image").length,
    };
  }, source);

test("tree, chart and map are saved as SVG in which text is text", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url);
  await page.locator("[data-node]", { hasText: "GoToKitchen" }).click();
  const wanted = { mission: "GoToKitchen", charts: "moving", map: "kitchen" };
  for (const [id, word] of Object.entries(wanted)) {
    const { name, bytes } = await save(page, id, /SVG/);
    assert.match(name, /^normal-.*\.svg$/);
    const found = await read_svg(page, bytes.toString());
    assert.equal(found.error, null, `${id} is no XML`);
    assert.equal(found.root, "svg");
    assert.ok(found.texts.includes(word), `${id} has the text ${word}: ${found.texts}`);
    assert.equal(found.styled, 0, `${id} depends on a style sheet`);
    assert.equal(found.outside, 0, `${id} loads from elsewhere`);
    assert.ok(found.filled, `${id} has shapes without paint`);
    assert.equal(found.images, id === "map" ? 1 : 0);
  }
  await close();
  await program.stop();
});

test("a picture is saved as PNG, also by key and in dark colours", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url, { theme: "dark" });
  const { bytes } = await save(page, "mission", /PNG/);
  assert.equal(bytes.subarray(1, 4).toString(), "PNG");
  assert.ok(bytes.readUInt32BE(16) > 800, "two pixels for each of the drawing's");

  // The chart shown is that of the leaf at work.
  await page.locator('[data-testid=chart][data-chart="skill:GoToKitchen"]').focus();
  await page.keyboard.press("e");
  const [download] = await Promise.all([page.waitForEvent("download"), page.keyboard.press("Enter")]);
  assert.match(download.suggestedFilename(), /GoToKitchen.*\.svg$/);
  await close();
  await program.stop();
});
