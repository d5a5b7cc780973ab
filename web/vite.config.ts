/// <reference types="vitest/config" />
import react from "@vitejs/plugin-react";
import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { defineConfig, type Plugin, type Rolldown } from "vite";
import { bytecode } from "./bytecode.ts";

/** The studio, the remote, the pages of a class, and the studio as static files with its service worker. */
const PAGES = ["index.html", "drive.html", "class.html", "site.html", "src/site/sw.ts"];
/** Where `python hatch_build.py` puts msgspec's wheel for Pyodide. */
const WHEELS = join(import.meta.dirname, "node_modules", ".wheels");

/** Where `motorcade studio` answers what `vite dev` asks for. */
const STUDIO = "http://127.0.0.1:7700";

interface Texts {
  [name: string]: Texts | string;
}

/** The parts of `page` that each page shows; the studio shows all that isn't in another one. `errors` is for the server. */
const PARTS: Record<string, readonly string[]> = {
  remote: ["remote", "network", "settings"],
  class: ["class", "cars", "network", "settings", "app", "missions"],
};
const NOT_OF_THE_STUDIO = ["remote", "class", "errors"];

/** A language's texts, and English ones where it has none. */
function complete(english: Texts, texts: Texts): Texts {
  const made = { ...texts };
  for (const [name, text] of Object.entries(english)) {
    const own = texts[name];
    if (typeof text === "object") made[name] = complete(text, typeof own === "object" ? own : {});
    // A language has the forms of the plural that it needs.
    else if (!(`${name.replace(/_(one|other)$/, "")}_other` in texts)) made[name] ??= text;
  }
  return made;
}

/** Texts of Blockly's own blocks, none of which is on the page, its colours and its links. */
const NOT_SHOWN = /^(CONTROLS|LISTS|TEXT|LOGIC|MATH|PROCEDURES|VARIABLES|COLOUR|LOOPS)_|BACKPACK|MUTATOR|HELPURL|_HUE$/;
/** Blockly's files that aren't named after their language. */
const BLOCKLY_FILES: Record<string, string> = { zh: "zh-hans" };

/** Blockly's own messages in a language; none where it lacks the language. */
function blocklyMessages(language: string): Record<string, string> {
  const require = createRequire(import.meta.url);
  try {
    const messages = require(`blockly/msg/${BLOCKLY_FILES[language] ?? language}`) as Record<string, string>;
    return Object.fromEntries(Object.entries(messages).filter(([name]) => !NOT_SHOWN.test(name)));
  } catch {
    return {};
  }
}

/**
 * The modules `virtual:texts/studio`, `…/remote` and `…/class` list the languages with what fetches the texts of one page,
 * `virtual:texts/<page>/<language>`: from the files that Python reads too. The environment variable MOTORCADE_LOCALES
 * names another folder of such files.
 */
function texts(): Plugin {
  const folder = resolve(process.env.MOTORCADE_LOCALES ?? join(import.meta.dirname, "../src/motorcade/locales"));
  const prefix = "\0virtual:texts/";
  return {
    name: "texts",
    resolveId: (id) => (id.startsWith("virtual:texts/") ? `\0${id}` : null),
    load(id) {
      if (!id.startsWith(prefix)) return null;
      const read = (language: string) => {
        const path = join(folder, `${language}.json`);
        this.addWatchFile(path);
        return JSON.parse(readFileSync(path, "utf-8")) as { language: string; page: Texts };
      };
      const [page = "", language] = id.slice(prefix.length).split("/");
      if (language !== undefined) {
        const texts = complete(read("en").page, read(language).page);
        texts.blockly = { ...blocklyMessages("en"), ...(texts.blockly as Texts), ...blocklyMessages(language), ...(read(language).page.blockly as Texts | undefined) };
        const isShown = (part: string) => PARTS[page]?.includes(part) ?? !NOT_OF_THE_STUDIO.includes(part);
        return `export default ${JSON.stringify(Object.fromEntries(Object.entries(texts).filter(([part]) => isShown(part))))}`;
      }
      const files = readdirSync(folder).filter((name) => name.endsWith(".json"));
      // English comes first: it is the language of those who have none of these.
      const all = files.map((name) => name.slice(0, -5)).sort((a, b) => Number(b === "en") - Number(a === "en") || (a < b ? -1 : 1));
      const entries = all.map((each) => `${JSON.stringify(each)}: { name: ${JSON.stringify(read(each).language)}, load: () => import("virtual:texts/${page}/${each}") }`);
      return `export default { ${entries.join(", ")} }`;
    },
  };
}

/** Puts the widths that ui/tokens.css declares by `@custom-media`, which browsers don't know yet, where style sheets name them. */
function widths(): Plugin {
  const tokens = join(import.meta.dirname, "src/ui/tokens.css");
  const declared = /@custom-media (--[\w-]+) (.*);\n/g;
  return {
    name: "widths",
    enforce: "pre",
    transform(code, id) {
      if (!id.split("?")[0]!.endsWith(".css") || !id.includes("/src/")) return null;
      const known = new Map([...readFileSync(tokens, "utf-8").matchAll(declared)].map(([, name, width]) => [name!, width!]));
      const named = (all: string, before: string, name: string) => before + (known.get(name) ?? this.error(`no width ${name} in ui/tokens.css: ${all}`));
      return code.replace(declared, "").replace(/(@(?:media|container) )\((--[\w-]+)\)/g, named);
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
        // Its bin and its buttons look like the page's.
        const folder = file === "sprites.svg" ? fileURLToPath(new URL("src/blocks", import.meta.url)) : media;
        this.emitFile({ type: "asset", fileName: `assets/blockly/${file}`, source: readFileSync(join(folder, file)) });
      }
    },
  };
}

/**
 * Python for browsers: Pyodide's files, msgspec's wheel and bytecode, in a folder whose name changes with their content. The
 * module `virtual:pyodide` exports the folder's address, relative to the page's, and the wheel's name.
 */
function pyodide(): Plugin {
  const runtime = dirname(createRequire(import.meta.url).resolve("pyodide/package.json"));
  const names = ["pyodide.mjs", "pyodide.asm.mjs", "pyodide.asm.wasm"];
  const files = new Map<string, Uint8Array>(names.map((name) => [name, readFileSync(join(runtime, name))]));
  const hash = createHash("sha256");
  let folder = "";
  let msgspec = "";
  return {
    name: "pyodide",
    apply: "build",
    async buildStart() {
      const wheel = readdirSync(WHEELS).find((name) => name.startsWith("msgspec-"));
      if (wheel === undefined) this.error(`${WHEELS} has no wheel of msgspec: run 'python hatch_build.py build'`);
      msgspec = wheel;
      const content = readFileSync(join(WHEELS, wheel));
      const { stdlib, packages } = await bytecode(content);
      files.set(wheel, content);
      files.set("python_stdlib.zip", stdlib);
      files.set("bytecode.zip", packages);
      files.set("pyodide-lock.json", Buffer.from(JSON.stringify(lock(runtime, wheel, content))));
      for (const content of files.values()) hash.update(content);
      folder = `assets/pyodide-${hash.digest("hex").slice(0, 12)}/`;
    },
    resolveId: (id) => (id === "virtual:pyodide" ? `\0${id}` : null),
    load: (id) => (id === "\0virtual:pyodide" ? `export const folder = ${JSON.stringify(folder)}, wheel = ${JSON.stringify(msgspec)}` : null),
    generateBundle() {
      for (const [name, source] of files) this.emitFile({ type: "asset", fileName: folder + name, source });
    },
  };
}

/** What is fetched only when the page's script runs, yet every stage needs it. */
const STAGE = "/mat/Stage.tsx";

/** What several pages need. */
const SHARED = /\/src\/(api|i18n|state)\/|\/src\/ui\/(?!files)|\/src\/(classroom\/ask|blocks\/figures|generated\/world)\.ts$|\/node_modules\/(react|react-dom|scheduler|zustand)\/|\bvite\/preload-helper/;
/** What each page of a class needs beside its own part. */
const OF_A_CLASS = /\/src\/classroom\/(Avatar\.tsx|attempt\.ts|class\.module\.css|secret\.ts)$/;

/**
 * Names the chunk of a module: a chunk for all that only the studio's pages need, one for the stage, one for what asks, and
 * one for what all pages need.
 */
function chunkNames(): (module: string, graph: Rolldown.ChunkingContext) => string | null {
  let names: Map<string, string | null> | null = null;
  const find = (graph: Rolldown.ChunkingContext) => {
    const found = new Map<string, string | null>();
    const add = (module: string, name: string | null, isWhole: boolean) => {
      if (found.has(module)) return;
      found.set(module, name);
      const { importedIds = [], dynamicallyImportedIds = [] } = graph.getModuleInfo(module) ?? {};
      for (const each of [...importedIds, ...(isWhole ? dynamicallyImportedIds : [])]) add(each, name, isWhole);
    };
    // What draws a world, on the stage and elsewhere, is one file.
    add(join(import.meta.dirname, "src/classroom/drawing.ts"), "painter", false);
    // One file, and not one for each set of pages.
    const joinShared = (name: string) => found.forEach((known, module) => (known ?? "painter") === "painter" && SHARED.test(module) && found.set(module, name));
    // A small page fetches the question, and React Aria with it, when it first asks something: in one piece. The wall
    // fetches a pupil's blocks, and what the studio needs for them too, when it shows them.
    const [question, blocks] = ["ui/QuestionDialog.tsx", "classroom/ShownBlocks.tsx"].map((file) => join(import.meta.dirname, "src", file)) as [string, string];
    found.set(question, "kit").set(blocks, null);
    for (const page of ["remote", "classroom"]) add(join(import.meta.dirname, `src/${page}/main.tsx`), null, true);
    joinShared("shared");
    for (const module of found.keys()) if (OF_A_CLASS.test(module)) found.set(module, "classroom");
    found.delete(question);
    found.delete(blocks);
    add(blocks, null, false);
    joinShared("programs");
    add(question, "kit", false);
    add(join(import.meta.dirname, "src/app/App.tsx"), "studio", false);
    add(join(import.meta.dirname, "src/mat/Stage.tsx"), "stage", false);
    return found;
  };
  return (module, graph) => (names ??= find(graph)).get(module) ?? null;
}

/** Lets the studio's pages fetch the stage and its styles beside their script. */
function stageFirst(): Plugin {
  return {
    name: "stage-first",
    apply: "build",
    transformIndexHtml: {
      order: "post",
      handler(html, { bundle = {}, chunk }) {
        const chunks = Object.values(bundle).filter((each) => each.type === "chunk");
        const [scripts, styles] = [new Set<string>(), new Set<string>()];
        const add = (name: string) => {
          const found = chunks.find(({ fileName }) => fileName === name);
          found?.viteMetadata?.importedCss.forEach((each) => html.includes(each) || styles.add(each));
          if (html.includes(name) || scripts.has(name)) return;
          scripts.add(name);
          found?.imports.forEach(add);
        };
        const stage = chunks.filter(({ moduleIds }) => moduleIds.some((module) => module.endsWith(STAGE)));
        if (chunk?.name !== "drive" && chunk?.name !== "class") for (const { fileName } of stage) add(fileName);
        const link = (rel: string, name: string) => ({ tag: "link", attrs: { rel, crossorigin: true, href: `./${name}` }, injectTo: "head" as const });
        return [...[...scripts].map((name) => link("modulepreload", name)), ...[...styles].map((name) => link("stylesheet", name))];
      },
    },
  };
}

/** Pyodide's list of packages, with msgspec alone in place of hundreds that are on another host. */
function lock(runtime: string, wheel: string, content: Buffer): object {
  const { info } = JSON.parse(readFileSync(join(runtime, "pyodide-lock.json"), "utf-8")) as { info: object };
  const msgspec = {
    name: "msgspec",
    version: wheel.split("-")[1],
    file_name: wheel,
    install_dir: "site",
    sha256: createHash("sha256").update(content).digest("hex"),
    package_type: "package",
    imports: ["msgspec"],
    depends: [],
    unvendored_tests: false,
  };
  return { info, packages: { msgspec } };
}

// Tests of what lasts as long as a page, or of no page: each file needs an environment of its own.
const ALONE = ["mat/session", "projects/autosave", "projects/keeper", "projects/share", "pupil/store", "structure"].map((name) => `src/${name}.test.ts`);

export default defineConfig({
  // Relative addresses: the site may be below any path.
  base: "./",
  worker: { format: "es" },
  plugins: [react(), widths(), texts(), blocklyMedia(), pyodide(), stageFirst()],
  build: {
    outDir: "../src/motorcade/server/page",
    emptyOutDir: true,
    chunkSizeWarningLimit: 900,
    // What it is for, every browser that runs the page's Python does by itself.
    modulePreload: { polyfill: false },
    rolldownOptions: {
      input: PAGES,
      output: {
        entryFileNames: (chunk) => (chunk.name === "sw" ? "sw.js" : "assets/[name]-[hash].js"),
        codeSplitting: { groups: [{ debugName: "studio and stage", name: chunkNames(), includeDependenciesRecursively: false }] },
      },
    },
  },
  // `vite dev` shows the pages that a server answers; the site needs files that only a build makes.
  optimizeDeps: { entries: ["index.html", "drive.html", "class.html"] },
  // At the host of the studio, whose cookie the browser then sends to both ports; the studio takes its own origin alone.
  server: {
    host: "127.0.0.1",
    proxy: { "^/(api/|drive/|camera|assets/blockly/)": { target: STUDIO, ws: true, changeOrigin: true, headers: { origin: STUDIO } } },
  },
  test: {
    environment: "jsdom",
    // Nothing is slow by itself; a busy computer may take ten times as long.
    testTimeout: 120_000,
    hookTimeout: 120_000,
    setupFiles: "src/test-setup.ts",
    projects: [
      // One page for many files takes a quarter of the time.
      {
        extends: true,
        test: {
          name: "together",
          isolate: false,
          setupFiles: ["src/test-together.ts"],
          include: ["src/**/*.test.{ts,tsx}"],
          exclude: ALONE,
        },
      },
      { extends: true, test: { name: "alone", include: ALONE } },
    ],
  },
});
