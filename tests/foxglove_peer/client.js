// client.js SENTREE PROJECT SCENARIO: runs it with --foxglove, subscribes to all topics with Foxglove's own client, and compares what came with the
// recording, which the MCAP reader of others reads.

const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { McapIndexedReader } = require("@mcap/core");
const { decompress } = require("fzstd");
const { spawn } = require("child_process");
const { readFileSync } = require("fs");
const { WebSocket } = require("ws");

const [sentree, project, scenario] = process.argv.slice(2);
const failures = [];
const check = (what, holds, seen) => {
  if (holds) return;
  failures.push(what);
  console.log(`FAILED ${what}`, seen ?? "");
};

class Octets {
  constructor(data) { this.data = data; }
  async size() { return BigInt(this.data.length); }
  async read(offset, size) { return new Uint8Array(this.data.subarray(Number(offset), Number(offset + size))); }
}

async function recorded(path) {
  const reader = await McapIndexedReader.Initialize({
    readable: new Octets(readFileSync(path)),
    decompressHandlers: { zstd: (octets) => decompress(octets) },
  });
  const topics = new Map();
  const schemas = new Map();
  for (const channel of reader.channelsById.values()) {
    const schema = reader.schemasById.get(channel.schemaId);
    schemas.set(channel.topic, [schema.name, Buffer.from(schema.data).toString(), schema.encoding, channel.messageEncoding].join("\n"));
    topics.set(channel.topic, []);
  }
  for await (const message of reader.readMessages())
    topics.get(reader.channelsById.get(message.channelId).topic).push(`${message.logTime} ${Buffer.from(message.data)}`);
  return { topics, schemas };
}

async function main() {
  const run = spawn(sentree, ["run", project, "--scenario", scenario, "--clock", "virtual", "--factor", "40", "--duration", "60 s", "--foxglove=0", "--record", "run.mcap"],
                    { stdio: ["ignore", "ignore", "pipe"] });
  const ended = new Promise((resolve) => run.on("exit", resolve));
  const url = await new Promise((resolve, reject) => {
    let said = "";
    run.stderr.on("data", (text) => {
      said += text;
      const found = said.match(/Foxglove: (ws:\/\/127\.0\.0\.1:\d+) \(no authentication/);
      if (found) resolve(found[1]);
    });
    run.on("exit", () => reject(new Error(`it ended: ${said}`)));
  });
  const socket = new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
  const client = new FoxgloveClient({ ws: socket });
  const topics = new Map();
  const schemas = new Map();
  const bySubscription = new Map();
  const clocks = [];
  let info;
  client.on("error", (error) => check("no error", false, error));
  client.on("serverInfo", (given) => { info = given; });
  client.on("status", (status) => check("no status", false, status));
  client.on("time", ({ timestamp }) => clocks.push(timestamp));
  client.on("advertise", (channels) => {
    for (const channel of channels) {
      schemas.set(channel.topic, [channel.schemaName, channel.schema, channel.schemaEncoding, channel.encoding].join("\n"));
      topics.set(channel.topic, []);
      bySubscription.set(client.subscribe(channel.id), channel.topic);
    }
  });
  client.on("message", ({ subscriptionId, timestamp, data }) =>
    topics.get(bySubscription.get(subscriptionId)).push(`${timestamp} ${Buffer.from(data.buffer, data.byteOffset, data.byteLength)}`));
  const closed = await new Promise((resolve) => client.on("close", resolve));
  await ended;

  check("the server says who it is", info?.name === `sentree: ${scenario}` && info.capabilities.includes("time"), info);
  check("the end of the run is told", closed.code === 1001 && closed.reason === "the run is over", closed);
  check("time goes on", clocks.length > 10 && clocks.every((time, i) => i === 0 || time > clocks[i - 1]), clocks.length);
  const file = await recorded("run.mcap");
  let compared = 0;
  for (const [topic, messages] of file.topics) {
    check(`${topic} is offered as it is recorded`, schemas.get(topic) === file.schemas.get(topic), schemas.get(topic));
    const came = topics.get(topic) ?? [];
    // The first one may have been there before; from then on none is missing.
    const rest = messages.slice(messages.length - came.length);
    check(`${topic}: what came is the end of what is recorded`, came.length > 0 === messages.length > 0 && came.every((message, i) => message === rest[i]),
          [came.length, messages.length]);
    compared += came.length;
  }
  check("there was much to compare", compared > 1000 && topics.get("/map").length === 1, compared);
  console.log(`${compared} messages on ${file.topics.size} topics came as they are recorded`);
  if (failures.length > 0) process.exit(1);
}

main().catch((error) => {
  console.log("FAILED", error);
  process.exit(1);
});
