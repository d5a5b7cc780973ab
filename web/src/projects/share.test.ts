// @vitest-environment node
import { describe, expect, it } from "vitest";
import { fragmentOf, MOST_BYTES, projectIn } from "./share";

describe("a share link", () => {
  it("gives back what it was made of, in any language", async () => {
    const text = JSON.stringify({ format: "motorcade-program/1", leader: Array(300).fill({ wait: { seconds: 1 } }) });
    const fragment = await fragmentOf("队列 & <parade>", text);
    expect(fragment).toMatch(/^#project=[A-Za-z0-9_-]+$/);
    expect(fragment.length).toBeLessThan(text.length / 4);
    expect(await projectIn(fragment)).toEqual({ name: "队列 & <parade>", text });
  });

  it("is only seen where there is one", async () => {
    expect(await projectIn("")).toBeNull();
    expect(await projectIn("#words")).toBeNull();
  });

  it("fails where it was cut or changed", async () => {
    const fragment = await fragmentOf("a", '{"leader": []}');
    await expect(projectIn(fragment.slice(0, -8))).rejects.toThrow();
    await expect(projectIn("#project=!!!")).rejects.toThrow();
    await expect(projectIn(await fragmentOf("a", 7 as unknown as string))).rejects.toThrow(TypeError);
  });

  it("is refused by its length before anything of it is unpacked", async () => {
    await expect(projectIn(`#project=${"A".repeat(200_000)}`)).rejects.toThrow(RangeError);
  });

  it("can't be a bomb", async () => {
    const fragment = await fragmentOf("a", " ".repeat(MOST_BYTES));
    expect(fragment.length).toBeLessThan(10_000);
    await expect(projectIn(fragment)).rejects.toThrow(RangeError);
  });
});
