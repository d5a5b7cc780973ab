// Compiles a .ksy into a folder: node compile_kaitai.mjs SPEC.ksy FOLDER
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import compiler from "kaitai-struct-compiler";
import { parse } from "yaml";

const [spec, folder] = process.argv.slice(2);
for (const language of ["python", "javascript"]) {
  const files = await compiler.compile(language, parse(readFileSync(spec, "utf8")));
  for (const [name, text] of Object.entries(files)) writeFileSync(join(folder, name), text);
}
