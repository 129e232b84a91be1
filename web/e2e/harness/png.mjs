import { Buffer } from "node:buffer";
import { deflateSync, inflateSync } from "node:zlib";

const kTable = Array.from({ length: 256 }, (_, byte) => {
  let rest = byte;
  for (let bit = 0; bit < 8; bit++) rest = rest & 1 ? (rest >>> 1) ^ 0xedb88320 : rest >>> 1;
  return rest >>> 0;
});
function chunk(type, data) {
  const body = Buffer.concat([Buffer.from(type, "latin1"), data]);
  const sum = body.reduce((before, byte) => (before >>> 8) ^ kTable[(before ^ byte) & 255], 0xffffffff);
  const ends = Buffer.alloc(8);
  ends.writeUInt32BE(data.length);
  ends.writeUInt32BE((sum ^ 0xffffffff) >>> 0, 4);
  return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
}

/** What the filters of a PNG predict of a byte from those at its left, above it, and above that. */
const kPredicted = [
  () => 0,
  (left) => left,
  (_, above) => above,
  (left, above) => (left + above) >> 1,
  (left, above, corner) => {
    const [to_left, to_above, to_corner] = [above - corner, left - corner, left + above - 2 * corner].map(Math.abs);
    return to_left <= to_above && to_left <= to_corner ? left : to_above <= to_corner ? above : corner;
  },
];

/** The same picture (RGB or RGBA, 8 bits) without filters, in fewer bytes: a page has large areas of one colour. */
export function smaller(png) {
  const chunks = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at)) chunks.push({ type: png.toString("latin1", at + 4, at + 8), data: png.subarray(at + 8, at + 8 + png.readUInt32BE(at)) });
  const of = (type) => chunks.filter((one) => one.type === type).map(({ data }) => data);
  const [header] = of("IHDR");
  const size = header[9] === 6 ? 4 : 3;
  const row = header.readUInt32BE(0) * size + 1;
  const bytes = inflateSync(Buffer.concat(of("IDAT")));
  for (let start = 0; start < bytes.length; start += row) {
    const predicted = kPredicted[bytes[start]];
    bytes[start] = 0;
    for (let i = 1; i < row; i++) {
      const [left, above] = [i > size ? bytes[start + i - size] : 0, start > 0 ? bytes[start + i - row] : 0];
      bytes[start + i] += predicted(left, above, i > size && start > 0 ? bytes[start + i - row - size] : 0);
    }
  }
  return Buffer.concat([png.subarray(0, 8), chunk("IHDR", header), chunk("IDAT", deflateSync(bytes, { level: 9, memLevel: 9 })), chunk("IEND", Buffer.alloc(0))]);
}
