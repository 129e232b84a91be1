// The documentation's search, in the site opened as a file; SENTREE_SITE is its folder.
import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { resolve } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { browser } from "./harness/browser.mjs";
import { kPatience_ms } from "./harness/program.mjs";

const index = resolve(process.env.SENTREE_SITE ?? "", "index.html");
if (!existsSync(index)) {
  console.log(`skipped: there is no ${index} (scripts/site makes it)`);
  process.exit(77);
}

test("a word is found, and leads to a page that has it", async () => {
  const page = await (await browser()).newPage();
  page.setDefaultTimeout(kPatience_ms);
  await page.goto(pathToFileURL(index).href);
  await page.locator("input[name=query]").click();
  await page.locator("input[name=query]").pressSequentially("blackboard");
  const found = page.locator(".md-search-result__link").first();
  await found.waitFor();
  const target = await found.getAttribute("href");
  assert.match(target, /^file:/);
  await page.goto(target);
  assert.match(await page.locator("article").innerText(), /blackboard/i);
});
