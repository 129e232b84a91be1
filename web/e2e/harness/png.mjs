// Pictures that are kept in the repository: the same ones in fewer bytes.
import { Buffer } from "node:buffer";
import { deflateSync, inflateSync } from "node:zlib";

const kSignature_bytes = 8;

function chunks_of(png) {
  const chunks = [];
  for (let at = kSignature_bytes; at < png.length; ) {
    const size = png.readUInt32BE(at);
    chunks.push({ type: png.toString("latin1", at + 4, at + 8), data: png.subarray(at + 8, at + 8 + size) });
    at += size + 12;
  }
  return chunks;
}

const kCrc = Uint32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit += 1) crc = crc & 1 ? 0xedb88320 ^ (crc >>> 1) : crc >>> 1;
  return crc;
});
const crc32 = (bytes) => (bytes.reduce((crc, byte) => kCrc[(crc ^ byte) & 0xff] ^ (crc >>> 8), 0xffffffff) ^ 0xffffffff) >>> 0;

function chunk(type, data) {
  const made = Buffer.alloc(data.length + 12);
  made.writeUInt32BE(data.length, 0);
  made.write(type, 4, "latin1");
  data.copy(made, 8);
  made.writeUInt32BE(crc32(made.subarray(4, 8 + data.length)), 8 + data.length);
  return made;
}

function paeth(a, b, c) {
  const [to_a, to_b, to_c] = [Math.abs(b - c), Math.abs(a - c), Math.abs(a + b - 2 * c)];
  return to_a <= to_b && to_a <= to_c ? a : to_b <= to_c ? b : c;
}

/** The lines of a picture of `pixel` bytes for each of them, without the filters of PNG. */
function unfiltered(raw, width, height, pixel) {
  const line = width * pixel;
  const out = Buffer.alloc(line * height);
  for (let y = 0; y < height; y += 1) {
    const filter = raw[y * (line + 1)];
    for (let x = 0; x < line; x += 1) {
      const at = y * line + x;
      const left = x >= pixel ? out[at - pixel] : 0;
      const up = y > 0 ? out[at - line] : 0;
      const corner = x >= pixel && y > 0 ? out[at - line - pixel] : 0;
      const guess = [0, left, up, (left + up) >> 1, paeth(left, up, corner)][filter];
      out[at] = raw[y * (line + 1) + 1 + x] + guess;
    }
  }
  return out;
}

/** Opaque: without what says so of each pixel. */
function without_alpha(pixels) {
  const out = Buffer.alloc((pixels.length / 4) * 3);
  for (let i = 0; i * 4 < pixels.length; i += 1) {
    if (pixels[i * 4 + 3] !== 255) return null;
    pixels.copy(out, i * 3, i * 4, i * 4 + 3);
  }
  return out;
}

/** A picture of a page as a browser writes it (8 bits, opaque, not interlaced), without filters, which cost flat colours more than they save; else as it is. */
export function smaller(png) {
  const chunks = chunks_of(png);
  const header = chunks[0].data;
  const [width, height] = [header.readUInt32BE(0), header.readUInt32BE(4)];
  const pixel = { 2: 3, 6: 4 }[header[9]];
  if (header[8] !== 8 || pixel === undefined || header[12] !== 0) return png;
  const raw = inflateSync(Buffer.concat(chunks.filter(({ type }) => type === "IDAT").map(({ data }) => data)));
  const all = unfiltered(raw, width, height, pixel);
  const pixels = pixel === 4 ? without_alpha(all) : all;
  if (!pixels) return png;
  const plain = Buffer.alloc((width * 3 + 1) * height);
  for (let y = 0; y < height; y += 1) pixels.copy(plain, y * (width * 3 + 1) + 1, y * width * 3, (y + 1) * width * 3);
  const first = Buffer.from(header);
  first[9] = 2;
  const made = Buffer.concat([png.subarray(0, kSignature_bytes), chunk("IHDR", first), chunk("IDAT", deflateSync(plain, { level: 9, memLevel: 9 })), chunk("IEND", Buffer.alloc(0))]);
  return made.length < png.length ? made : png;
}
