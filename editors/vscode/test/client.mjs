// The language server as editors meet it: the program itself, over its standard streams, with the protocol's own
// client library. client.mjs PROGRAM SOURCES FOLDER
import { spawn } from "node:child_process";
import { cpSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import assert from "node:assert/strict";

const [program, sources, out] = process.argv.slice(2);
const own = dirname(dirname(fileURLToPath(import.meta.url)));
if (!existsSync(join(own, "node_modules/vscode-languageserver-protocol"))) {
  console.log("skipped: the packages are not installed (npm ci in editors/vscode/)");
  process.exit(77);
}
const require = createRequire(join(own, "package.json"));
const lsp = require("vscode-languageserver-protocol/node");
const rpc = require("vscode-jsonrpc/node");

rmSync(out, { recursive: true, force: true });
mkdirSync(out, { recursive: true });
const uri = (file) => pathToFileURL(file).href;

class Client {
  constructor() {
    this.server = spawn(program, ["lsp"], { stdio: ["pipe", "pipe", "inherit"] });
    this.connection = rpc.createMessageConnection(
      new rpc.StreamMessageReader(this.server.stdout),
      new rpc.StreamMessageWriter(this.server.stdin),
    );
    this.found = new Map();
    this.waiting = [];
    this.connection.onNotification(lsp.PublishDiagnosticsNotification.type, (told) => {
      this.found.set(told.uri, told.diagnostics);
      this.waiting = this.waiting.filter((wait) => !wait());
    });
    this.ended = new Promise((done) => this.server.on("exit", (code) => done(code)));
    this.versions = new Map();
    this.texts = new Map();
    this.connection.listen();
  }
  async start(folder) {
    const answer = await this.connection.sendRequest(lsp.InitializeRequest.type, {
      processId: process.pid,
      rootUri: uri(folder),
      capabilities: { workspace: { workspaceEdit: { documentChanges: true, resourceOperations: ["rename"] } } },
    });
    await this.connection.sendNotification(lsp.InitializedNotification.type, {});
    return answer.capabilities;
  }
  open(file) {
    const text = readFileSync(file, "utf8");
    this.texts.set(file, text);
    this.versions.set(file, 1);
    return this.connection.sendNotification(lsp.DidOpenTextDocumentNotification.type, {
      textDocument: { uri: uri(file), languageId: "x", version: 1, text },
    });
  }
  place(file, word, ahead = 1) {
    const at = this.texts.get(file).indexOf(word);
    assert.ok(at >= 0, `${file} has ${word}`);
    const before = this.texts.get(file).slice(0, at + ahead).split("\n");
    return { line: before.length - 1, character: before.at(-1).length };
  }
  replace(file, old, text) {
    const range = { start: this.place(file, old, 0), end: this.place(file, old, old.length) };
    this.versions.set(file, this.versions.get(file) + 1);
    this.texts.set(file, this.texts.get(file).replace(old, () => text));
    return this.connection.sendNotification(lsp.DidChangeTextDocumentNotification.type, {
      textDocument: { uri: uri(file), version: this.versions.get(file) },
      contentChanges: [{ range, text }],
    });
  }
  ask(type, file, word, ahead, more = {}) {
    return this.connection.sendRequest(type, {
      textDocument: { uri: uri(file) },
      position: this.place(file, word, ahead),
      ...more,
    });
  }
  /// Until what is told of a file fits.
  diagnostics(file, fits) {
    return new Promise((done) => {
      const look = () => {
        const found = this.found.get(uri(file)) ?? [];
        if (fits(found)) done(found);
        return fits(found);
      };
      if (!look()) this.waiting.push(look);
    });
  }
  async end() {
    await this.connection.sendRequest(lsp.ShutdownRequest.type);
    await this.connection.sendNotification(lsp.ExitNotification.type);
    assert.equal(await this.ended, 0);
    this.connection.dispose();
  }
}

async function edits() {
  const folder = join(out, "recharge");
  cpSync(join(sources, "examples/recharge"), folder, { recursive: true });
  rmSync(join(folder, "runs"), { recursive: true, force: true });
  const client = new Client();
  const capabilities = await client.start(folder);
  assert.equal(capabilities.textDocumentSync.change, lsp.TextDocumentSyncKind.Incremental);
  const mission = join(folder, "mission.xml");
  const chart = join(folder, "skills/GoToLocation.scxml");
  await client.open(mission);
  await client.open(chart);

  // Characters beyond the basic plane: two units each.
  await client.replace(chart, "Action: drive to", "Action 🤖🤖: drive to");
  await client.replace(chart, "🤖🤖: drive", "🤖🤖: go");
  await client.replace(chart, 'event="stopNavigation"', 'event="stopNavigatio"');
  const [slip] = await client.diagnostics(chart, (found) => found.length > 0);
  assert.match(slip.message, /did you mean "stopNavigation"/);
  const [fix] = await client.connection.sendRequest(lsp.CodeActionRequest.type, {
    textDocument: { uri: uri(chart) },
    range: slip.range,
    context: { diagnostics: [slip] },
  });
  const [edit] = fix.edit.changes[uri(chart)];
  assert.equal(edit.newText, "stopNavigation");
  assert.equal(edit.range.start.line, client.place(chart, 'event="stopNavigatio"').line);
  await client.replace(chart, 'event="stopNavigatio"', 'event="stopNavigation"');
  await client.diagnostics(chart, (found) => found.length === 0);

  const items = await client.ask(lsp.CompletionRequest.type, mission, 'destination="kitchen"', 13);
  assert.ok(items.items.some((item) => item.label === "station"));
  const hover = await client.ask(lsp.HoverRequest.type, chart, 'event="stopNavigation"', 8);
  assert.match(hover.contents.value, /ReturnCode stopNavigation\(i64 goal_id\)/);
  const [skill] = await client.ask(lsp.DefinitionRequest.type, mission, "<WaitForUser", 3);
  assert.equal(skill.uri, uri(join(folder, "skills/WaitForUser.scxml")));
  const changes = await client.ask(lsp.RenameRequest.type, mission, 'name="BatteryLevelAbove30"', 8, { newName: "Enough" });
  assert.ok(changes.documentChanges.length >= 3);

  // A request that is cancelled while it waits.
  const cancel = new rpc.CancellationTokenSource();
  const asked = client.connection.sendRequest(lsp.WorkspaceSymbolRequest.type, { query: "" }, cancel.token);
  cancel.cancel();
  await asked.catch((error) => assert.equal(error.code, lsp.LSPErrorCodes.RequestCancelled));
  await assert.rejects(client.connection.sendRequest("sentree/nothing", {}), { code: rpc.ErrorCodes.MethodNotFound });
  await client.end();
}

// What no library sends: bytes as they are.
async function hostile() {
  const server = spawn(program, ["lsp"], { stdio: ["pipe", "pipe", "inherit"] });
  const ended = new Promise((done) => server.on("exit", (code) => done(code)));
  const reader = new rpc.StreamMessageReader(server.stdout);
  const answers = [];
  let wake = () => {};
  reader.listen((message) => {
    answers.push(message);
    wake();
  });
  const answer = async () => {
    while (answers.length === 0) await new Promise((done) => (wake = done));
    return answers.shift();
  };
  const frame = (text) => `Content-Length: ${Buffer.byteLength(text)}\r\n\r\n${text}`;
  const request = (id, method, params = {}) => frame(JSON.stringify({ jsonrpc: "2.0", id, method, params }));

  server.stdin.write(request(1, "textDocument/hover"));
  assert.equal((await answer()).error.code, -32002);
  server.stdin.write(frame("{no json"));
  assert.equal((await answer()).error.code, -32700);
  server.stdin.write("Content-Length: 18446744073709551616\r\n\r\n");
  assert.equal((await answer()).error.code, -32700);
  // No header either: passed over, up to the next one.
  server.stdin.write("Nothing: here\r\n\r\n");
  const large = 17 << 20;
  server.stdin.write(`Content-Length: ${large}\r\n\r\n`);
  assert.equal((await answer()).error.code, -32700);
  server.stdin.write(Buffer.alloc(large, 0x20));
  const whole = request(2, "initialize", { capabilities: {} });
  for (let at = 0; at < whole.length; at += 7) server.stdin.write(whole.slice(at, at + 7));
  assert.equal((await answer()).id, 2);
  server.stdin.write(request(3, "textDocument/completion", { textDocument: 5, position: "x" }));
  assert.equal((await answer()).error.code, -32602);
  // Half a message, and nobody there any more.
  server.stdin.end("Content-Length: 100\r\n\r\n{");
  assert.equal(await ended, 1);
}

// A project of 300 nodes and 60 charts: how long answers take, and findings after an edit.
async function large() {
  const folder = join(out, "large");
  const recharge = join(sources, "examples/recharge");
  mkdirSync(join(folder, "skills"), { recursive: true });
  mkdirSync(join(folder, "scenarios"));
  cpSync(join(recharge, "world"), join(folder, "world"), { recursive: true });
  const source = readFileSync(join(recharge, "skills/GoToLocation.scxml"), "utf8");
  const skills = Array.from({ length: 60 }, (_, i) => `Skill${i}`);
  for (const skill of skills)
    writeFileSync(join(folder, `skills/${skill}.scxml`), source.replace('name="GoToLocation"', `name="${skill}"`));
  const groups = Array.from({ length: 30 }, (_, group) => {
    const leaves = Array.from({ length: 9 }, (_, leaf) => {
      const skill = skills[(group * 9 + leaf) % skills.length];
      return `        <${skill} name="L${group}_${leaf}" destination="kitchen"/>`;
    });
    return `      <ReactiveSequence name="G${group}">\n${leaves.join("\n")}\n      </ReactiveSequence>`;
  });
  const models = skills.map((id) => `    <Action ID="${id}"><input_port name="destination" type="std::string"/></Action>`);
  writeFileSync(
    join(folder, "mission.xml"),
    `<root BTCPP_format="4" main_tree_to_execute="Main">\n  <BehaviorTree ID="Main">\n    <Fallback name="Root">\n` +
      `${groups.join("\n")}\n    </Fallback>\n  </BehaviorTree>\n  <TreeNodesModel>\n${models.join("\n")}\n  </TreeNodesModel>\n</root>\n`,
  );
  writeFileSync(
    join(folder, "sentree.yaml"),
    "mission: {file: mission.xml, tree: Main}\nworld: world/world.yaml\nservices:\n" +
      "  battery: {interface: robot.thrift/Battery, at: sim}\n  navigation: {interface: robot.thrift/Navigation, at: sim}\n",
  );
  writeFileSync(join(folder, "scenarios/a.yaml"), "duration: 10 s\nexpect: {mission: RUNNING}\n");

  const client = new Client();
  await client.start(folder);
  const mission = join(folder, "mission.xml");
  const chart = join(folder, "skills/Skill7.scxml");
  await client.open(mission);
  await client.open(chart);
  const kinds = {
    completion: () => client.ask(lsp.CompletionRequest.type, chart, "_event.data.result.code", 19),
    hover: () => client.ask(lsp.HoverRequest.type, chart, 'event="stopNavigation"', 8),
    definition: () => client.ask(lsp.DefinitionRequest.type, mission, "<Skill7", 3),
    references: () =>
      client.ask(lsp.ReferencesRequest.type, chart, 'target="navigation"', 9, { context: { includeDeclaration: true } }),
    rename: () => client.ask(lsp.RenameRequest.type, mission, 'name="L3_3"', 7, { newName: "Other" }),
    outline: () => client.connection.sendRequest(lsp.DocumentSymbolRequest.type, { textDocument: { uri: uri(mission) } }),
    format: () =>
      client.connection.sendRequest(lsp.DocumentFormattingRequest.type, { textDocument: { uri: uri(mission) }, options: {} }),
  };
  await kinds.hover();
  // Waiting times are for people to read; what is held to a bound is the server's processor time, which does not depend
  // on what else the machine does.
  const processor = () => {
    const fields = readFileSync(`/proc/${client.server.pid}/stat`, "utf8").split(") ")[1].split(" ");
    return (Number(fields[11]) + Number(fields[12])) * 10;
  };
  const times = new Map();
  const take = async (name, act) => {
    const begin = performance.now();
    const result = await act();
    if (!times.has(name)) times.set(name, []);
    times.get(name).push(performance.now() - begin);
    return result;
  };
  const rounds = 20;
  let used = processor();
  for (let round = 0; round < rounds; ++round) {
    // As while one types: an edit, then what the editor asks at once, then findings.
    const [was, is] = round % 2 === 0 ? ["stopNavigation", "stopNavigatio"] : ["stopNavigatio", "stopNavigation"];
    await client.replace(chart, `event="${was}"`, `event="${is}"`);
    await take("completion after an edit", kinds.completion);
    await take("findings", () => client.diagnostics(chart, (found) => found.length > 0 === (round % 2 === 0)));
  }
  const after_an_edit = (processor() - used) / rounds;
  const each = new Map();
  for (const [name, ask] of Object.entries(kinds)) {
    used = processor();
    for (let round = 0; round < rounds; ++round) assert.ok(await take(name, ask), name);
    each.set(name, (processor() - used) / rounds);
  }
  await client.end();
  for (const [name, list] of times) {
    list.sort((a, b) => a - b);
    console.log(`${name}: ${list[list.length >> 1].toFixed(1)} ms, at most ${list.at(-1).toFixed(1)} ms`);
  }
  console.log(`processor, ms: edit, completion and findings ${after_an_edit}, ${[...each].map((e) => e.join(" ")).join(", ")}`);
  for (const [name, time] of each) assert.ok(time < 50, `${name} takes ${time} ms`);
  // Several edits in one go are checked once.
  assert.ok(after_an_edit < 500, `findings take ${after_an_edit} ms`);
}

await edits();
await hostile();
await large();
