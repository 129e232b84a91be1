import eslint from "@eslint/js";
import imports from "eslint-plugin-import";
import hooks from "eslint-plugin-react-hooks";
import typescript from "typescript-eslint";

// Who may import whom, from the bottom up; also in README.md.
const kLayers = ["protocol", "draw", "store", "widgets", "picture", "panels", "design", "shell"];

export default typescript.config(
  { ignores: ["dist/", "node_modules/"] },
  eslint.configs.recommended,
  { languageOptions: { globals: { console: "readonly", process: "readonly", setTimeout: "readonly", clearTimeout: "readonly", performance: "readonly", URL: "readonly" } } },
  {
    files: ["src/**/*.{ts,tsx}", "build/**/*.ts", "*.ts"],
    extends: [typescript.configs.recommended],
    plugins: { "import": imports, "react-hooks": hooks },
    settings: { "import/resolver": { node: { extensions: [".ts", ".tsx", ".js"] } }, "import/extensions": [".ts", ".tsx"], "import/parsers": { "@typescript-eslint/parser": [".ts", ".tsx"] } },
    rules: {
      ...hooks.configs.recommended.rules,
      "import/no-cycle": ["error", { ignoreExternal: true }],
      "import/no-restricted-paths": [
        "error",
        { basePath: import.meta.dirname, zones: kLayers.slice(0, -1).map((layer, i) => ({ target: `src/${layer}`, from: kLayers.slice(i + 1).map((above) => `src/${above}`) })) },
      ],
      "@typescript-eslint/no-unused-vars": ["error", { argsIgnorePattern: "^_", varsIgnorePattern: "^_", destructuredArrayIgnorePattern: "^_" }],
    },
  },
  {
    // Code in `evaluate` runs in the page.
    files: ["e2e/**/*.mjs"],
    languageOptions: {
      globals: Object.fromEntries(
        ["document", "window", "location", "WebSocket", "requestAnimationFrame", "getComputedStyle", "innerHeight", "innerWidth", "navigator", "localStorage", "DOMParser", "PerformanceObserver", "Event", "HTMLElement", "Image", "fetch", "MouseEvent", "MutationObserver", "WheelEvent", "KeyboardEvent", "Blob", "structuredClone"].map((name) => [name, "readonly"]),
      ),
    },
  },
);
