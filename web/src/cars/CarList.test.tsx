import { renderToString } from "react-dom/server";
import { afterAll, expect, it } from "vitest";
import texts from "virtual:texts/class";
import { changeLanguage, startTexts } from "../i18n";
import { CarList } from "./CarList";

afterAll(() => changeLanguage("en"));

it("speaks the page's language from its first picture on", async () => {
  await startTexts(texts);
  const shown = async (language: string) => {
    await changeLanguage(language);
    return renderToString(<CarList path="/api/cars" image={null} program="" />);
  };
  expect(await shown("zh")).toContain("全部停下");
  expect(await shown("en")).toContain("Stop all");
});
