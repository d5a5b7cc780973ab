import { expect, it } from "vitest";
import { startSettings, useSettings } from "./settings";

const begin = (text: string) => {
  useSettings.setState(useSettings.getInitialState(), true);
  localStorage.setItem("motorcade.settings", text);
  startSettings();
  return useSettings.getState();
};

it.each(["null", "7", "[]", "{", '"text"', '{"shares": null, "drawer": null}', '{"drawer": {"tab": "gone", "open": true}, "shares": {"blocks": "wide"}}'])(
  "begins as new where %s was stored",
  (text) => expect(begin(text)).toEqual({ ...useSettings.getInitialState(), theme: "light" }),
);

it("keeps what is good beside what is not", () => {
  const { theme, level, sound, shares } = begin('{"theme": "purple", "level": "python", "sound": false, "shares": {"blocks": 0.6}, "old": 1}');
  expect({ theme, level, sound }).toEqual({ theme: "light", level: "python", sound: false });
  expect(shares).toEqual({ ...useSettings.getInitialState().shares, blocks: 0.6 });
});
