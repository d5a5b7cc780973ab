import react from "@vitejs/plugin-react";
import { readdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

/** The studio and the remote. */
const PAGES = ["index.html", "drive.html"];

/**
 * The modules `virtual:texts/studio` and `virtual:texts/remote`: the texts of one page in every language, from the files
 * that Python reads too. The environment variable MOTORCADE_LOCALES names another folder of such files.
 */
function texts(): Plugin {
  const folder = resolve(process.env.MOTORCADE_LOCALES ?? join(import.meta.dirname, "../src/motorcade/locales"));
  const prefix = "\0virtual:texts/";
  return {
    name: "texts",
    resolveId: (id) => (id.startsWith("virtual:texts/") ? `\0${id}` : null),
    load(id) {
      if (!id.startsWith(prefix)) return null;
      const files = readdirSync(folder).filter((name) => name.endsWith(".json"));
      // English comes first: it is the language that others fall back to.
      const languages = files.map((name) => name.slice(0, -5)).sort((a, b) => Number(b === "en") - Number(a === "en") || (a < b ? -1 : 1));
      const read = (language: string) => {
        const path = join(folder, `${language}.json`);
        this.addWatchFile(path);
        const { language: name, page } = JSON.parse(readFileSync(path, "utf-8")) as { language: string; page: Record<string, unknown> };
        // `page.errors` is for the server, which sends whole sentences.
        const studio = Object.fromEntries(Object.entries(page).filter(([part]) => part !== "remote" && part !== "errors"));
        return [language, { name, texts: id === `${prefix}remote` ? page.remote : studio }];
      };
      return `export default ${JSON.stringify(Object.fromEntries(languages.map(read)))}`;
    },
  };
}

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
  plugins: [react(), texts(), blocklyMedia()],
  build: { outDir: "../src/motorcade/server/page", emptyOutDir: true, chunkSizeWarningLimit: 900, rolldownOptions: { input: PAGES } },
  server: { proxy: { "^/(api/|drive/|camera)": { target: "http://127.0.0.1:7700", ws: true, changeOrigin: true } } },
  test: { environment: "jsdom", isolate: false, setupFiles: "src/test-setup.ts", include: ["src/**/*.test.{ts,tsx}"] },
});
