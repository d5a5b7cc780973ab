import react from "@vitejs/plugin-react";
import { readdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

/** The studio and the remote. */
const PAGES = ["index.html", "drive.html"];

/** Blockly's pictures, served beside the page: no other host is ever asked for them. */
function blocklyMedia(): Plugin {
  const media = join(dirname(createRequire(import.meta.url).resolve("blockly")), "media");
  return {
    name: "blockly-media",
    apply: "build",
    generateBundle() {
      for (const file of readdirSync(media).filter((name) => !name.endsWith(".mp3"))) {
        this.emitFile({ type: "asset", fileName: `assets/blockly/${file}`, source: readFileSync(join(media, file)) });
      }
    },
  };
}

export default defineConfig({
  plugins: [react(), blocklyMedia()],
  build: { outDir: "../src/motorcade/server/page", emptyOutDir: true, chunkSizeWarningLimit: 900, rolldownOptions: { input: PAGES } },
  server: { proxy: { "^/(api/|drive/|camera)": { target: "http://127.0.0.1:7700", ws: true, changeOrigin: true } } },
  test: { environment: "jsdom", setupFiles: "src/test-setup.ts", include: ["src/**/*.test.{ts,tsx}"] },
});
