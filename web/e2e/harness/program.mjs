import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
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
process.on("exit", () => started.forEach((child) => child.kill("SIGKILL")));

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

/** Starts the program with a page, and waits for the line that says where it is. */
export async function serve(args, options = {}) {
  const child = spawn(program, args, { stdio: ["ignore", "pipe", "pipe"], ...options });
  started.add(child);
  let output = "";
  const ended = new Promise((settle) => child.on("close", (code) => settle(code)));
  const url = await new Promise((settle, fail) => {
    const look = (data) => {
      output += data;
      const found = /the page: (http:\/\/\S+)/.exec(output);
      if (found) settle(found[1]);
    };
    child.stdout.on("data", look);
    child.stderr.on("data", look);
    child.on("error", fail);
    void ended.then((code) => fail(new Error(`the program ended (${code}) before it served a page:\n${output}`)));
  });
  return {
    url,
    port: Number(new URL(url).port),
    pid: child.pid,
    output: () => output,
    ended,
    async stop(signal = "SIGINT") {
      child.kill(signal);
      const code = await ended;
      started.delete(child);
      return code;
    },
  };
}

/** The run of `project` with a page at a free port, nothing recorded. */
export function serve_run(project, { scenario, args = [], port = 0, cwd } = {}) {
  const chosen = scenario ? ["--scenario", scenario] : [];
  return serve(["run", project, ...chosen, `--studio=${port}`, "--no-record", ...args], cwd ? { cwd } : {});
}
