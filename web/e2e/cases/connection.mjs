// Lost connections, other origins, and the content policy.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { test } from "node:test";

import { browser, open_page, shown_time, text, until } from "../harness/browser.mjs";
import { example, serve_run } from "../harness/program.mjs";

test("the page says when the program is gone, and takes up the next run", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const { page, close } = await open_page(program.url, { lost_connections: true });
  await until(async () => (await shown_time(page)) > 0, "the run goes on");
  await program.stop("SIGKILL");
  await page.locator(".strip.lost").waitFor();
  assert.match(await page.locator(".strip.lost").innerText(), /No connection to the program/);
  const again = await serve_run(example("recharge"), { scenario: "no-path", port: program.port });
  assert.equal(again.port, program.port);
  await page.locator(".strip.lost").waitFor({ state: "detached" });
  await until(async () => /FAILURE/.test(await text(page, "mission-status")), "the page shows the other run");
  await close();
  await again.stop();
});

test("a page of another origin can neither look nor steer", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const stranger = createServer((_, answer) => answer.setHeader("content-type", "text/html").end("<!doctype html><title>stranger</title>"));
  await new Promise((settle) => stranger.listen(0, "127.0.0.1", settle));
  const context = await (await browser()).newContext();
  const page = await context.newPage();
  await page.goto(`http://127.0.0.1:${stranger.address().port}/`);
  const seen = await page.evaluate(async (port) => {
    const socket = await new Promise((settle) => {
      const attempt = new WebSocket(`ws://127.0.0.1:${port}/api/ws`);
      attempt.onopen = () => settle("open");
      attempt.onmessage = () => settle("message");
      attempt.onclose = () => settle("refused");
    });
    const map = await fetch(`http://127.0.0.1:${port}/api/map`).then((answer) => answer.text()).catch(() => "refused");
    return { socket, map };
  }, program.port);
  assert.deepEqual(seen, { socket: "refused", map: "refused" });
  await context.close();
  stranger.close();
  await program.stop();
});

test("the content policy holds: nothing inline runs, nothing is loaded from elsewhere", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const answer = await fetch(program.url);
  const policy = answer.headers.get("content-security-policy") ?? "";
  assert.match(policy, /default-src 'none'|default-src 'self'/);
  assert.doesNotMatch(policy, /script-src[^;]*unsafe|https?:/);
  const { page, errors } = await open_page(program.url);
  const requests = [];
  page.on("request", (request) => requests.push(request.url()));
  await page.reload();
  await page.locator("#panel-timeline").waitFor();
  for (const url of requests) assert.ok(url.startsWith(program.url) || url.startsWith("blob:"), `loaded from elsewhere: ${url}`);
  assert.deepEqual(errors(), []);
  const ran = await page.evaluate(() => {
    const script = document.createElement("script");
    script.textContent = "window.inline_ran = true";
    document.head.append(script);
    return window.inline_ran === true;
  });
  assert.equal(ran, false);
  await page.context().close();
  await program.stop();
});

test("the packages in the page are named", async () => {
  const program = await serve_run(example("recharge"), { scenario: "normal" });
  const answer = await fetch(new URL("assets/notices.txt", program.url));
  assert.equal(answer.status, 200);
  assert.match(await answer.text(), /react-dom/);
  await program.stop();
});
