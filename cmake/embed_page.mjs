// node embed_page.mjs DIST OUT: the files of the built page, compressed, as a C++ file that takes them in.
import { createHash } from "node:crypto";
import { mkdirSync, readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { extname, join } from "node:path";
import { gzipSync } from "node:zlib";

const [dist, out] = process.argv.slice(2);
const kTypes = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript; charset=utf-8",
  ".css": "text/css; charset=utf-8",
  ".svg": "image/svg+xml",
  ".png": "image/png",
  ".ico": "image/x-icon",
  ".json": "application/json",
  ".txt": "text/plain; charset=utf-8",
  ".woff2": "font/woff2",
};
const kCompressed = new Set([".png", ".woff2"]);

function files(folder, path) {
  return readdirSync(folder)
    .sort()
    .flatMap((name) =>
      statSync(join(folder, name)).isDirectory() ? files(join(folder, name), `${path}${name}/`) : [`${path}${name}`],
    );
}

mkdirSync(out, { recursive: true });
let data = "";
let table = "";
files(dist, "/").forEach((path, index) => {
  const ending = extname(path);
  const gzipped = !kCompressed.has(ending);
  const content = readFileSync(join(dist, path));
  writeFileSync(join(out, `${index}.bin`), gzipped ? gzipSync(content, { level: 9 }) : content);
  // Of another content, another name: whoever caches what the compiler makes sees the difference.
  const symbol = `sentree_page_${index}_${createHash("sha256").update(content).digest("hex").slice(0, 16)}`;
  data +=
    `asm(".section .rodata\\n.global ${symbol}\\n.global ${symbol}_end\\n"\n` +
    `    "${symbol}:\\n.incbin \\"${index}.bin\\"\\n${symbol}_end:\\n.byte 0\\n.text\\n");\n` +
    `extern "C" const char ${symbol}[];\nextern "C" const char ${symbol}_end[];\n`;
  table += `      {"${path}", "${kTypes[ending] ?? "application/octet-stream"}", {${symbol}, static_cast<std::size_t>(${symbol}_end - ${symbol})}, ${gzipped}},\n`;
});
writeFileSync(
  join(out, "page.cpp"),
  `#include "sentree/studio/assets.h"\n\n${data}\nnamespace sentree::studio {\n\n` +
    `std::span<const Asset> embedded_assets() {\n  static const Asset kAssets[] = {\n${table}  };\n  return kAssets;\n}\n\n` +
    `}  // namespace sentree::studio\n`,
);
