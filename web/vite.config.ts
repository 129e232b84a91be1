import react from "@vitejs/plugin-react";
import { defineConfig } from "vitest/config";

import { notices } from "./build/notices";

// `npm run dev` shows the page of this tree over a run that `sentree run … --studio` serves elsewhere.
const server = process.env["SENTREE_STUDIO"] ?? "http://127.0.0.1:8080";

export default defineConfig({
  base: "./",
  plugins: [react(), notices()],
  build: {
    target: "es2022",
    // The program's content policy allows files of its own origin only: neither inline scripts nor data: URLs.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    // One version of the sources, one set of names: the program embeds them.
    reportCompressedSize: true,
  },
  server: {
    proxy: {
      "/api": {
        target: server,
        ws: true,
        changeOrigin: true,
        // The program refuses requests of another origin.
        rewriteWsOrigin: true,
        headers: { origin: server },
      },
    },
  },
  test: { include: ["src/**/*.test.{ts,tsx}", "build/**/*.test.ts"] },
});
