// Parses bytes with what Kaitai made: node run_kaitai.mjs PARSER.js CLASS, and on standard input a JSON list of
// [type or "" for the whole, field names, bytes in hex]. Prints a list: the fields' values, or what the error is called.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const require = createRequire(import.meta.url);
const KaitaiStream = require("kaitai-struct/KaitaiStream");
const [file, className] = process.argv.slice(2);
const Parser = require(file)[className];

const camel = (name) => name.replace(/_(.)/g, (_, letter) => letter.toUpperCase());
const values = (parsed, names) => names.map((name) => Number(parsed[camel(name)]));

function parse([type, names, hex]) {
  const stream = new KaitaiStream(Uint8Array.from(Buffer.from(hex, "hex")).buffer);
  try {
    if (type) return values(new Parser[type](stream), names);
    const whole = new Parser(stream);
    if (!stream.isEof()) return "more bytes behind";
    const lists = whole.header ? [[whole.header], whole.leader, whole.followers] : [whole.words];
    return lists.map((words, index) => words.map((word) => values(word, names[index])));
  } catch (error) {
    return error.name ?? String(error);
  }
}

console.log(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(parse)));
