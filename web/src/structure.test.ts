// @vitest-environment node
/** Checks of all files of the page: no circles of imports, no class without a use. */

import { globSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path/posix";
import { describe, expect, it } from "vitest";

const read = (pattern: string) =>
  new Map(
    globSync(pattern, { cwd: import.meta.dirname }).map((path) => [
      path.replaceAll("\\", "/"),
      readFileSync(join(import.meta.dirname, path), "utf-8"),
    ]),
  );
const files = read("**/*.{ts,tsx}");
const styles = read("**/*.module.css");
const kit = read("ui/*.css").get("ui/layout.css")!;

/** The files that a file imports: for types alone and lazily too. */
function importsOf(path: string, text: string): string[] {
  const names = [...text.matchAll(/(?:from|import)\s*\(?\s*"(\.{1,2}(?:\/[^"]*)?)"/g)].map((match) => match[1]!);
  return names.flatMap((name) => {
    const target = join(dirname(path), name);
    return [`${target}.ts`, `${target}.tsx`, join(target, "index.ts")].filter((each) => files.has(each));
  });
}

/** The files of a circle of imports, in its order; null where there is none. */
function findCircle(imports: ReadonlyMap<string, string[]>): string[] | null {
  const done = new Set<string>();
  const visit = (path: string, way: string[]): string[] | null => {
    if (way.includes(path)) return way.slice(way.indexOf(path));
    if (done.has(path)) return null;
    for (const next of imports.get(path) ?? []) {
      const circle = visit(next, [...way, path]);
      if (circle) return circle;
    }
    done.add(path);
    return null;
  };
  for (const path of imports.keys()) {
    const circle = visit(path, []);
    if (circle) return circle;
  }
  return null;
}

describe("the imports", () => {
  const imports = new Map([...files].map(([path, text]) => [path, importsOf(path, text)]));

  it("have no circle", () => {
    expect(imports.get("main.tsx")).toContain("app/App.tsx");
    expect(findCircle(imports)).toBeNull();
  });

  it("point from the page's areas to what they share", () => {
    const shared = ["api", "generated", "i18n", "state", "ui"];
    const areaOf = (path: string) => path.split("/")[0]!;
    const wrong = [...imports].filter(([path]) => !path.includes(".test.")).flatMap(([path, targets]) =>
      targets.filter((target) => shared.includes(areaOf(path)) && !shared.includes(areaOf(target))).map((target) => `${path} -> ${target}`),
    );
    expect(wrong).toEqual([]);
  });
});

describe("the style sheets", () => {
  /** Each import of a CSS module: who imports it under which name. */
  const uses = [...files].flatMap(([path, text]) =>
    [...text.matchAll(/import (\w+) from "(\.[^"]*\.module\.css)"/g)].map((match) => ({
      sheet: join(dirname(path), match[2]!),
      classes: [...text.matchAll(new RegExp(`(?<![\\w./])${match[1]!}\\.(\\w+)`, "g"))].map((use) => use[1]!),
    })),
  );
  const definedIn = (css: string) =>
    new Set([...css.replace(/\/\*.*?\*\//gs, "").replace(/:global\([^)]*\)/g, "").replace(/\{[^{}]*\}/g, "{}").matchAll(/\.([a-zA-Z][\w-]*)/g)].map((match) => match[1]!));

  it.each([...styles.keys()])("%s has exactly the classes that are used", (sheet) => {
    const used = new Set(uses.filter((use) => use.sheet === sheet).flatMap(({ classes }) => classes));
    const defined = definedIn(styles.get(sheet)!);
    expect({ unused: [...defined].filter((name) => !used.has(name)), undefined: [...used].filter((name) => !defined.has(name)) }).toEqual({ unused: [], undefined: [] });
  });

  it("share the classes of ui/layout.css: all that are named exist, and all that exist are named", () => {
    const composed = [...styles.values()].flatMap((css) => [...css.matchAll(/composes: (.*) from global;/g)].map((match) => match[1]!));
    // Whatever stands in quotes where a class can stand.
    const named = [...files].flatMap(([path, text]) =>
      path.includes(".test.") ? [] : [...text.matchAll(/className="([^"]*)"|classes\(([^;{}]*)/g)].flatMap(([, plain, joined]) => plain ?? [...(joined ?? "").matchAll(/(?:^|, |&& )"([a-z -]+)"/g)].map((match) => match[1]!)),
    );
    const used = new Set([...composed, ...named].flatMap((names) => names.split(" ")));
    const defined = new Set([...kit.matchAll(/\.([a-z][a-z-]*)/g)].map((match) => match[1]!));
    expect({ unused: [...defined].filter((name) => !used.has(name)), undefined: [...used].filter((name) => !defined.has(name)) }).toEqual({ unused: [], undefined: [] });
  });

  it("name widths of the page in ui/tokens.css alone", () => {
    const own = [...styles].filter(([, css]) => /@(media|container)[^{]*(width|height|orientation)/.test(css)).map(([path]) => path);
    expect(own).toEqual([]);
  });
});
