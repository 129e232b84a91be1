// read_mcap.mjs FILE: reads a recording with the reader of the standard's authors, through its indexes, and prints what it
// found as one line of JSON. Every message must be JSON with the members that its JSON schema names as types of the top.
import { readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";

const data = await readFile(process.argv[2]);
const decompressHandlers = await loadDecompressHandlers();
const readable = {
  size: async () => BigInt(data.length),
  read: async (offset, length) => new Uint8Array(data.buffer, data.byteOffset + Number(offset), Number(length)),
};
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });

const fitting = (value, schema) => {
  if (schema.type === "object") return typeof value === "object" && !Array.isArray(value) && value !== null &&
    Object.entries(schema.properties ?? {}).every(([key, inner]) => !(key in value) || fitting(value[key], inner));
  if (schema.type === "array") return Array.isArray(value) && value.every((item) => fitting(item, schema.items ?? {}));
  if (schema.type === "string") return typeof value === "string";
  if (schema.type === "number") return typeof value === "number";
  if (schema.type === "integer") return Number.isInteger(value);
  if (schema.type === "boolean") return typeof value === "boolean";
  if (schema.enum) return schema.enum.includes(value);
  if (schema.oneOf) return schema.oneOf.some((one) => one.const === value);
  return true;
};

const schemas = new Map();
for (const [id, schema] of reader.schemasById) schemas.set(id, JSON.parse(new TextDecoder().decode(schema.data)));
const messages = {};
let last = 0n;
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  messages[channel.topic] = (messages[channel.topic] ?? 0) + 1;
  if (message.logTime < last) throw new Error("messages out of order");
  last = message.logTime;
  const value = JSON.parse(new TextDecoder().decode(message.data));
  if (!fitting(value, schemas.get(channel.schemaId))) throw new Error(`${channel.topic}: not as its schema says`);
}
let attachments = 0;
for await (const attachment of reader.readAttachments()) attachments += attachment.data.length > 0 ? 1 : 0;
const metadata = {};
for await (const entry of reader.readMetadata()) metadata[entry.name] = Object.fromEntries(entry.metadata);

// From front to back as well, with every checksum.
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(data);
let streamed = 0;
for (let record; (record = stream.nextRecord()); ) if (record.type === "Message") ++streamed;
if (!stream.done()) throw new Error("the file does not end as it should");
if (BigInt(streamed) !== reader.statistics.messageCount) throw new Error("the statistics miscount");

console.log(JSON.stringify({ messages, attachments, metadata, streamed, chunks: reader.chunkIndexes.length }));
