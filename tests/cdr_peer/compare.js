// usage: cdr_samples SEED COUNT | node compare.js: @foxglove/rosmsg2-serialization reads the octets of each line, has the same value, and writes
// the same octets.

const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization");

// Both sides' values as one: integers are decimal text, arrays of numbers lists, octets numbers.
function plain(value) {
  if (typeof value === "bigint") return BigInt.asIntN(64, value).toString();
  if (typeof value === "number") return String(value);
  if (typeof value === "string" && /^-?\d{16,}$/.test(value)) return value;
  if (value === null) return "Infinity";
  // Arrays of them are octets of ours.
  if (value instanceof Int8Array) return Array.from(new Uint8Array(value), plain);
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  if (typeof value !== "object") return value;
  if ("$bytes" in value) return Array.from(Buffer.from(value.$bytes, "base64"), plain);
  const out = {};
  for (const name of Object.keys(value).sort()) {
    // The reader has times of its own form.
    out[name === "nsec" ? "nanosec" : name] = plain(value[name]);
  }
  return out;
}

let compared = 0;
let skipped = 0;
let failed = 0;
for (const line of require("fs").readFileSync(0, "utf8").split("\n").filter(Boolean)) {
  const { seed, definition, value, octets } = JSON.parse(line);
  const told = (what) => {
    failed += 1;
    console.log(`seed ${seed}: ${what}\n${definition.split("=")[0]}${octets}`);
  };
  // They refuse wide text, on which implementations differ.
  if (definition.includes("wstring")) {
    skipped += 1;
    continue;
  }
  try {
    const types = parse(definition, { ros2: true });
    const read = new MessageReader(types).readMessage(Buffer.from(octets, "hex"));
    const [theirs, ours] = [plain(read), plain(value)].map((each) => JSON.stringify(each));
    if (theirs !== ours) told(`they read ${theirs}, we wrote ${ours}`);
    const written = Buffer.from(new MessageWriter(types).writeMessage(read)).toString("hex");
    // Their writer counts characters where octets are meant, so that it cuts off text that is not ASCII.
    const isAscii = /^[\x00-\x7f]*$/.test(JSON.stringify(value));
    if (isAscii && written !== octets) told(`they write ${written}`);
  } catch (error) {
    told(String(error));
  }
  compared += 1;
}
console.log(`${compared} compared, ${failed} differ, ${skipped} with wide text left out`);
process.exit(failed > 0 || compared === 0 ? 1 : 0);
