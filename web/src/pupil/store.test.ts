import { describe, expect, it } from "vitest";
import { lookingIn } from "./store";

describe("the address of a pupil's project", () => {
  it.each([
    ["?pupil=01&project=Robot", { pupil: "01", project: "Robot" }],
    ["?pupil=01&project=", { pupil: "01", project: "" }],
    ["?pupil=01", { pupil: "01", project: "" }],
    [`?${new URLSearchParams({ pupil: "02", project: "a&b=#?舞" }).toString()}`, { pupil: "02", project: "a&b=#?舞" }],
    ["", null],
    ["?project=Robot", null],
    ["?pupil=&project=Robot", null],
  ])("%s", (search, expected) => expect(lookingIn(search)).toEqual(expected));
});
