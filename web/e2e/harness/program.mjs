import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { after } from "node:test";
import { fileURLToPath } from "node:url";

/** The sources; examples are run from there. */
export const kRoot = resolve(fileURLToPath(import.meta.url), "../../../..");
export const program = process.env.SENTREE_PROGRAM ?? join(kRoot, "build/release/bin/sentree");
/** No assertion depends on speed; this only ends tests that hang. */
export const kPatience_ms = Number(process.env.SENTREE_PATIENCE_S ?? 120) * 1000;

export const example = (name) => join(kRoot, "examples", name);

/** A folder that is gone when the tests are over. */
export function scratch() {
  const folder = mkdtempSync(join(tmpdir(), "sentree-studio-"));
  process.on("exit", () => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

const started = new Set();
const end_all = () => started.forEach((child) => child.kill("SIGKILL"));
process.on("exit", end_all);
after(end_all); // what a failed test has left would keep the process alive

/** Runs the program to its end: its exit code and what it wrote. */
export function run(args, options = {}) {
  return new Promise((settle, fail) => {
    const child = spawn(program, args, { stdio: ["ignore", "pipe", "pipe"], ...options });
    started.add(child);
    let stdout = "";
    let stderr = "";
    child.stdout.on("data", (data) => (stdout += data));
    child.stderr.on("data", (data) => (stderr += data));
    child.on("error", fail);
    child.on("close", (code) => {
      started.delete(child);
      settle({ code, stdout, stderr });
    });
  });
}

/** Starts the program; `written(pattern)` waits until it has written what matches. */
export function start(args, options = {}) {
  const child = spawn(program, args, { stdio: ["ignore", "pipe", "pipe"], ...options });
  started.add(child);
  let output = "";
  const waiting = new Set();
  const look = (data) => {
    output += data;
    waiting.forEach((check) => check());
  };
  child.stdout.on("data", look);
  child.stderr.on("data", look);
  const ended = new Promise((settle, fail) => {
    child.on("close", settle);
    child.on("error", fail);
  });
  return {
    pid: child.pid,
    output: () => output,
    ended,
    written(pattern) {
      return new Promise((settle, fail) => {
        const give_up = (why) => fail(new Error(`the program ${why} before it wrote ${pattern}:\n${output}`));
        const limit = setTimeout(give_up, kPatience_ms, "ran too long");
        const check = () => {
          const found = pattern.exec(output);
          if (!found) return;
          clearTimeout(limit);
          waiting.delete(check);
          settle(found);
        };
        waiting.add(check);
        check();
        ended.then((code) => give_up(`ended (${code})`), fail).finally(() => clearTimeout(limit));
      });
    },
    async stop(signal = "SIGINT") {
      child.kill(signal);
      const code = await ended;
      started.delete(child);
      return code;
    },
  };
}

/** Starts the program with a page, and waits for the line that says where it is. */
export async function serve(args, options = {}) {
  const served = start(args, options);
  const [, url] = await served.written(/the page: (http:\/\/\S+)/);
  return { ...served, url, port: Number(new URL(url).port) };
}

/** The run of `project` with a page at a free port, nothing recorded. */
export function serve_run(project, { scenario, args = [], port = 0, cwd } = {}) {
  const chosen = scenario ? ["--scenario", scenario] : [];
  return serve(["run", project, ...chosen, `--studio=${port}`, "--no-record", ...args], cwd ? { cwd } : {});
}
